/* SPDX-License-Identifier: Apache-2.0 */
/* base/vec.h -- small vectors, quaternions and 3x3 matrices: inline, no allocation.

   Matrices are row-major. Quaternions are (w, x, y, z), Hamilton, and turn local axes into world axes. */
#ifndef GBT_BASE_VEC_H
#define GBT_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

#define PI 3.14159265358979323846
#define HALF_LOG2_E 0.72134752044448170368 /* exp(-x / 2) = 2^(-x HALF_LOG2_E) */
#define GOLDEN_ANGLE 2.399963229728653     /* radians */

/** x rounded to float precision. It goes through memory, because GCC 12 for x86-64 drops both conversions
    when it vectorises two neighbouring values. */
static inline double rounded_to_float(double x)
{
    volatile float rounded = (float)x;
    return (double)rounded;
}

static inline double dvec_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void dvec_cross(const double a[3], const double b[3], double out[3])
{
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

static inline double dvec_length(const double a[3]) { return sqrt(dvec_dot(a, a)); }

/** The length of (x, y), with the same bits everywhere, unlike the C library's hypot. */
static inline double dvec_length2(double x, double y) { return sqrt(x * x + y * y); }

/** Direction i of `count` directions spread evenly over the sphere by a Fibonacci spiral (Gonzalez 2010). */
static inline void dvec_on_sphere(int i, int count, double out[3])
{
    const double z = 1 - (2 * i + 1.0) / count, across = sqrt(1 - z * z), turn = i * GOLDEN_ANGLE;
    out[0] = across * cos(turn);
    out[1] = across * sin(turn);
    out[2] = z;
}

/** a scaled to length 1; a zero vector stays zero. */
static inline void dvec_normalize(double a[3])
{
    const double length = dvec_length(a);
    if (length > 0) {
        a[0] /= length;
        a[1] /= length;
        a[2] /= length;
    }
}

/** out = m a. `out` may be `a`. */
static inline void dmat_apply(const double m[9], const double a[3], double out[3])
{
    const double x = m[0] * a[0] + m[1] * a[1] + m[2] * a[2];
    const double y = m[3] * a[0] + m[4] * a[1] + m[5] * a[2];
    const double z = m[6] * a[0] + m[7] * a[1] + m[8] * a[2];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/** Whether every element of |m m^T - I| is at most the tolerance, and m is not a reflection. */
static inline bool dmat_is_rotation(const double m[9], double tolerance)
{
    double cross[3], worst = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs(dvec_dot(m + 3 * i, m + 3 * k) - (i == k)));
    dvec_cross(m, m + 3, cross);
    return worst <= tolerance && dvec_dot(cross, m + 6) > 0;
}

/** out = transpose(m) a. `out` may be `a`. */
static inline void dmat_apply_transposed(const double m[9], const double a[3], double out[3])
{
    const double x = m[0] * a[0] + m[3] * a[1] + m[6] * a[2];
    const double y = m[1] * a[0] + m[4] * a[1] + m[7] * a[2];
    const double z = m[2] * a[0] + m[5] * a[1] + m[8] * a[2];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/** Unit quaternion of a rotation matrix. The largest component is found first, from the diagonal, so that
    there is no division by a small number. */
static inline void dquat_of_matrix(const double m[9], double q[4])
{
    const double square[4] = {1 + m[0] + m[4] + m[8], 1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8],
                              1 - m[0] - m[4] + m[8]}; /* 4 q_k^2 */
    int big = 0;
    for (int k = 1; k < 4; k++)
        big = square[k] > square[big] ? k : big;
    const double wx = m[7] - m[5], wy = m[2] - m[6], wz = m[3] - m[1], xy = m[3] + m[1], xz = m[2] + m[6],
                 yz = m[7] + m[5]; /* 4 w x, ... */
    const double rows[4][4] = {
        {square[0], wx, wy, wz}, {wx, square[1], xy, xz}, {wy, xy, square[2], yz}, {wz, xz, yz, square[3]}};
    for (int k = 0; k < 4; k++)
        q[k] = 0.5 * rows[big][k] / sqrt(square[big]);
}

/** Rotation matrix of a unit quaternion, in double and in single precision. */
#define QUAT_TO_MATRIX(name, real)                                                                           \
    static inline void name(const real q[4], real m[9])                                                      \
    {                                                                                                        \
        const real w = q[0], x = q[1], y = q[2], z = q[3];                                                   \
        m[0] = 1 - 2 * (y * y + z * z);                                                                      \
        m[1] = 2 * (x * y - w * z);                                                                          \
        m[2] = 2 * (x * z + w * y);                                                                          \
        m[3] = 2 * (x * y + w * z);                                                                          \
        m[4] = 1 - 2 * (x * x + z * z);                                                                      \
        m[5] = 2 * (y * z - w * x);                                                                          \
        m[6] = 2 * (x * z - w * y);                                                                          \
        m[7] = 2 * (y * z + w * x);                                                                          \
        m[8] = 1 - 2 * (x * x + y * y);                                                                      \
    }
QUAT_TO_MATRIX(dquat_to_matrix, double)
QUAT_TO_MATRIX(quat_to_matrix, float)
#undef QUAT_TO_MATRIX

#endif
