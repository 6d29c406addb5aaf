/* SPDX-License-Identifier: Apache-2.0 */
/* train/scale_limit.h -- upper limit of the scales of each anchor. */
#ifndef GBT_TRAIN_SCALE_LIMIT_H
#define GBT_TRAIN_SCALE_LIMIT_H

#include "train/trainer.h"

/**
 * Set t->scale_log_max, the upper limits of the log-scales of the present anchors: rules.widest times the
 * distance to the nearest training camera (at its pose in the data set), and at most t->scale_log_limit. A
 * Gaussian wider than its distance encloses cameras: it becomes a veil over everything behind it, and no
 * photo can separate the two (docs/decisions/2026-11-26-no-wider-than-far.md). Call it after anchors have
 * been added or removed.
 *
 * @return GBT_OK, GBT_ERR_NO_MEMORY or GBT_ERR_INTERNAL (Embree); cost: a search in the tree of cameras for
 * each anchor
 */
gbt_status scale_limit_update(trainer *t, gbt_error *err);

#endif
