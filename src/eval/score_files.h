/* SPDX-License-Identifier: Apache-2.0 */
/* eval/score_files.h -- the scores of a run as files: metrics.json, and TensorBoard's. */
#ifndef GBT_EVAL_SCORE_FILES_H
#define GBT_EVAL_SCORE_FILES_H

#include <jansson.h>
#include <stdint.h>

#include "eval/scores.h"

/** What metrics.json says of a run: its scores, and what training left in RUN/train.json. Free with
    json_decref(); NULL without memory. */
json_t *score_files_json(const evaluation *e, const char *run);

/** Scores and the first pictures for TensorBoard, at step `step`, in RUN, in place of what an earlier call
    wrote. */
gbt_status score_files_events(const evaluation *e, uint64_t step, const char *run, gbt_error *err);

#endif
