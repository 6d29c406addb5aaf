/* bvh/points.h -- exact queries on balls (points with a radius): one Embree tree for nearest, k-nearest, within a radius, balls that
   contain a point, overlapping balls, and balls whose bounds a ray crosses.

   All answers are exact in the float32 coordinates given: distances are recomputed in double from them, and ties are ordered by index. */
#ifndef GBT_BVH_POINTS_H
#define GBT_BVH_POINTS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef struct point_tree point_tree; /* immutable once built; queries are callable from any thread */

/**
 * @param position [in] [count][3], finite, borrowed until point_tree_free()
 * @param radius   [in] [count], >= 0, borrowed; NULL for points
 * @param count    [in] may be 0: every query then answers nothing
 */
gbt_status point_tree_build(const float *position, const float *radius, size_t count, point_tree **out, gbt_error *err);
void point_tree_free(point_tree *tree);

/** Up to k nearest centres, nearest first, ties by index; `skip` is left out by index (pass SIZE_MAX for none). Returns how many. k <= 64. */
size_t point_tree_nearest(const point_tree *tree, const float query[3], size_t k, size_t skip, uint32_t *index, double *distance_squared);

/** A growing list of answers; start from {0}, free with point_list_free(). Sorted by index. */
typedef struct point_list {
    uint32_t *index;
    size_t count, capacity;
} point_list;
void point_list_free(point_list *list);

gbt_status point_tree_within(const point_tree *tree, const float query[3], float radius, point_list *out, gbt_error *err);   /* |c - q| <= radius */
gbt_status point_tree_containing(const point_tree *tree, const float query[3], point_list *out, gbt_error *err);             /* |c - q| <= r */
gbt_status point_tree_overlapping(const point_tree *tree, const float query[3], float radius, point_list *out, gbt_error *err); /* |c - q| <= r + radius */
gbt_status point_tree_crossed(const point_tree *tree, const float origin[3], const float dir[3], float t_min, float t_max, point_list *out, gbt_error *err); /* ball meets the segment */

/** For every point: root of the mean of the squared distances to its k nearest others (fewer when there are fewer; 0 for a lone point). Parallel. */
gbt_status point_tree_spacing(const point_tree *tree, size_t k, float *spacing, gbt_error *err);

#endif
