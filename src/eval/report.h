/* eval/report.h -- RUN/report.html: one file, no network. */
#ifndef GBT_EVAL_REPORT_H
#define GBT_EVAL_REPORT_H

#include <jansson.h>

#include "eval/evaluate.h"
#include "gbtrace/status.h"

/**
 * Write RUN/report.html from the scores, what metrics.json holds and RUN/log.csv.
 *
 * @param metrics [in] the object that metrics.json was written from
 */
gbt_status report_write(const char *run, const evaluation *e, const json_t *metrics, gbt_error *err);

#endif
