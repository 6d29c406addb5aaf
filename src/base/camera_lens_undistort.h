/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_undistort.h -- undistort image points: invert the distortion of a lens. */
#ifndef GBT_BASE_CAMERA_LENS_UNDISTORT_H
#define GBT_BASE_CAMERA_LENS_UNDISTORT_H

#include "base/camera_lens.h"

enum { UNDISTORT_LANES = 4 };

/**
 * Find the undistorted points that the radial, tangential and prism terms of a lens map to given distorted
 * points, several at a time, by Newton's method to 1e-10 pixels. The result of a point has the same bits in
 * any lane and with any other points beside it.
 *
 * @param x, y [in, out] in: distorted points, NaN for unused lanes; out: undistorted points, NaN where none
 *         was found
 */
void camera_lens_undistort(const camera_lens *lens, double x[UNDISTORT_LANES], double y[UNDISTORT_LANES]);

#endif
