/* SPDX-License-Identifier: Apache-2.0 */
/* trace/view_form16.h -- Gaussians as seen from one point, in a form whose response takes sixteen operations.

   Rays that start at one point: in a frame of three axes there a ray is s (a, b, 1), and a Gaussian's mean is
   m = m_w (a0, b0, 1). The canonical axes may be turned freely, because only lengths count there. They are
   turned so that the image of the mean lies on the first axis, and that of u in the plane of the first two (a
   QR decomposition of S^-1 R^T). Then the canonical direction, divided by its length at the mean, is

       w1 = 1 + q1 (a - a0) + q2 (b - b0)      w2 = q3 (a - a0) + q4 (b - b0)      w3 = q5 (b - b0)

   and with y = w2^2 + w3^2, den = w1^2 + y, R = |S^-1 R^T m|

       d2 = R^2 y / den      t* = |(a, b, 1)| m_w w1 / den      v = R / den (-y, w1 w2, w1 w3)

   Nothing large is subtracted anywhere. q3..q5 come from S R^T, the cofactors of S^-1 R^T, so flat Gaussians
   lose no digits there. Only for Gaussians that lie in front of the near depth; the others go through
   gaussian16.h. Included by kernels. */
#ifndef GBT_TRACE_VIEW_FORM16_H
#define GBT_TRACE_VIEW_FORM16_H

#include "trace/gaussian16.h"

/* The form of sixteen Gaussians whose means have the slopes (a, b) in the axes `basis`. */
typedef struct view_form {
    vfloat16 q[5], distance, falloff; /* distance: R */
    vfloat16 e[3][3];                 /* the turned axes */
    vmask16 sound;                    /* everything finite and nothing lost to underflow */
} view_form;

static inline void view_form_find(const float (*basis)[3], const gaussian_lanes *g, vfloat16 a, vfloat16 b,
                                  vfloat16 depth, view_form *out)
{
    const vfloat16 one = vfloat16_set1(1);
    vfloat16 unit[9], stretch[9], square[3];
    for (int i = 0; i < 3; i++)
        square[i] = vfloat16_div(one, dot16(g->matrix + 3 * i, g->matrix + 3 * i)); /* s_i^2 */
    /* In units of the smallest scale: matrix entries up to 1, so that squares stay finite. */
    const vfloat16 smallest_square = vfloat16_min(square[0], vfloat16_min(square[1], square[2])),
                   smallest = vfloat16_sqrt(smallest_square);
    for (int i = 0; i < 9; i++) {
        unit[i] = vfloat16_mul(g->matrix[i], smallest);                                   /* S^-1 R^T */
        stretch[i] = vfloat16_mul(unit[i], vfloat16_div(square[i / 3], smallest_square)); /* S R^T */
    }
    vfloat16 along[3][3], wide[3][3]; /* images of u, v, w under `unit`, `stretch` */
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 3; i++) {
            along[axis][i] = dot_lanes(basis[axis], unit + 3 * i);
            wide[axis][i] = dot_lanes(basis[axis], stretch + 3 * i);
        }
    /* cw: the image of (a, b, 1), the direction of the mean. Its cross products with the images of u and v
       are the cofactor matrix, det S R^T, applied to v - b w and a w - u. */
    vfloat16 cw[3], bu[3], bv[3];
    for (int i = 0; i < 3; i++) {
        cw[i] = vfloat16_fma(a, along[0][i], vfloat16_fma(b, along[1][i], along[2][i]));
        bu[i] = vfloat16_fnma(b, wide[2][i], wide[1][i]);
        bv[i] = vfloat16_sub(vfloat16_mul(a, wide[2][i]), wide[0][i]);
    }
    const vfloat16 det = vfloat16_sqrt(vfloat16_mul(
        vfloat16_div(smallest_square, square[0]),
        vfloat16_mul(vfloat16_div(smallest_square, square[1]), vfloat16_div(smallest_square, square[2]))));
    const vfloat16 cw2 = dot16(cw, cw), bu_length = vfloat16_sqrt(dot16(bu, bu));
    const vfloat16 inverse = vfloat16_div(one, cw2), scale = vfloat16_mul(det, inverse),
                   bu_inverse = vfloat16_div(one, bu_length), length = vfloat16_sqrt(cw2);
    out->distance = vfloat16_div(vfloat16_mul(depth, length), smallest);
    out->falloff =
        vfloat16_mul(vfloat16_set1((float)HALF_LOG2_E), vfloat16_mul(out->distance, out->distance));
    out->q[0] = vfloat16_mul(dot16(cw, along[0]), inverse);
    out->q[1] = vfloat16_mul(dot16(cw, along[1]), inverse);
    out->q[2] = vfloat16_mul(bu_length, scale);
    out->q[3] = vfloat16_mul(dot16(bv, bu), vfloat16_mul(bu_inverse, scale));
    out->q[4] = vfloat16_div(bu_inverse, length); /* det / (det |bu| |cw|) */
    for (int i = 0; i < 3; i++) {
        out->e[0][i] = vfloat16_div(cw[i], length);
        out->e[2][i] = vfloat16_mul(bu[i], bu_inverse);
    }
    cross16(out->e[2], out->e[0], out->e[1]);
    /* Products of three squares: 1e-30 leaves them normal numbers. NaN fails. */
    const vmask16 exact = vmask16_and(vfloat16_lt(vfloat16_set1(1e-30f), smallest_square),
                                      vfloat16_lt(vfloat16_set1(1e-15f), det));
    out->sound = vmask16_and(vmask16_and(exact, vfloat16_lt(vfloat16_set1(1e-30f), cw2)),
                             vmask16_and(vfloat16_lt(out->falloff, vfloat16_set1(1e30f)),
                                         vfloat16_lt(out->q[4], vfloat16_set1(1e15f))));
}

#endif
