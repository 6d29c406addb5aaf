/* SPDX-License-Identifier: Apache-2.0 */
/* train/seen_points.h -- check that the sparse points match the cameras. */
#ifndef GBT_TRAIN_SEEN_POINTS_H
#define GBT_TRAIN_SEEN_POINTS_H

#include <stdbool.h>

#include "data/scene.h"

/** Whether at least half of the training photos see a sparse point. Otherwise the points are useless: they
    may be in another coordinate system, with a few in view by chance. Cost: at most 2^14 projections for each
    photo. */
bool seen_points_match_cameras(const scene *s);

#endif
