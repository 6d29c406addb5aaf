/* SPDX-License-Identifier: Apache-2.0 */
/* frame/sh.h -- real spherical harmonics up to degree 3, in the order and with the signs of 3DGS files (Kerbl
 * 2023). */
#ifndef GBT_FRAME_SH_H
#define GBT_FRAME_SH_H

#include <string.h>

#include "data/gaussian_cloud.h"

/** Functions up to a degree in [0, 3]. */
static inline int sh_count(int degree) { return (degree + 1) * (degree + 1); }

/** All 16 at a unit direction, from the camera to the Gaussian. Orthonormal over the sphere. */
static inline void sh_basis(const float d[3], float y[GAUSSIAN_SH_COUNT])
{
    const float x = d[0], v = d[1], z = d[2], xx = x * x, yy = v * v, zz = z * z;
    y[0] = 0.28209479f;
    y[1] = -0.48860251f * v;
    y[2] = 0.48860251f * z;
    y[3] = -0.48860251f * x;
    y[4] = 1.09254843f * x * v;
    y[5] = -1.09254843f * v * z;
    y[6] = 0.31539157f * (2 * zz - xx - yy);
    y[7] = -1.09254843f * x * z;
    y[8] = 0.54627422f * (xx - yy);
    y[9] = -0.59004359f * v * (3 * xx - yy);
    y[10] = 2.89061144f * x * v * z;
    y[11] = -0.45704580f * v * (4 * zz - xx - yy);
    y[12] = 0.37317633f * z * (2 * zz - 3 * xx - 3 * yy);
    y[13] = -0.45704580f * x * (4 * zz - xx - yy);
    y[14] = 1.44530572f * z * (xx - yy);
    y[15] = -0.59004359f * x * (xx - 3 * yy);
}

/** Their gradients by the direction; only what is at right angles to it means anything. */
static inline void sh_basis_gradient(const float d[3], float out[GAUSSIAN_SH_COUNT][3])
{
    const float x = d[0], v = d[1], z = d[2], xx = x * x, yy = v * v, zz = z * z;
    const float one = 0.48860251f, two = 1.09254843f, flat = 0.63078313f, cross = 1.09254843f;
    const float a = 0.59004359f, b = 2.89061144f, c = 0.45704580f, e = 0.37317633f, h = 1.44530572f;
    const float rows[GAUSSIAN_SH_COUNT][3] = {{0, 0, 0},
                                              {0, -one, 0},
                                              {0, 0, one},
                                              {-one, 0, 0},
                                              {two * v, two * x, 0},
                                              {0, -two * z, -two * v},
                                              {-flat * x, -flat * v, 2 * flat * z},
                                              {-two * z, 0, -two * x},
                                              {cross * x, -cross * v, 0},
                                              {-6 * a * x * v, -3 * a * (xx - yy), 0},
                                              {b * v * z, b * x * z, b * x * v},
                                              {2 * c * x * v, -c * (4 * zz - xx - 3 * yy), -8 * c * v * z},
                                              {-6 * e * x * z, -6 * e * v * z, 3 * e * (2 * zz - xx - yy)},
                                              {-c * (4 * zz - 3 * xx - yy), 2 * c * x * v, -8 * c * x * z},
                                              {2 * h * x * z, -2 * h * v * z, h * (xx - yy)},
                                              {-3 * a * (xx - yy), 6 * a * x * v, 0}};
    memcpy(out, rows, sizeof rows);
}

#endif
