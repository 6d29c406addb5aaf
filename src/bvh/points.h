/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points.h -- exact queries on balls (points with a radius): Embree trees for nearest, k-nearest, within
   a radius, balls that contain a point, overlapping balls, and balls whose bounds a ray crosses.

   All answers are exact in the float32 coordinates given: distances are recomputed in double from them, and
   ties are ordered by index. Any finite coordinates and radii will do, however large, small or far from the
   origin, and any number of coincident points. */
#ifndef GBT_BVH_POINTS_H
#define GBT_BVH_POINTS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef struct point_tree point_tree; /* immutable once built; queries are callable from any thread */

/**
 * Build the trees of a set of balls.
 *
 * Coincident points become one primitive with a list of indices, so that a stack of equal points costs no
 * more than its answers.
 *
 * @param position [in] [count][3], finite, borrowed until point_tree_free()
 * @param radius   [in] [count], >= 0, finite, borrowed; NULL for points
 * @param count    [in] may be 0: every query then answers nothing
 * @param out      [out] free with point_tree_free(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (bad point: says which), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL (Embree's own
 *         words)
 *
 * Threads: any; builds on all threads inside. Cost: O(n log n); about 100 bytes per distinct point, twice
 * that with radii.
 */
gbt_status point_tree_build(const float *position, const float *radius, size_t count, point_tree **out,
                            gbt_error *err);
void point_tree_free(point_tree *tree); /* NULL is fine */

/**
 * Up to k nearest centres, nearest first, ties by index; `skip` is left out by index (pass SIZE_MAX for
 * none).
 *
 * @param k                [in] <= 64
 * @param index            [out] [k]
 * @param distance_squared [out] [k], double, from the float32 coordinates
 * @return how many were found; 0 for a query that is not finite
 *
 * Threads: any. Cost: about O(log n + k^2).
 */
size_t point_tree_nearest(const point_tree *tree, const float query[3], size_t k, size_t skip,
                          uint32_t *index, double *distance_squared);

/** A growing list of answers; start from {0}, free with point_list_free(). Sorted by index. */
typedef struct point_list {
    uint32_t *index;
    size_t count, capacity;
} point_list;
void point_list_free(point_list *list);

/* Each query below replaces the contents of `out` and keeps its memory. On failure out->count is 0:
   GBT_ERR_ARGUMENT for numbers that are not finite or a radius < 0 (+infinity is a radius),
   GBT_ERR_NO_MEMORY. Threads: any, with distinct `out`. Cost: about O(log n + m log m) for m answers. */
gbt_status point_tree_within(const point_tree *tree, const float query[3], float radius, point_list *out,
                             gbt_error *err); /* |c - q| <= radius */
gbt_status point_tree_containing(const point_tree *tree, const float query[3], point_list *out,
                                 gbt_error *err); /* |c - q| <= r */
gbt_status point_tree_overlapping(const point_tree *tree, const float query[3], float radius, point_list *out,
                                  gbt_error *err); /* |c - q| <= r + radius */

/**
 * Balls that meet the segment origin + t dir, t_min <= t <= t_max: |origin + t dir - c| <= r for some such t,
 * computed in double.
 *
 * dir has any length but 0; the ends may be negative or infinite; t_min > t_max is an empty segment. The
 * first call builds another tree (padded boxes), so it may also fail with GBT_ERR_INTERNAL.
 */
gbt_status point_tree_crossed(const point_tree *tree, const float origin[3], const float dir[3], float t_min,
                              float t_max, point_list *out, gbt_error *err);

/**
 * For every point: root of the mean of the squared distances to its k nearest others (fewer when there are
 * fewer; 0 for a lone point).
 *
 * @param k       [in] 1..64, else GBT_ERR_ARGUMENT
 * @param spacing [out] [count]
 *
 * Threads: parallel inside; same bits for every thread count. Cost: O(distinct points) queries: coincident
 * points share one.
 */
gbt_status point_tree_spacing(const point_tree *tree, size_t k, float *spacing, gbt_error *err);

#endif
