/* SPDX-License-Identifier: Apache-2.0 */
/* train/growing.h -- growing and pruning during a run: when, by which rules, and what follows the anchors
   (growth/growth.h has the round). */
#ifndef GBT_TRAIN_GROWING_H
#define GBT_TRAIN_GROWING_H

#include "train/trainer.h"

/** Does the next step gather statistics for growth? */
bool growing_gathers(const trainer *t);

/** Does the next step pass a multiple of 1/100 of the run (or of 100 steps: train/rules.h) between start and
    end of growth? */
bool growing_is_due(const trainer *t);

/** I of a round in the next step (growth_def.interval): views gathered since the last round, 20 at least and
    100 at most. The reference has 100 steps', though more come before its first round. */
float growing_interval(const trainer *t);

/** Grow and prune: anchors, gradients and moments change together; new anchors have no momentum. GBT_OK,
    GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL (Embree). */
gbt_status growing_round(trainer *t, gbt_error *err);

#endif
