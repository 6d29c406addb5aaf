/* SPDX-License-Identifier: Apache-2.0 */
/* data/split.h -- decides which views are held out. */
#ifndef GBT_DATA_SPLIT_H
#define GBT_DATA_SPLIT_H

#include "data/scene.h"

enum { SCENE_SPLIT_DEFAULT_EVERY = 8 };

/**
 * Set is_test of all views. They must be sorted by name, and marked if the data set has its own split. With
 * validate_every, the held-out views are removed. It is an error if no view is left to train on, or if
 * validation holds out none.
 */
gbt_status split_apply(const scene_split *split, scene *s, gbt_error *err);

#endif
