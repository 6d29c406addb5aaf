/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_undistort.h -- where a lens sees an image point without its distortion. */
#ifndef GBT_BASE_CAMERA_LENS_UNDISTORT_H
#define GBT_BASE_CAMERA_LENS_UNDISTORT_H

#include "base/camera_lens.h"

enum { UNDISTORT_LANES = 4 };

/**
 * The points of the undistorted plane that the radial, tangential and prism terms of a lens bring to given
 * ones, several at a time: Newton, within 1e-10 pixels. Same bits for a point wherever it stands and whatever
 * stands beside it.
 *
 * @param x, y [in, out] of the distorted plane; then undistorted; NaN where no point is, or none was found
 */
void camera_lens_undistort(const camera_lens *lens, double x[UNDISTORT_LANES], double y[UNDISTORT_LANES]);

#endif
