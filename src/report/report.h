/* SPDX-License-Identifier: Apache-2.0 */
/* report/report.h -- RUN/report.html: a single file that needs no network. */
#ifndef GBT_REPORT_REPORT_H
#define GBT_REPORT_REPORT_H

#include <jansson.h>

#include "eval/scores.h"
#include "gbtrace/status.h"
#include "run/loaded_run.h"

/** What a page can show besides the scores. */
typedef struct report_more {
    loaded_run *open; /* the run with its data set, for maps and pictures of the scene; NULL: these are left
                         out */
    const char *const *studies; /* [study_count] folders of studies, or SVG files; RUN and RUN/studies are
                                   always searched */
    size_t study_count;
} report_more;

/**
 * Write RUN/report.html from the scores, from metrics.json and from RUN/log.csv.
 *
 * @param metrics [in] the object that metrics.json was written from
 * @param more    [in] optional (NULL); a view is rendered with more->open
 */
gbt_status report_write(const char *run, const evaluation *e, const json_t *metrics, const report_more *more,
                        gbt_error *err);

#endif
