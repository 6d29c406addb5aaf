/* SPDX-License-Identifier: Apache-2.0 */
/* train/horizon.h -- which way is up, for a sky that ends at the horizon (base/sky.h). Below it, what is
   uniform would be drawn by the sky (docs/decisions/2026-11-24-sky.md). */
#ifndef GBT_TRAIN_HORIZON_H
#define GBT_TRAIN_HORIZON_H

#include <stdbool.h>

#include "data/scene.h"

/**
 * The mean of what is up in the photos.
 *
 * @param views [in]  [count] indices into s->views, at least one
 * @param up    [out] unit; 0 when the result is false
 * @return false where the photos disagree: the mean of their unit vectors is shorter than 0.5
 */
bool horizon_find(const scene *s, const size_t *views, size_t count, float up[3]);

#endif
