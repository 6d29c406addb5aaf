/* SPDX-License-Identifier: Apache-2.0 */
/* eval/score_files.h -- write the scores of a run: metrics.json, and TensorBoard events. */
#ifndef GBT_EVAL_SCORE_FILES_H
#define GBT_EVAL_SCORE_FILES_H

#include <jansson.h>
#include <stdint.h>

#include "eval/scores.h"

/** Contents of metrics.json: the scores of a run, and the data of RUN/train.json. Free with json_decref();
    NULL without memory. */
json_t *score_files_json(const evaluation *e, const char *run);

/** Write scores and the first images as TensorBoard events of step `step` into RUN, replacing those of an
    earlier call. */
gbt_status score_files_events(const evaluation *e, uint64_t step, const char *run, gbt_error *err);

#endif
