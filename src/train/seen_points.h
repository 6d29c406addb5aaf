/* SPDX-License-Identifier: Apache-2.0 */
/* train/seen_points.h -- do the sparse points belong to the photos? */
#ifndef GBT_TRAIN_SEEN_POINTS_H
#define GBT_TRAIN_SEEN_POINTS_H

#include <stdbool.h>

#include "data/scene.h"

/** Whether half of the photos to train on see a sparse point. Points that most do not see say nothing of what
    to render: they may be in another coordinate system, with a few of them in view by chance. Cost: at most
    2^14 projections for each photo. */
bool seen_points_tell(const scene *s);

#endif
