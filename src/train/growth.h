/* SPDX-License-Identifier: Apache-2.0 */
/* train/growth.h -- growing and pruning during a run: statistics of every step, rounds in which the anchors
   change (anchor/adjust.h). */
#ifndef GBT_TRAIN_GROWTH_H
#define GBT_TRAIN_GROWTH_H

#include "train/trainer.h"

/** After frame_backward() of the step: add what it says of every anchor and offset to t->stats. */
void growth_gather(trainer *t);

/** Does the step from `progress` to `next` pass a multiple of 1/100 of the run (or of 100 steps:
   train/rules.h) between start and end of growth? */
bool growth_is_due(const trainer *t, double progress, double next);

/** Grow and prune: anchors, gradients and moments change together; new anchors have no momentum. GBT_OK,
    GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL (Embree). */
gbt_status growth_adjust(trainer *t, gbt_error *err);

#endif
