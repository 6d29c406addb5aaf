/* SPDX-License-Identifier: Apache-2.0 */
/* gb/adaptive.h -- granular balls where the scene needs them: the partition that is cut best first, to a
   given number of balls. */
#ifndef GBT_GB_ADAPTIVE_H
#define GBT_GB_ADAPTIVE_H

#include "gb/balls.h"

typedef struct adaptive_def {
    float voxel_size; /* v: differences of position below this do not matter, scene units, > 0. No default:
                         see balls_voxel_size() */
    float color_unit; /* tau: nor do differences of colour below this, > 0. Default 0.1 */
    size_t balls_max; /* cutting ends there, >= 1. No default */
    float min_scale;  /* gamma, eq 21: radii are at least gamma v. Default 0.25 */
} adaptive_def;

adaptive_def adaptive_def_default(void);

/**
 * Partition a cloud into at most balls_max balls, best first. docs/balls.md has the equations and what they
 * were measured against.
 *
 * A set costs L = n / 2 ln det(I + C) nats (a coding length as in Ma 2007), C being the covariance of y = (x
 * / v, colour / tau). The set whose cut saves the most, L(set) - L(left) - L(right), is cut next: along the
 * principal axis of C, between the two means that the points fall into (2-means along the axis, from the
 * mean: the split of Xia 2019). Sets of points that are all in one place are not cut, nor sets at depth 254.
 * The balls for m are those for m + 1 with two of them joined. Without ties they do not depend on the order
 * of the points; equal savings are taken from the left.
 *
 * @param position [in] [count][3], finite
 * @param color    [in] [count][3] in [0, 1], or NULL: positions alone decide
 * @param out      [out] free with balls_free(); in the order of the tree, left before right; zeroed on
 *                       failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, non-finite point, colour outside [0, 1]: says which),
 *         GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: O(n log balls_max) time on one thread where cuts are even,
 * 25 n + 24 balls_max bytes of scratch.
 */
gbt_status balls_adapt(const float *position, const float *color, size_t count, const adaptive_def *def,
                       balls *out, gbt_error *err);

#endif
