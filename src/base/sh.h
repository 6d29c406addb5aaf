/* SPDX-License-Identifier: Apache-2.0 */
/* base/sh.h -- real spherical harmonics up to degree 3, in the order and with the signs of 3DGS files (Kerbl
 * 2023). */
#ifndef GBT_BASE_SH_H
#define GBT_BASE_SH_H

#include <string.h>

enum { SH_COUNT = 16 };

/** Number of functions up to a degree in [0, 3]. */
static inline int sh_count(int degree) { return (degree + 1) * (degree + 1); }

/** All 16 at a unit direction, from the camera to the Gaussian. Orthonormal over the sphere. */
#define SH_BASIS(name, real)                                                                                 \
    static inline void name(const real d[3], real y[SH_COUNT])                                               \
    {                                                                                                        \
        const real x = d[0], v = d[1], z = d[2], xx = x * x, yy = v * v, zz = z * z;                         \
        y[0] = (real)0.28209479;                                                                             \
        y[1] = (real)-0.48860251 * v;                                                                        \
        y[2] = (real)0.48860251 * z;                                                                         \
        y[3] = (real)-0.48860251 * x;                                                                        \
        y[4] = (real)1.09254843 * x * v;                                                                     \
        y[5] = (real)-1.09254843 * v * z;                                                                    \
        y[6] = (real)0.31539157 * (2 * zz - xx - yy);                                                        \
        y[7] = (real)-1.09254843 * x * z;                                                                    \
        y[8] = (real)0.54627422 * (xx - yy);                                                                 \
        y[9] = (real)-0.59004359 * v * (3 * xx - yy);                                                        \
        y[10] = (real)2.89061144 * x * v * z;                                                                \
        y[11] = (real)-0.45704580 * v * (4 * zz - xx - yy);                                                  \
        y[12] = (real)0.37317633 * z * (2 * zz - 3 * xx - 3 * yy);                                           \
        y[13] = (real)-0.45704580 * x * (4 * zz - xx - yy);                                                  \
        y[14] = (real)1.44530572 * z * (xx - yy);                                                            \
        y[15] = (real)-0.59004359 * x * (xx - 3 * yy);                                                       \
    }
SH_BASIS(sh_basis, float)
SH_BASIS(sh_basis_exact, double)
#undef SH_BASIS

/** Gradients of the functions by the direction; only the component orthogonal to it is meaningful. */
static inline void sh_basis_gradient(const float d[3], float out[SH_COUNT][3])
{
    const float x = d[0], v = d[1], z = d[2], xx = x * x, yy = v * v, zz = z * z;
    const float one = 0.48860251f, two = 1.09254843f, flat = 0.63078313f, cross = 1.09254843f;
    const float a = 0.59004359f, b = 2.89061144f, c = 0.45704580f, e = 0.37317633f, h = 1.44530572f;
    const float rows[SH_COUNT][3] = {{0, 0, 0},
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
