/* SPDX-License-Identifier: Apache-2.0 */
/* gb/moments.h -- mean, covariance, radius and colour spread of a set of points, in double (Yang 2026, eqs
   19, 20, 22). */
#ifndef GBT_GB_MOMENTS_H
#define GBT_GB_MOMENTS_H

#include <stddef.h>
#include <stdint.h>

/** A point with its input index. Points are moved, not indices, so that every pass over a set reads memory
    sequentially. */
typedef struct cloud_point {
    float position[3];
    uint32_t index;
} cloud_point;

typedef struct moments {
    double mean[3];       /* eq 19 */
    double covariance[6]; /* xx xy xz yy yz zz, divided by n (population) */
} moments;

/**
 * Mean and covariance in two passes, about the first point and then about the mean: exactly 0 for equal
 * points, and no cancellation far from the origin.
 *
 * @param count [in] >= 1
 * Threads: any; large sets are summed in blocks that depend only on `count`, so the bits do not depend on the
 * number of threads.
 */
void moments_compute(const cloud_point *points, size_t count, moments *out);

/** Root mean square distance to the mean: root of the trace of the covariance (eq 20 before its floor). */
double moments_radius(const moments *m);

/**
 * Mean over the 3 channels of the population standard deviation (eq 22); 0 for equal colours.
 *
 * @param color [in]  [..][3], indexed by the points' index
 * @param mean  [out] mean colour
 */
double moments_color_std(const cloud_point *points, size_t count, const float *color, double mean[3]);

#endif
