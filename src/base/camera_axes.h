/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_axes.h -- where the optical axes of cameras meet. */
#ifndef GBT_BASE_CAMERA_AXES_H
#define GBT_BASE_CAMERA_AXES_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/camera.h"

/**
 * The point x with the least sum of squared distances to all axes (centre c, direction d): sum (I - d d^T) (x
 * - c) = 0.
 *
 * @param middle [in]  mean of the centres, used as the local origin
 * @param out    [out] the point, when true is returned
 * @return false when the point is not meaningful: the axes are nearly parallel (the mean squared sine of the
 *         angles between them below 0.01, 6 degrees), or it is not in front of most cameras
 */
bool camera_axes_meet(const gbt_camera *cameras, size_t count, const double middle[3], double out[3]);

#endif
