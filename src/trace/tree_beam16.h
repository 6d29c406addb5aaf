/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_beam16.h -- which nodes and ellipsoids can the rays of a tile, or of a packet, touch?
   Conservative, never exact.

   A tile has a frame: axis w runs along its middle, u and v across. In it a ray is a + s (slope_u, slope_v,
   1), and the beam of a tile or packet is the four planes that enclose all of its rays. Boxes of nodes are
   tested against the planes of the tile; ellipsoids are turned into the frame and tested against those of the
   tile and of each packet. If all rays start at one point, the slopes of an ellipsoid's tangent planes
   through it are found once and compared. Included by tree_kernel.inc.h. */
#ifndef GBT_TRACE_TREE_BEAM16_H
#define GBT_TRACE_TREE_BEAM16_H

#include <float.h>
#include <math.h>

#include "trace/gaussian16.h"

/* Half-space n.x <= limit; `pick` says for each axis which face of a box has the smallest n.x. */
typedef struct half_space {
    float n[3], limit;
    int pick[3]; /* float offset of lower_* or upper_* in a tree_node */
} half_space;

/* Planes of a packet in the tile's frame: low and high of u, low and high of v. Inside: side (x - slope w) <=
   limit, side -1 for low. */
typedef struct packet_beam {
    float slope[4], limit[4];
} packet_beam;

typedef struct tile_beam {
    float axis[3][3], origin[3];    /* u, v, w; the frame's origin, world */
    float square[5][6];             /* products of the axes: uu vv ww uw vw */
    half_space side[5];             /* world: u low and high, v low and high, behind */
    half_space depth;               /* n = w: smallest n.x of a box gives its entry bound */
    float depth_start, depth_scale; /* t >= (n.x - start) * scale */
    float frame_start;              /* and from the depth in the frame: t >= (w - frame_start) * scale */
    packet_beam packet[TILE_PACKETS], whole; /* whole: the same planes as side[0..3], in the frame */
} tile_beam;

static inline float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline half_space make_half_space(const float n[3], float limit)
{
    half_space h = {.limit = limit};
    for (int axis = 0; axis < 3; axis++) {
        h.n[axis] = n[axis];
        h.pick[axis] = 2 * axis * TREE_WIDTH + (n[axis] < 0 ? TREE_WIDTH : 0);
    }
    return h;
}

static void axis_products(const float a[3], const float b[3], float out[6])
{
    out[0] = a[0] * b[0];
    out[1] = a[1] * b[1];
    out[2] = a[2] * b[2];
    out[3] = a[1] * b[2] + a[2] * b[1];
    out[4] = a[2] * b[0] + a[0] * b[2];
    out[5] = a[0] * b[1] + a[1] * b[0];
}

/* w along the mean direction, u along a row of pixels when that has an extent, so that the planes hug the
   pixels. */
static bool make_frame(const packet_rays *rays, tile_beam *out)
{
    float *u = out->axis[0], *v = out->axis[1], *w = out->axis[2];
    int count = 0;
    const packet_rays *first = NULL;
    w[0] = w[1] = w[2] = 0;
    for (int p = 0; p < TILE_PACKETS; p++) {
        if (rays[p].active == 0)
            continue;
        if (first == NULL)
            first = &rays[p];
        for (int axis = 0; axis < 3; axis++)
            w[axis] += rays[p].dir[axis][0] + rays[p].dir[axis][3] + rays[p].dir[axis][12] +
                       rays[p].dir[axis][15]; /* the corners */
        count++;
    }
    const float length = sqrtf(dot3(w, w));
    if (!(length > 2 * (float)count)) /* 4 for parallel rays */
        return false;
    for (int axis = 0; axis < 3; axis++) {
        w[axis] /= length;
        u[axis] = first->dir[axis][3] - first->dir[axis][0];
        out->origin[axis] = first->origin[axis][0];
    }
    const float along = dot3(u, w);
    for (int axis = 0; axis < 3; axis++)
        u[axis] -= along * w[axis];
    float size = sqrtf(dot3(u, u));
    if (!(size > 1e-6f)) {
        const int least = fabsf(w[0]) < fabsf(w[1]) ? (fabsf(w[0]) < fabsf(w[2]) ? 0 : 2)
                                                    : (fabsf(w[1]) < fabsf(w[2]) ? 1 : 2);
        for (int axis = 0; axis < 3; axis++)
            u[axis] = (axis == least ? 1.0f : 0.0f) - w[least] * w[axis];
        size = sqrtf(dot3(u, u));
    }
    for (int axis = 0; axis < 3; axis++)
        u[axis] /= size;
    v[0] = w[1] * u[2] - w[2] * u[1];
    v[1] = w[2] * u[0] - w[0] * u[2];
    v[2] = w[0] * u[1] - w[1] * u[0];
    axis_products(u, u, out->square[0]);
    axis_products(v, v, out->square[1]);
    axis_products(w, w, out->square[2]);
    axis_products(u, w, out->square[3]);
    axis_products(v, w, out->square[4]);
    return true;
}

/* The largest side (x - slope w) of the origins of a packet, `at` in the frame: how far out they lie on that
   side. */
static inline float farthest_start(const vfloat16 at[3], int side, float slope)
{
    const vfloat16 x = at[side / 2], along = vfloat16_mul(vfloat16_set1(slope), at[2]);
    return vfloat16_highest(side % 2 == 0 ? vfloat16_sub(along, x) : vfloat16_sub(x, along));
}

/* False when the rays fan out so far that a beam makes no sense; they are then traced one by one. */
static bool make_beam(const packet_rays *rays, const kernel_scene *scene, tile_beam *out)
{
    if (!make_frame(rays, out))
        return false;
    /* Every bound is enlarged by more than rounding can have taken: 8 roundings of the slopes and 16 of the
       largest coordinate. */
    const float slack = 0x1p-20f * scene->coordinate_max;
    float slope[4] = {FLT_MAX, -FLT_MAX, FLT_MAX, -FLT_MAX}; /* of the whole tile */
    float forward_low = FLT_MAX, forward_high = 0, start_low = FLT_MAX, start_high = -FLT_MAX;
    vfloat16 at[TILE_PACKETS][3];
    for (int p = 0; p < TILE_PACKETS; p++) {
        packet_beam *b = &out->packet[p];
        if (rays[p].active == 0)
            continue;
        const vfloat16 dir[3] = {vfloat16_load(rays[p].dir[0]), vfloat16_load(rays[p].dir[1]),
                                 vfloat16_load(rays[p].dir[2])};
        vfloat16 offset[3];
        for (int axis = 0; axis < 3; axis++)
            offset[axis] =
                vfloat16_sub(vfloat16_load(rays[p].origin[axis]), vfloat16_set1(out->origin[axis]));
        const vfloat16 forward = dot_lanes(out->axis[2], dir);
        const float lowest = vfloat16_lowest(forward);
        if (!(lowest > AXIS_COMPONENT_MIN))
            return false;
        forward_low = smaller(forward_low, lowest),
        forward_high = larger(forward_high, vfloat16_highest(forward));
        for (int axis = 0; axis < 3; axis++)
            at[p][axis] = dot_lanes(out->axis[axis], offset);
        start_low = smaller(start_low, vfloat16_lowest(at[p][2]));
        start_high = larger(start_high, vfloat16_highest(at[p][2]));
        for (int k = 0; k < 2; k++) {
            const vfloat16 s = vfloat16_div(dot_lanes(out->axis[k], dir), forward);
            const float low = vfloat16_lowest(s), high = vfloat16_highest(s),
                        open = 0x1p-21f * (1 + fabsf(low) + fabsf(high));
            b->slope[2 * k] = low - open;
            b->slope[2 * k + 1] = high + open;
            slope[2 * k] = smaller(slope[2 * k], low - open);
            slope[2 * k + 1] = larger(slope[2 * k + 1], high + open);
            for (int side = 2 * k; side < 2 * k + 2; side++)
                b->limit[side] =
                    farthest_start(at[p], side, b->slope[side]) + slack * (1 + fabsf(b->slope[side]));
        }
    }
    for (int side = 0; side < 4; side++) {
        const float sign = side % 2 == 0 ? -1.0f : 1.0f;
        float limit = -FLT_MAX, n[3];
        for (int axis = 0; axis < 3; axis++)
            n[axis] = sign * (out->axis[side / 2][axis] - slope[side] * out->axis[2][axis]);
        for (int p = 0; p < TILE_PACKETS; p++)
            if (rays[p].active != 0)
                limit = larger(limit, farthest_start(at[p], side, slope[side]));
        limit += slack * (1 + fabsf(slope[side]));
        out->whole.slope[side] = slope[side];
        out->whole.limit[side] = limit;
        out->side[side] = make_half_space(n, limit + dot3(n, out->origin));
    }
    const float *w = out->axis[2], back[3] = {-w[0], -w[1], -w[2]}, base = dot3(w, out->origin);
    out->side[4] =
        make_half_space(back, -(base + start_low + scene->settings.t_near * forward_low * 0.999999f) + slack);
    out->depth = make_half_space(w, 0);
    out->depth_start = base + start_high + slack;
    out->frame_start = start_high + slack;
    out->depth_scale = 0.999999f / forward_high;
    return true;
}

static inline vfloat16 smallest_dot(const half_space *h, const float *node)
{
    vfloat16 sum = vfloat16_mul(vfloat16_set1(h->n[0]), vfloat16_load(node + h->pick[0]));
    sum = vfloat16_fma(vfloat16_set1(h->n[1]), vfloat16_load(node + h->pick[1]), sum);
    return vfloat16_fma(vfloat16_set1(h->n[2]), vfloat16_load(node + h->pick[2]), sum);
}

/* Which children the tile may touch, and a lower bound of t_c inside each. */
static inline unsigned test_children(const tile_beam *b, const tree_node *node, float t_near,
                                     float entry[TREE_WIDTH])
{
    const float *base = (const float *)node;
    vmask16 inside = vfloat16_le(smallest_dot(&b->side[0], base), vfloat16_set1(b->side[0].limit));
    for (int i = 1; i < 5; i++)
        inside = vmask16_and(inside,
                             vfloat16_le(smallest_dot(&b->side[i], base), vfloat16_set1(b->side[i].limit)));
    const vfloat16 depth =
        vfloat16_mul(vfloat16_sub(smallest_dot(&b->depth, base), vfloat16_set1(b->depth_start)),
                     vfloat16_set1(b->depth_scale));
    vfloat16_store(entry, vfloat16_max(depth, vfloat16_set1(t_near)));
    return vmask16_bits(inside);
}

/* Sixteen ellipsoids in the tile's frame: centre, and covariance enlarged by its rounding errors. */
typedef struct ellipsoids16 {
    vfloat16 u, v, w, uu, vv, ww, uw, vw;
} ellipsoids16;

/* a^T S b from the products of a and b (axis_products); S = xx yy zz yz zx xy. */
static inline vfloat16 covariance_product(const vfloat16 s[6], const float product[6])
{
    vfloat16 sum = vfloat16_mul(vfloat16_set1(product[0]), s[0]);
    for (int k = 1; k < 6; k++)
        sum = vfloat16_fma(vfloat16_set1(product[k]), s[k], sum);
    return sum;
}

static inline void turn_ellipsoids(const tree_leaf *leaf, const tile_beam *b, ellipsoids16 *out)
{
    vfloat16 offset[3], s[6];
    for (int axis = 0; axis < 3; axis++)
        offset[axis] = vfloat16_sub(vfloat16_load(leaf->mean[axis]), vfloat16_set1(b->origin[axis]));
    for (int k = 0; k < 6; k++)
        s[k] = vfloat16_load(leaf->covariance[k]);
    /* About ten roundings, 2^-22 together; test_ellipsoids() multiplies them by 1 + slope^2, 11 at most
       (make_beam). */
    const vfloat16 slack =
        vfloat16_mul(vfloat16_set1(0x1p-18f), vfloat16_add(s[0], vfloat16_add(s[1], s[2])));
    out->u = dot_lanes(b->axis[0], offset);
    out->v = dot_lanes(b->axis[1], offset);
    out->w = dot_lanes(b->axis[2], offset);
    out->uu = vfloat16_add(covariance_product(s, b->square[0]), slack);
    out->vv = vfloat16_add(covariance_product(s, b->square[1]), slack);
    out->ww = covariance_product(s, b->square[2]);
    out->uw = covariance_product(s, b->square[3]);
    out->vw = covariance_product(s, b->square[4]);
}

/* Which of the ellipsoids reach into the four planes: n.c - limit <= sqrt(n^T S n). */
static inline unsigned test_ellipsoids(const packet_beam *b, const ellipsoids16 *e)
{
    vmask16 outside = vmask16_from_bits(0);
    for (int side = 0; side < 4; side++) {
        const vfloat16 slope = vfloat16_set1(b->slope[side]), x = side < 2 ? e->u : e->v,
                       xx = side < 2 ? e->uu : e->vv, xw = side < 2 ? e->uw : e->vw;
        const vfloat16 across = vfloat16_fnma(slope, e->w, x); /* x - slope w */
        const vfloat16 beyond = side % 2 == 0 ? vfloat16_sub(vfloat16_set1(-b->limit[side]), across)
                                              : vfloat16_sub(across, vfloat16_set1(b->limit[side]));
        const vfloat16 reach = vfloat16_fma(
            slope, vfloat16_fma(slope, e->ww, vfloat16_sub(vfloat16_set1(0), vfloat16_add(xw, xw))), xx);
        outside = vmask16_or(outside, vmask16_and(vfloat16_lt(vfloat16_set1(0), beyond),
                                                  vfloat16_lt(reach, vfloat16_mul(beyond, beyond))));
    }
    return vmask16_bits(outside) ^ 0xFFFF;
}

/* A lower bound of t_c on every ray of the tile that hits. */
static inline vfloat16 ellipsoid_nearest(const ellipsoids16 *e, const tile_beam *b, float t_near)
{
    /* 1.0001: for the rounding of ww and of the root */
    const vfloat16 nearest = vfloat16_fnma(vfloat16_sqrt(e->ww), vfloat16_set1(1.0001f), e->w);
    return vfloat16_max(
        vfloat16_mul(vfloat16_sub(nearest, vfloat16_set1(b->frame_start)), vfloat16_set1(b->depth_scale)),
        vfloat16_set1(t_near));
}

/* The range of slopes that ellipsoids cover as seen from the frame's origin, from their tangent planes
   through it: low and high of u, low and high of v. Returns the lanes whose ellipsoids lie wholly in front of
   the depth `near`; only their slopes are valid. `open`: the error of coordinates. */
static inline vmask16 ellipsoid_slopes(const ellipsoids16 *e, float near, float open, vfloat16 slope[4])
{
    const vfloat16 in_front = vfloat16_sub(e->w, vfloat16_set1(near));
    const vmask16 front = vmask16_and(vfloat16_lt(vfloat16_set1(0), in_front),
                                      vfloat16_lt(e->ww, vfloat16_mul(in_front, in_front)));
    /* Roots s of (w^2 - ww) s^2 - 2 (x w - xw) s + (x^2 - xx) = 0, with a discriminant without large terms
       that cancel */
    const vfloat16 inverse = vfloat16_div(vfloat16_set1(1), vfloat16_sub(vfloat16_mul(e->w, e->w), e->ww));
    for (int k = 0; k < 2; k++) {
        const vfloat16 x = k == 0 ? e->u : e->v, xx = k == 0 ? e->uu : e->vv, xw = k == 0 ? e->uw : e->vw;
        const vfloat16 quadratic =
            vfloat16_fma(e->w, vfloat16_fma(e->w, xx, vfloat16_mul(vfloat16_set1(-2), vfloat16_mul(x, xw))),
                         vfloat16_mul(vfloat16_mul(x, x), e->ww));
        const vfloat16 half = vfloat16_sqrt(
            vfloat16_max(vfloat16_fma(xw, xw, vfloat16_fnma(xx, e->ww, quadratic)), vfloat16_set1(0)));
        const vfloat16 middle = vfloat16_sub(vfloat16_mul(x, e->w), xw);
        const vfloat16 low = vfloat16_mul(vfloat16_sub(middle, half), inverse),
                       high = vfloat16_mul(vfloat16_add(middle, half), inverse);
        const vfloat16 slack = vfloat16_fma(vfloat16_sub(high, low), vfloat16_set1(1e-4f),
                                            vfloat16_mul(vfloat16_mul(vfloat16_set1(open), e->w), inverse));
        slope[2 * k] = vfloat16_sub(low, slack);
        slope[2 * k + 1] = vfloat16_add(high, slack);
    }
    return front;
}

#endif
