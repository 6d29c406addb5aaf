/* SPDX-License-Identifier: Apache-2.0 */
/* gb/fill.h -- make the members and statistics of balls from a reordered cloud and the marks where balls
   begin. */
#ifndef GBT_GB_FILL_H
#define GBT_GB_FILL_H

#include "gb/balls.h"
#include "gb/moments.h"

/**
 * Fill *out from points sorted by ball.
 *
 * Statistics are summed in index order, so they depend only on the set and not on how it was cut.
 *
 * @param points       [in] [count], grouped by ball; on return sorted by index inside each ball
 * @param leaf_depth   [in] [count]: 1 + depth, 1 to 255, where a ball begins, else 0
 * @param color        [in] [..][3], indexed by the points' index, or NULL
 * @param radius_floor [in] s_min, eq 21
 * @param out          [out] free with balls_free(), also after GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count.
 */
gbt_status balls_fill(cloud_point *points, const uint8_t *leaf_depth, size_t count, const float *color,
                      double radius_floor, balls *out, gbt_error *err);

#endif
