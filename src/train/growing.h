/* SPDX-License-Identifier: Apache-2.0 */
/* train/growing.h -- when a run grows and prunes anchors, with which settings, and the update of everything
   stored per anchor. growth/growth.h has the round itself. */
#ifndef GBT_TRAIN_GROWING_H
#define GBT_TRAIN_GROWING_H

#include "train/trainer.h"

/** Does the next step gather statistics for growth? */
bool growing_gathers(const trainer *t);

/** Is a growth round due in the next step? One is due whenever progress passes a multiple of 1/100 of the run
    (with the reference's rules, of 100 steps: train/rules.h) between start and end of growth. */
bool growing_is_due(const trainer *t);

/** I of a round in the next step (growth_def.interval): the number of views gathered since the last round,
    clamped to [20, 100]. The reference method always uses 100, although more views precede its first
    round. */
float growing_interval(const trainer *t);

/** Grow and prune: anchors, gradients and Adam moments change together; moments of new anchors are 0. GBT_OK,
    GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL (Embree). */
gbt_status growing_round(trainer *t, gbt_error *err);

#endif
