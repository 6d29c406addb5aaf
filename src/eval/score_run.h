/* SPDX-License-Identifier: Apache-2.0 */
/* eval/score_run.h -- render the held-out views of a run and score them against their photos. */
#ifndef GBT_EVAL_SCORE_RUN_H
#define GBT_EVAL_SCORE_RUN_H

#include "eval/lpips.h"
#include "run/loaded_run.h"
#include "eval/scores.h"

/**
 * Render and score every held-out view.
 *
 * @param pictures [in] write renders, photos and FLIP maps into RUN/renders/test
 * @param net [in] optional (NULL): also compute LPIPS
 * @param e   [out] start from {0}; free e->views with mem_free() after success or failure; means are NaN
 *                  without views
 */
gbt_status score_run(loaded_run *r, const char *run, bool pictures, const lpips *net, evaluation *e,
                     gbt_error *err);

#endif
