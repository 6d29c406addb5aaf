/* SPDX-License-Identifier: Apache-2.0 */
/* report/training.h -- how training went: curves over time, and where its time went. */
#ifndef GBT_REPORT_TRAINING_H
#define GBT_REPORT_TRAINING_H

#include <jansson.h>

#include "eval/scores.h"
#include "report/text.h"

/** Add the sections "Training" and "Where the time goes" from RUN/log.csv and what metrics.json holds. */
void report_training(text *out, const char *run, const evaluation *e, const json_t *metrics);

#endif
