/* SPDX-License-Identifier: Apache-2.0 */
/* trace/gaussian16.h -- Gaussians against rays, sixteen pairs at a time: depth, canonical point, response
   (Moenne-Loccoz 2024; docs/tracing.md).

   The same arithmetic serves one Gaussian on sixteen rays (lanes of `gaussian_lanes` all equal) and sixteen
   Gaussians on one ray, so both give the same bits for the same pair. Included by kernels after simd16.h. */
#ifndef GBT_TRACE_GAUSSIAN16_H
#define GBT_TRACE_GAUSSIAN16_H

#include "base/simd16.h"
#include "base/vec.h"
#include "trace/kernel.h"

typedef struct ray_lanes {
    vfloat16 origin[3], dir[3];
} ray_lanes;

typedef struct response {
    vfloat16 t;    /* t_c */
    vfloat16 v[3]; /* canonical point at t_c */
    vfloat16 d2;
} response;

static inline void load_rays(const packet_rays *rays, ray_lanes *out)
{
    for (int axis = 0; axis < 3; axis++) {
        out->origin[axis] = vfloat16_load(rays->origin[axis]);
        out->dir[axis] = vfloat16_load(rays->dir[axis]);
    }
}

static inline vfloat16 dot16(const vfloat16 a[3], const vfloat16 b[3])
{
    return vfloat16_fma(a[2], b[2], vfloat16_fma(a[1], b[1], vfloat16_mul(a[0], b[0])));
}

static inline vfloat16 dot_lanes(const float n[3], const vfloat16 x[3])
{
    return vfloat16_fma(vfloat16_set1(n[2]), x[2],
                        vfloat16_fma(vfloat16_set1(n[1]), x[1], vfloat16_mul(vfloat16_set1(n[0]), x[0])));
}

static inline void cross16(const vfloat16 a[3], const vfloat16 b[3], vfloat16 out[3])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = vfloat16_fnma(a[k], b[j], vfloat16_mul(a[j], b[k]));
    }
}

/* Sixteen Gaussians, or one of them sixteen times. */
typedef struct gaussian_lanes {
    vfloat16 mean[3], matrix[9], opacity;
} gaussian_lanes;

static inline gaussian_lanes broadcast_gaussian(const float *record)
{
    gaussian_lanes g;
    for (int i = 0; i < 3; i++)
        g.mean[i] = vfloat16_set1(record[RECORD_MEAN + i]);
    for (int i = 0; i < 9; i++)
        g.matrix[i] = vfloat16_set1(record[RECORD_MATRIX + i]);
    g.opacity = vfloat16_set1(record[RECORD_OPACITY]);
    return g;
}

/* Sixteen Gaussians; their colours too, unless `color` is NULL. */
static inline gaussian_lanes load_gaussians(const kernel_scene *scene, const uint32_t id[16], vfloat16 *color)
{
    const float *rows[16];
    vfloat16 field[16];
    gaussian_lanes g;
    for (int i = 0; i < 16; i++)
        rows[i] = scene->records + (size_t)id[i] * RECORD_FLOATS;
    vfloat16_load_transposed(rows, field);
    for (int i = 0; i < 3; i++)
        g.mean[i] = field[RECORD_MEAN + i];
    for (int i = 0; i < 3 && color != NULL; i++)
        color[i] = field[RECORD_COLOR + i];
    g.opacity = field[RECORD_OPACITY];
    for (int i = 0; i < 9; i++)
        g.matrix[i] = field[RECORD_MATRIX + i];
    return g;
}

/* A ray relative to a mean: p, its point nearest to the mean, as seen from there; the ray is at this point
   when t = -along. */
typedef struct ray_to_mean {
    vfloat16 p[3], along;
} ray_to_mean;

static inline ray_to_mean approach(const gaussian_lanes *g, const ray_lanes *ray)
{
    ray_to_mean r;
    vfloat16 e[3];
    for (int i = 0; i < 3; i++)
        e[i] = vfloat16_sub(ray->origin[i], g->mean[i]);
    r.along = dot16(e, ray->dir);
    for (int i = 0; i < 3; i++)
        r.p[i] = vfloat16_fnma(r.along, ray->dir[i], e[i]);
    return r;
}

static inline void to_canonical(const gaussian_lanes *g, const vfloat16 x[3], vfloat16 out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot16(g->matrix + 3 * i, x);
}

/* The ray is first moved to the point nearest the mean, so that the canonical product subtracts nothing large
   (float32 keeps its digits at any distance / scale ratio that float32 coordinates allow). */
static inline response respond(const gaussian_lanes *g, const ray_lanes *ray, vfloat16 t_near)
{
    const ray_to_mean at = approach(g, ray);
    vfloat16 o[3], w[3];
    to_canonical(g, at.p, o);
    to_canonical(g, ray->dir, w);
    vfloat16 step = vfloat16_sub(vfloat16_set1(0), vfloat16_div(dot16(o, w), dot16(w, w)));
    response r;
    r.t = vfloat16_sub(step, at.along);
    const vmask16 clipped = vfloat16_lt(r.t, t_near);
    r.t = vfloat16_select(clipped, t_near, r.t);
    step = vfloat16_select(clipped, vfloat16_add(t_near, at.along), step);
    for (int i = 0; i < 3; i++)
        r.v[i] = vfloat16_fma(step, w[i], o[i]);
    r.d2 = dot16(r.v, r.v);
    return r;
}

/* Computes the canonical point at an interior t* again, for the adjoint: v = w' x (x' x w') / |w'|^2 with x'
   x w' = cof(M) (p x w), M = S^-1 R^T. On a flat Gaussian the v of respond() is a small difference of large
   numbers along the thin axis. d2 is not affected by that, but the gradients of the mean and of the rotation,
   which are divided by the thin axis, would be noise from a ratio of 1e4 on. */
static inline void refine_point(const gaussian_lanes *g, const ray_lanes *ray, vfloat16 t_near, response *r)
{
    const ray_to_mean at = approach(g, ray);
    vfloat16 q[3], c[3], w[3], v[3];
    cross16(at.p, ray->dir, q);
    to_canonical(g, ray->dir, w);
    for (int i = 0; i < 3; i++) { /* row i of the cofactors: cross product of the other two rows */
        const vfloat16 *a = g->matrix + 3 * ((i + 1) % 3), *b = g->matrix + 3 * ((i + 2) % 3);
        const vfloat16 cofactor[3] = {vfloat16_sub(vfloat16_mul(a[1], b[2]), vfloat16_mul(a[2], b[1])),
                                      vfloat16_sub(vfloat16_mul(a[2], b[0]), vfloat16_mul(a[0], b[2])),
                                      vfloat16_sub(vfloat16_mul(a[0], b[1]), vfloat16_mul(a[1], b[0]))};
        c[i] = dot16(cofactor, q);
    }
    const vfloat16 ww = dot16(w, w);
    const vmask16 clipped = vfloat16_le(r->t, t_near);
    cross16(w, c, v);
    for (int i = 0; i < 3; i++)
        r->v[i] = vfloat16_select(clipped, r->v[i], vfloat16_div(v[i], ww));
}

/* Rotates the moments v and v v^T of sixteen Gaussians from the axes E (rows) in which they were summed to
   each Gaussian's own: E^T v and E^T (v v^T) E, in the order of a gradient_record. */
static inline void turn_moments(vfloat16 e[3][3], const vfloat16 v[3], const vfloat16 vv[6],
                                vfloat16 out[GRADIENT_OPACITY])
{
    static const int at[3][3] = {{0, 5, 4}, {5, 1, 3}, {4, 3, 2}}; /* in xx yy zz yz zx xy */
    vfloat16 column[3][3], half[3][3];
    for (int j = 0; j < 3; j++) {
        for (int k = 0; k < 3; k++)
            column[j][k] = e[k][j];
        for (int k = 0; k < 3; k++) {
            const vfloat16 row[3] = {vv[at[k][0]], vv[at[k][1]], vv[at[k][2]]};
            half[j][k] = dot16(row, column[j]);
        }
        out[GRADIENT_V + j] = dot16(column[j], v);
        for (int i = 0; i <= j; i++)
            out[GRADIENT_VV + at[i][j]] = dot16(column[i], half[j]);
    }
}

/* Unit vector along the shortest axis of the ellipsoid, world: that of the longest row of S^-1 R^T. */
static inline void shortest_axis(const float *record, float normal[3])
{
    const float *best = NULL;
    float square = 0;
    for (int i = 0; i < 3; i++) {
        const float *row = record + RECORD_MATRIX + 3 * i,
                    length = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
        if (best == NULL || length > square) {
            best = row;
            square = length;
        }
    }
    for (int k = 0; k < 3; k++)
        normal[k] = best[k] / sqrtf(square);
}

/* opacity exp(-d2 / 2) */
static inline vfloat16 response_alpha(const gaussian_lanes *g, vfloat16 d2)
{
    return vfloat16_mul(g->opacity,
                        vfloat16_exp2(vfloat16_max(vfloat16_mul(vfloat16_set1((float)-HALF_LOG2_E), d2),
                                                   vfloat16_set1(EXP2_LEAST))));
}

#endif
