/* frame/sh.h -- real spherical harmonics up to degree 3, in the order and with the signs of 3DGS files. */
#ifndef GBT_FRAME_SH_H
#define GBT_FRAME_SH_H

#include "data/gaussian_cloud.h"

/** Functions up to a degree in [0, 3]. */
static inline int sh_count(int degree)
{
    return (degree + 1) * (degree + 1);
}

/** All 16 at a unit direction, from the camera to the Gaussian. Orthonormal over the sphere. */
static inline void sh_basis(const float d[3], float y[GAUSSIAN_SH_COUNT])
{
    const float x = d[0], v = d[1], z = d[2], xx = x * x, yy = v * v, zz = z * z;
    y[0] = 0.28209479f;
    y[1] = -0.48860251f * v, y[2] = 0.48860251f * z, y[3] = -0.48860251f * x;
    y[4] = 1.09254843f * x * v, y[5] = -1.09254843f * v * z, y[6] = 0.31539157f * (2 * zz - xx - yy);
    y[7] = -1.09254843f * x * z, y[8] = 0.54627422f * (xx - yy);
    y[9] = -0.59004359f * v * (3 * xx - yy), y[10] = 2.89061144f * x * v * z, y[11] = -0.45704580f * v * (4 * zz - xx - yy);
    y[12] = 0.37317633f * z * (2 * zz - 3 * xx - 3 * yy), y[13] = -0.45704580f * x * (4 * zz - xx - yy);
    y[14] = 1.44530572f * z * (xx - yy), y[15] = -0.59004359f * x * (xx - 3 * yy);
}

#endif
