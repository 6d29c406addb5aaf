/* SPDX-License-Identifier: Apache-2.0 */
/* data/split.h -- which views are held out. */
#ifndef GBT_DATA_SPLIT_H
#define GBT_DATA_SPLIT_H

#include "data/scene.h"

enum { SCENE_SPLIT_DEFAULT_EVERY = 8 };

/**
 * Set is_test of the views, which are sorted by name and marked where the data set has a split of its own;
 * with validate_every, remove those that it holds out. A split that leaves no view to train on is an error,
 * and validation that holds out none.
 */
gbt_status split_apply(const scene_split *split, scene *s, gbt_error *err);

#endif
