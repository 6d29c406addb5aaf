/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_view16.h -- Gaussians as seen from the common origin of a tile's rays, in the tile's frame: the
   form of view_form16.h. Included by kernels after tree_beam16.h. */
#ifndef GBT_TRACE_TREE_VIEW16_H
#define GBT_TRACE_TREE_VIEW16_H

#include "trace/tree_beam16.h"
#include "trace/view_form16.h"

/* Rays of a packet in the tile's frame. */
typedef struct view_rays {
    vfloat16 a, b, length; /* |(a, b, 1)| */
} view_rays;

/* Sixteen Gaussians; a row reads one of them. */
enum { VIEW_A, VIEW_B, VIEW_Q, VIEW_DEPTH = VIEW_Q + 5, VIEW_FALLOFF, VIEW_OPACITY, VIEW_FIELDS };
typedef struct view_gaussians {
    _Alignas(64) float field[VIEW_FIELDS][16]; /* FALLOFF: R^2 log2(e) / 2, so that the response is
                                                  2^(-FALLOFF y / den) */
} view_gaussians;

/* What turns the sums of the adjoint back into the Gaussian's own axes: the three turned axes of
   view_form16.h, and R. */
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

/* Returns the lanes whose form is sound. `axes` may be NULL. */
static inline vmask16 view_gaussians_from(const gaussian_lanes *g, const tile_beam *b, view_gaussians *out,
                                          view_axes *axes)
{
    vfloat16 offset[3];
    view_form form;
    for (int i = 0; i < 3; i++)
        offset[i] = vfloat16_sub(g->mean[i], vfloat16_set1(b->origin[i]));
    const vfloat16 depth = dot_lanes(b->axis[2], offset),
                   inverse_depth = vfloat16_div(vfloat16_set1(1), depth);
    const vfloat16 a = vfloat16_mul(dot_lanes(b->axis[0], offset), inverse_depth),
                   c = vfloat16_mul(dot_lanes(b->axis[1], offset), inverse_depth);
    view_form_find(b->axis, g, a, c, depth, &form);
    vfloat16_store(out->field[VIEW_A], a);
    vfloat16_store(out->field[VIEW_B], c);
    for (int k = 0; k < 5; k++)
        vfloat16_store(out->field[VIEW_Q + k], form.q[k]);
    vfloat16_store(out->field[VIEW_DEPTH], depth);
    vfloat16_store(out->field[VIEW_FALLOFF], form.falloff);
    vfloat16_store(out->field[VIEW_OPACITY], g->opacity);
    if (axes != NULL) {
        memcpy(axes->e, form.e, sizeof form.e);
        axes->distance = form.distance;
    }
    return form.sound;
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

static inline vfloat16 view_alpha(const view_gaussians *g, int i, vfloat16 exponent)
{
    return vfloat16_mul(vfloat16_set1(g->field[VIEW_OPACITY][i]),
                        vfloat16_exp2(vfloat16_max(exponent, vfloat16_set1(EXP2_LEAST))));
}

#endif
