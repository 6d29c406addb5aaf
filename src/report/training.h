/* SPDX-License-Identifier: Apache-2.0 */
/* report/training.h -- the sections about training: curves over time, and the time of each stage. */
#ifndef GBT_REPORT_TRAINING_H
#define GBT_REPORT_TRAINING_H

#include <jansson.h>

#include "eval/scores.h"
#include "report/text.h"

/** Add the sections "Training" and "Where the time goes", from RUN/log.csv and metrics.json. */
void report_training(text *out, const char *run, const evaluation *e, const json_t *metrics);

#endif
