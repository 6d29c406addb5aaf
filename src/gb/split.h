/* SPDX-License-Identifier: Apache-2.0 */
/* gb/split.h -- cut a set of points in two at the median along its principal axis (Yang 2026, eqs 24-27). */
#ifndef GBT_GB_SPLIT_H
#define GBT_GB_SPLIT_H

#include <stdbool.h>
#include <stddef.h>

#include "gb/moments.h"

/**
 * Orthonormal eigenvectors of a symmetric matrix, largest eigenvalue first; equal eigenvalues keep the order
 * x, y, z of the axes from which the Jacobi iteration rotated them. The sign makes the largest component of
 * each positive; components within 1e-9 count as tied, and the lowest axis decides.
 *
 * @param covariance [in]  xx xy xz yy yz zz, finite
 * @param axes       [out] one unit vector per row; the identity for the zero matrix
 */
void split_axes(const double covariance[6], double axes[3][3]);

/**
 * The element of rank `rank` (0 = smallest) of `keys` [count], which is reordered (quickselect): keys before
 * index `rank` are <= it, keys after it are >= it.
 *
 * Cost: O(count) on average, O(count log count) for adversarial input.
 */
double split_select(double *keys, size_t count, size_t rank);

/**
 * Reorder `points` so that the left part comes first, and return its size; 0 when no axis separates them
 * (they are equal).
 *
 * Left is z <= median along the first axis, the lower median: rank (count - 1) / 2. When that leaves nothing
 * on the right, left is z < median; when that leaves nothing on the left either, the next axis decides. The
 * result depends on the order of `points` only through the order inside the two parts.
 *
 * @param keys      [in] scratch, [count]
 * @param keep_tied [in] true: return 0 where z < median would have to separate them, as the paper does
 */
size_t split_at_median(cloud_point *points, double *keys, size_t count, const moments *m, bool keep_tied);

#endif
