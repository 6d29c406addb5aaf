/* SPDX-License-Identifier: Apache-2.0 */
/* train/scale_limit.h -- how wide the Gaussians of each anchor may become. */
#ifndef GBT_TRAIN_SCALE_LIMIT_H
#define GBT_TRAIN_SCALE_LIMIT_H

#include "train/trainer.h"

/**
 * The largest log-scales of the anchors as they are now, to t->scale_log_max: rules.widest times the distance
 * to the nearest training camera, where the data set has it, and at most t->scale_log_limit. A Gaussian that
 * is wider than it is far encloses cameras: a veil before all that is behind it, which no photo tells from
 * what it hides (docs/decisions/2026-11-26-no-wider-than-far.md). To be called when anchors have been made or
 * removed.
 *
 * @return GBT_OK, GBT_ERR_NO_MEMORY or GBT_ERR_INTERNAL (Embree); cost: a search in the tree of cameras for
 * each anchor
 */
gbt_status scale_limit_update(trainer *t, gbt_error *err);

#endif
