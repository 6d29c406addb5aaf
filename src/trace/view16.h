/* SPDX-License-Identifier: Apache-2.0 */
/* trace/view16.h -- Gaussians as seen from one point: the response of a whole packet in sixteen operations.

   All rays of a tile start at the same point. In the tile's frame a ray is s (a, b, 1), and a Gaussian's mean
   is m = m_w (a0, b0, 1). The canonical axes may be turned freely, because only lengths count there. Turned
   so that the mean lies on the first axis, and the second takes all of the rest of axis u (a QR decomposition
   of S^-1 R^T), the canonical direction over its own length at the mean is

       w1 = 1 + q1 (a - a0) + q2 (b - b0)      w2 = q3 (a - a0) + q4 (b - b0)      w3 = q5 (b - b0)

   and with y = w2^2 + w3^2, den = w1^2 + y, R = |S^-1 R^T m|

       d2 = R^2 y / den      t* = |(a, b, 1)| m_w w1 / den      v = R / den (-y, w1 w2, w1 w3)

   Nothing large is subtracted anywhere. q3..q5 come from S R^T, the cofactors of S^-1 R^T, so flat Gaussians
   lose no digits there. Only for Gaussians that lie in front of the near depth; the others go through
   gaussian16.h. Included by kernels after beam16.h. */
#ifndef GBT_TRACE_VIEW16_H
#define GBT_TRACE_VIEW16_H

#include "trace/beam16.h"
#include "trace/gaussian16.h"

/* Rays of a packet in the tile's frame. */
typedef struct view_rays {
    vfloat16 a, b, length; /* |(a, b, 1)| */
} view_rays;

/* Sixteen Gaussians; a row reads one of them. */
enum {
    VIEW_A,
    VIEW_B,
    VIEW_Q,
    VIEW_DEPTH = VIEW_Q + 5,
    VIEW_FALLOFF,
    VIEW_OPACITY,
    VIEW_THRESHOLD,
    VIEW_FIELDS
};
typedef struct view_gaussians {
    _Alignas(64) float field[VIEW_FIELDS][16]; /* FALLOFF: R^2 log2(e) / 2, so that the response is
                                                  2^(-FALLOFF y / den) */
} view_gaussians;

/* What turns the adjoint's sums back into the Gaussian's own axes: the three turned axes, and R. */
typedef struct view_axes {
    vfloat16 e[3][3], distance;
} view_axes;

static inline view_rays see_rays(const packet_rays *rays, const tile_beam *b)
{
    const vfloat16 dir[3] = {vfloat16_load(rays->dir[0]), vfloat16_load(rays->dir[1]),
                             vfloat16_load(rays->dir[2])};
    view_rays v;
    v.length = vfloat16_div(vfloat16_set1(1), dot_lanes(b->axis[2], dir));
    v.a = vfloat16_mul(dot_lanes(b->axis[0], dir), v.length);
    v.b = vfloat16_mul(dot_lanes(b->axis[1], dir), v.length);
    return v;
}

/* Returned are the lanes whose form is sound: everything finite and nothing lost to underflow. `axes` may be
   NULL. */
static inline vmask16 view_gaussians_from(const kernel_scene *scene, const gaussian_lanes *g,
                                          const tile_beam *b, view_gaussians *out, view_axes *axes)
{
    const vfloat16 one = vfloat16_set1(1);
    vfloat16 offset[3], unit[9], stretch[9], square[3];
    for (int i = 0; i < 3; i++) {
        offset[i] = vfloat16_sub(g->mean[i], vfloat16_set1(b->origin[i]));
        square[i] = vfloat16_div(one, dot16(g->matrix + 3 * i, g->matrix + 3 * i)); /* s_i^2 */
    }
    /* In units of the smallest scale: matrix entries up to 1, so that squares stay finite. */
    const vfloat16 smallest_square = vfloat16_min(square[0], vfloat16_min(square[1], square[2])),
                   smallest = vfloat16_sqrt(smallest_square);
    for (int i = 0; i < 9; i++) {
        unit[i] = vfloat16_mul(g->matrix[i], smallest);                                   /* S^-1 R^T */
        stretch[i] = vfloat16_mul(unit[i], vfloat16_div(square[i / 3], smallest_square)); /* S R^T */
    }
    vfloat16 along[3][3], wide[3][3]; /* images of u, v, w */
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 3; i++) {
            along[axis][i] = dot_lanes(b->axis[axis], unit + 3 * i);
            wide[axis][i] = dot_lanes(b->axis[axis], stretch + 3 * i);
        }
    const vfloat16 depth = dot_lanes(b->axis[2], offset), inverse_depth = vfloat16_div(one, depth);
    const vfloat16 a = vfloat16_mul(dot_lanes(b->axis[0], offset), inverse_depth),
                   c = vfloat16_mul(dot_lanes(b->axis[1], offset), inverse_depth);
    /* cw: image of (a0, b0, 1); its products with the images of u and v are the cofactors' images of v - b0 w
       and a0 w - u. */
    vfloat16 cw[3], bu[3], bv[3];
    for (int i = 0; i < 3; i++) {
        cw[i] = vfloat16_fma(a, along[0][i], vfloat16_fma(c, along[1][i], along[2][i]));
        bu[i] = vfloat16_fnma(c, wide[2][i], wide[1][i]);
        bv[i] = vfloat16_sub(vfloat16_mul(a, wide[2][i]), wide[0][i]);
    }
    const vfloat16 det = vfloat16_sqrt(vfloat16_mul(
        vfloat16_div(smallest_square, square[0]),
        vfloat16_mul(vfloat16_div(smallest_square, square[1]), vfloat16_div(smallest_square, square[2]))));
    const vfloat16 cw2 = dot16(cw, cw), bu_length = vfloat16_sqrt(dot16(bu, bu));
    const vfloat16 inverse = vfloat16_div(one, cw2), scale = vfloat16_mul(det, inverse),
                   bu_inverse = vfloat16_div(one, bu_length), length = vfloat16_sqrt(cw2);
    const vfloat16 distance = vfloat16_div(vfloat16_mul(depth, length), smallest);
    const vfloat16 q5 = vfloat16_div(bu_inverse, length); /* det / (det |bu| |cw|) */
    vfloat16_store(out->field[VIEW_A], a), vfloat16_store(out->field[VIEW_B], c);
    vfloat16_store(out->field[VIEW_Q], vfloat16_mul(dot16(cw, along[0]), inverse));
    vfloat16_store(out->field[VIEW_Q + 1], vfloat16_mul(dot16(cw, along[1]), inverse));
    vfloat16_store(out->field[VIEW_Q + 2], vfloat16_mul(bu_length, scale));
    vfloat16_store(out->field[VIEW_Q + 3], vfloat16_mul(dot16(bv, bu), vfloat16_mul(bu_inverse, scale)));
    vfloat16_store(out->field[VIEW_Q + 4], q5);
    vfloat16_store(out->field[VIEW_DEPTH], depth);
    const vfloat16 falloff = vfloat16_mul(vfloat16_set1(0.72134752f), vfloat16_mul(distance, distance));
    vfloat16_store(out->field[VIEW_FALLOFF], falloff);
    vfloat16_store(out->field[VIEW_OPACITY], g->opacity);
    vfloat16_store(out->field[VIEW_THRESHOLD], alpha_threshold(scene, g->opacity));
    if (axes != NULL) {
        for (int i = 0; i < 3; i++) {
            axes->e[0][i] = vfloat16_div(cw[i], length);
            axes->e[2][i] = vfloat16_mul(bu[i], bu_inverse);
        }
        cross16(axes->e[2], axes->e[0], axes->e[1]);
        axes->distance = distance;
    }
    /* Products of three squares: 1e-30 leaves them normal numbers. NaN fails. */
    const vmask16 sound = vmask16_and(vfloat16_lt(vfloat16_set1(1e-30f), smallest_square),
                                      vfloat16_lt(vfloat16_set1(1e-15f), det));
    return vmask16_and(
        vmask16_and(sound, vfloat16_lt(vfloat16_set1(1e-30f), cw2)),
        vmask16_and(vfloat16_lt(falloff, vfloat16_set1(1e30f)), vfloat16_lt(q5, vfloat16_set1(1e15f))));
}

typedef struct view_response {
    vfloat16 t, exponent; /* the response is opacity 2^exponent */
    vfloat16 w1, w2, w3, y, inverse;
} view_response;

static inline view_response view_respond(const view_gaussians *g, int i, const view_rays *ray)
{
    view_response r;
    const vfloat16 da = vfloat16_sub(ray->a, vfloat16_set1(g->field[VIEW_A][i])),
                   db = vfloat16_sub(ray->b, vfloat16_set1(g->field[VIEW_B][i]));
    r.w1 = vfloat16_fma(vfloat16_set1(g->field[VIEW_Q][i]), da,
                        vfloat16_fma(vfloat16_set1(g->field[VIEW_Q + 1][i]), db, vfloat16_set1(1)));
    r.w2 = vfloat16_fma(vfloat16_set1(g->field[VIEW_Q + 2][i]), da,
                        vfloat16_mul(vfloat16_set1(g->field[VIEW_Q + 3][i]), db));
    r.w3 = vfloat16_mul(vfloat16_set1(g->field[VIEW_Q + 4][i]), db);
    r.y = vfloat16_fma(r.w2, r.w2, vfloat16_mul(r.w3, r.w3));
    r.inverse = vfloat16_div(vfloat16_set1(1), vfloat16_fma(r.w1, r.w1, r.y));
    r.exponent = vfloat16_mul(vfloat16_set1(-g->field[VIEW_FALLOFF][i]), vfloat16_mul(r.y, r.inverse));
    r.t = vfloat16_mul(vfloat16_mul(ray->length, vfloat16_set1(g->field[VIEW_DEPTH][i])),
                       vfloat16_mul(r.w1, r.inverse));
    return r;
}

/* 2^-126 is small enough: every alpha_min that can be set is larger. */
static inline vfloat16 view_alpha(const view_gaussians *g, int i, vfloat16 exponent)
{
    return vfloat16_mul(vfloat16_set1(g->field[VIEW_OPACITY][i]),
                        vfloat16_exp2(vfloat16_max(exponent, vfloat16_set1(-120.0f))));
}

#endif
