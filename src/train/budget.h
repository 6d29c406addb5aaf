/* SPDX-License-Identifier: Apache-2.0 */
/* train/budget.h -- how many steps each part of a run with a time budget gets.

   The parts take equal times: what is left of the budget, shared by the parts that are left, over what a step
   of the next one is expected to take. */
#ifndef GBT_TRAIN_BUDGET_H
#define GBT_TRAIN_BUDGET_H

#include "train/trainer.h"

/** How long a step takes: so much by itself, and so much for its pixels with the hits of loose rays; means
   over about the last quarter of a part. {0} knows nothing. */
typedef struct step_speed {
    double fixed_seconds, pixel_seconds;
    uint64_t steps; /* measured */
} step_speed;

/** @param step that `r` is of, in a known part of t->pace */
void budget_follow(step_speed *s, const trainer *t, uint64_t step, const step_report *r);

/** Give the next part of t->pace its steps, by t->seconds of def.budget_seconds. */
void budget_extend(trainer *t, const step_speed *s);

#endif
