/* SPDX-License-Identifier: Apache-2.0 */
/* gb/adaptive.h -- adaptive granular balls: a best-first partition of a cloud into a given number of
   balls. */
#ifndef GBT_GB_ADAPTIVE_H
#define GBT_GB_ADAPTIVE_H

#include "gb/balls.h"

typedef struct adaptive_def {
    float voxel_size; /* v: differences in position below this are ignored, scene units, > 0. No default: see
                         balls_voxel_size() */
    float color_unit; /* tau: differences in colour below this are ignored, > 0. Default 0.1 */
    size_t balls_max; /* maximum number of balls, >= 1. No default */
    float min_scale;  /* gamma, eq 21: radii are at least gamma v. Default 0.25 */
} adaptive_def;

adaptive_def adaptive_def_default(void);

/**
 * Partition a cloud into at most balls_max balls, best first. docs/balls.md has the equations and a
 * comparison with other partitions.
 *
 * A set costs L = n / 2 ln det(I + C) nats (a coding length as in Ma 2007), where C is the covariance of y =
 * (x / v, colour / tau). The set whose cut saves the most, L(set) - L(left) - L(right), is cut next: along
 * the principal axis of C, by 2-means started from the mean (the split of Xia 2019). Sets at a single
 * position and sets at depth 254 are not cut. The balls for m are those for m + 1 with two of them joined.
 * Without ties the result does not depend on the order of the points; equal savings are cut from left to
 * right.
 *
 * @param position [in] [count][3], finite
 * @param color    [in] [count][3] in [0, 1], or NULL: positions alone decide
 * @param out      [out] free with balls_free(); in tree order, left before right; zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, non-finite point, colour outside [0, 1]: says which),
 *         GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: O(n log balls_max) time on one thread where cuts are even,
 * 25 n + 24 balls_max bytes of scratch.
 */
gbt_status balls_adapt(const float *position, const float *color, size_t count, const adaptive_def *def,
                       balls *out, gbt_error *err);

#endif
