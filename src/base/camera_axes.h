/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_axes.h -- where the optical axes of cameras meet. */
#ifndef GBT_BASE_CAMERA_AXES_H
#define GBT_BASE_CAMERA_AXES_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/camera.h"

/**
 * The point nearest to all axes: least squares, sum (I - d d^T) (x - c) = 0.
 *
 * @param middle [in]  mean of the centres: distances are from it
 * @param out    [out] the point, where true
 * @return false where it does not say enough: the axes are nearly parallel (the mean squared sine of the
 *         angles between them below 0.01, 6 degrees), or it is not in front of most cameras
 */
bool camera_axes_meet(const gbt_camera *cameras, size_t count, const double middle[3], double out[3]);

#endif
