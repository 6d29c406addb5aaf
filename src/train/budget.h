/* SPDX-License-Identifier: Apache-2.0 */
/* train/budget.h -- how many steps each part of a run with a time budget gets.

   All parts take equal time. The steps of the next part are (remaining budget / remaining parts) / (expected
   time of one of its steps). */
#ifndef GBT_TRAIN_BUDGET_H
#define GBT_TRAIN_BUDGET_H

#include "train/trainer.h"

/** Measured time of a step: a fixed part, and a part proportional to pixels times hits (in units of loose
    rays). Means over about the last quarter of a part of the schedule; {0} is the state before any
    measurement. */
typedef struct step_speed {
    double fixed_seconds, pixel_seconds;
    uint64_t steps; /* number of steps measured */
} step_speed;

/** @param step that `r` describes, in a known part of t->pace */
void budget_follow(step_speed *s, const trainer *t, uint64_t step, const step_report *r);

/** Set the number of steps of the next part of t->pace, from t->seconds spent of def.budget_seconds. */
void budget_extend(trainer *t, const step_speed *s);

#endif
