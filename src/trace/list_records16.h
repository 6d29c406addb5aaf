/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_records16.h -- the records of a face of a view, and where each can be hit, sixteen Gaussians at
   a time.

   A ray is hit where d2 = R^2 y / den <= c, c being the d2 at which the response falls to alpha_min
   (view_form16.h defines y, den, w1, R, q1..q5). With kappa = c / R^2 and lambda = kappa / (1 - kappa) that
   is y <= lambda w1^2: an ellipse in (a, b), if all of the ellipsoid lies ahead. With p = q1 q4 - q2 q3, P =
   p^2 + q1^2 q5^2 and S = q3^2 q5^2, the determinant of its form is D = S - lambda P, and all else is made of
   sums that do not cancel while lambda P <= 3/4 S. Where this, or lying ahead, fails, the record is general
   and keeps its ellipsoid. Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_RECORDS16_H
#define GBT_TRACE_LIST_RECORDS16_H

#include "trace/list_view.h"
#include "trace/rays.h"
#include "trace/view_form16.h"

/* Means of sixteen Gaussians in the axes of a face; in double, so that slopes keep all digits of the
   coordinates. */
typedef struct list_means {
    double a[16], b[16];
    _Alignas(64) float slope[2][16], at[3][16];
} list_means;

static inline void place_means(const gaussians *g, const list_frame *frame, size_t first, list_means *out)
{
    const double(*dual)[3] = frame->dual, *o = frame->origin;
    for (int i = 0; i < 16; i++) {
        const size_t at = first + (size_t)i;
        const double x = (double)g->mean_x[at] - o[0], y = (double)g->mean_y[at] - o[1],
                     z = (double)g->mean_z[at] - o[2];
        const double u = dual[0][0] * x + dual[0][1] * y + dual[0][2] * z,
                     v = dual[1][0] * x + dual[1][1] * y + dual[1][2] * z,
                     w = dual[2][0] * x + dual[2][1] * y + dual[2][2] * z, inverse = 1 / w;
        out->a[i] = u * inverse;
        out->b[i] = v * inverse;
        out->slope[0][i] = (float)out->a[i];
        out->slope[1][i] = (float)out->b[i];
        out->at[0][i] = (float)u;
        out->at[1][i] = (float)v;
        out->at[2][i] = (float)w;
    }
}

/* Which of sixteen can be seen at all: a coarser form of the rule of bvh/proxy.c, with one bound on the
   extent in place of three extents. */
static inline unsigned visible_lanes(const kernel_scene *scene, const gaussians *g, size_t first, size_t end)
{
    unsigned bits = 0;
    for (unsigned i = 0; i < 16 && first + i < end; i++) {
        const size_t at = first + i;
        const float color = g->red[at] + g->green[at] + g->blue[at],
                    quat_norm2 = g->quat_w[at] * g->quat_w[at] + g->quat_x[at] * g->quat_x[at] +
                                 g->quat_y[at] * g->quat_y[at] + g->quat_z[at] * g->quat_z[at],
                    size = (1 + 4 * quat_norm2) * (g->scale_x[at] + g->scale_y[at] + g->scale_z[at]),
                    reach = fabsf(g->mean_x[at]) + fabsf(g->mean_y[at]) + fabsf(g->mean_z[at]) + 10 * size;
        if (g->opacity[at] <= scene->settings.alpha_min)
            continue;
        const bool sound = isfinite(g->opacity[at]) && g->scale_x[at] > 0 && g->scale_y[at] > 0 &&
                           g->scale_z[at] > 0 && isfinite(color) &&
                           reach < (float)RAY_ORIGIN_LIMIT; /* false for NaN too */
        bits |= (unsigned)sound << i;
    }
    return bits;
}

/* A d2 enlarged by a hundred times its rounding errors: about 2^-20 of d2 = R^2 y / den, and 2^-22 of alpha,
   which is 5e-7 in 2 ln alpha. */
static inline vfloat16 open_square(vfloat16 square)
{
    return vfloat16_fma(square, vfloat16_set1(1.0001f), vfloat16_set1(2e-5f));
}

/* Largest d2 at which sixteen Gaussians are hit, 2 ln(o / alpha_min), enlarged for rounding. */
static inline vfloat16 cut_squares(const kernel_scene *scene, const float *opacity, unsigned lanes)
{
    _Alignas(64) float cut[16] = {0};
    for (int i = 0; i < 16; i++)
        if (lanes >> i & 1)
            cut[i] = 2 * logf(opacity[i] / scene->settings.alpha_min);
    return open_square(vfloat16_load(cut));
}

/* cut_squares() for opacity 1, or their own if that is more. */
static inline vfloat16 whole_squares(const kernel_scene *scene, vfloat16 cut)
{
    return vfloat16_max(cut, open_square(vfloat16_set1(2 * logf(1 / scene->settings.alpha_min))));
}

typedef struct outline_lanes {
    vfloat16 field[8]; /* of list_outline */
    vmask16 holds;     /* the form holds; the others need their ellipsoids */
} outline_lanes;

static inline outline_lanes find_outlines(const kernel_scene *scene, const view_form *form, vfloat16 depth,
                                          vfloat16 cut)
{
    const vfloat16 *q = form->q, one = vfloat16_set1(1), limit = vfloat16_set1(1e9f);
    outline_lanes o;
    const vfloat16 kappa = vfloat16_div(cut, vfloat16_mul(form->distance, form->distance)),
                   lambda = vfloat16_div(kappa, vfloat16_sub(one, kappa));
    const vfloat16 p = vfloat16_fnma(q[1], q[2], vfloat16_mul(q[0], q[3])), q55 = vfloat16_mul(q[4], q[4]),
                   q33 = vfloat16_mul(q[2], q[2]), S = vfloat16_mul(q33, q55);
    const vfloat16 across = vfloat16_mul(q[0], q55),
                   P = vfloat16_fma(p, p, vfloat16_mul(vfloat16_mul(q[0], q[0]), q55)),
                   D = vfloat16_fnma(lambda, P, S);
    const vfloat16 A = vfloat16_fnma(lambda, vfloat16_mul(q[0], q[0]), q33),
                   B = vfloat16_fnma(lambda, vfloat16_mul(q[0], q[1]), vfloat16_mul(q[2], q[3])),
                   C = vfloat16_div(vfloat16_fma(B, B, D), A);
    /* 1.001 covers the rounding of about 1e-5: as D >= S / 4, the difference loses three bits at most. */
    const vfloat16 inverse = vfloat16_div(one, D), share = vfloat16_mul(lambda, inverse),
                   G = vfloat16_mul(S, inverse),
                   s = vfloat16_mul(vfloat16_mul(lambda, vfloat16_set1(1.001f)), G);
    o.field[0] = vfloat16_mul(share, vfloat16_fma(q[3], p, across));
    o.field[1] = vfloat16_sub(vfloat16_set1(0), vfloat16_mul(share, vfloat16_mul(q[2], p)));
    const vfloat16 root = vfloat16_sqrt(vfloat16_div(A, s)), over = vfloat16_div(root, A);
    o.field[2] = root;
    o.field[3] = vfloat16_mul(B, over);
    o.field[4] = vfloat16_mul(vfloat16_sqrt(D), over);
    o.field[5] = vfloat16_sqrt(vfloat16_mul(vfloat16_mul(s, C), inverse));
    o.field[6] = vfloat16_sqrt(vfloat16_mul(vfloat16_mul(s, A), inverse));
    o.field[7] = kappa;
    const vfloat16 w1_most = vfloat16_add(G, vfloat16_sqrt(vfloat16_mul(share, vfloat16_mul(G, P)))),
                   nearest = vfloat16_div(vfloat16_mul(depth, vfloat16_sub(one, kappa)), w1_most);
    /* 1.001: no hit is so near that rounding could cut it at t_near. */
    const vmask16 ahead =
        vmask16_and(vfloat16_lt(vfloat16_set1(1.001f * scene->settings.t_near), nearest),
                    vmask16_and(vfloat16_lt(vfloat16_set1(0), depth), vfloat16_lt(vfloat16_set1(0), D)));
    const vmask16 small =
        vmask16_and(vfloat16_lt(kappa, vfloat16_set1(0.5f)),
                    vfloat16_lt(vfloat16_mul(lambda, P), vfloat16_mul(vfloat16_set1(0.75f), S)));
    /* The adjoint squares R and y twice: these limits keep that finite. */
    const vmask16 sound = vmask16_and(
        vmask16_and(form->sound, vmask16_and(vfloat16_lt(vfloat16_set1(1e-30f), S),
                                             vfloat16_lt(form->falloff, vfloat16_set1(1e14f)))),
        vmask16_and(
            vfloat16_lt(q[2], limit),
            vmask16_and(vfloat16_lt(q[4], limit),
                        vfloat16_lt(vfloat16_max(q[3], vfloat16_sub(vfloat16_set1(0), q[3])), limit))));
    o.holds = vmask16_and(sound, vmask16_and(ahead, small));
    return o;
}

/* Centres and covariances of sixteen ellipsoids in the axes of the face. A covariance is `cut` times the sum
   of the squares (outer products) of the scaled axes. */
static inline void find_ellipsoids(const gaussian_lanes *g, const list_frame *frame, const float at[3][16],
                                   vfloat16 cut, vfloat16 out[8])
{
    vfloat16 axis[3][3];
    float dual[3][3];
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++)
            dual[r][k] = (float)frame->dual[r][k];
    for (int k = 0; k < 3; k++) { /* row k is axis k over s_k; divided by its square, axis k times s_k */
        const vfloat16 inverse = vfloat16_div(vfloat16_set1(1), dot16(g->matrix + 3 * k, g->matrix + 3 * k));
        for (int r = 0; r < 3; r++)
            axis[r][k] = vfloat16_mul(dot_lanes(dual[r], g->matrix + 3 * k), inverse);
    }
    for (int r = 0; r < 3; r++)
        out[r] = vfloat16_load(at[r]);
    out[3] = vfloat16_mul(cut, dot16(axis[0], axis[0]));
    out[4] = vfloat16_mul(cut, dot16(axis[1], axis[1]));
    out[5] = vfloat16_mul(cut, dot16(axis[2], axis[2]));
    out[6] = vfloat16_mul(cut, dot16(axis[0], axis[2]));
    out[7] = vfloat16_mul(cut, dot16(axis[1], axis[2]));
    /* About twenty roundings, 2^-21 together; ellipsoid_meets_box() multiplies them by 1 + slope^2, 11 at
       most */
    const vfloat16 slack =
        vfloat16_mul(vfloat16_set1(0x1p-17f), vfloat16_add(out[3], vfloat16_add(out[4], out[5])));
    for (int k = 3; k < 6; k++)
        out[k] = vfloat16_add(out[k], slack);
}

/* Tests bounding spheres of the Gaussians of a block, slightly enlarged for rounding, against the planes of
   each face. */
static void find_reached(const kernel_scene *scene, const gaussians *g, list_view *view, size_t block)
{
    const vfloat16 one = vfloat16_set1(1);
    const size_t begin = block * LIST_GRAIN,
                 end = begin + LIST_GRAIN < g->count ? begin + LIST_GRAIN : g->count;
    for (size_t first = begin; first < end; first += 16) {
        const unsigned visible = visible_lanes(scene, g, first, end);
        uint32_t id[16];
        for (unsigned i = 0; i < 16; i++)
            id[i] = (uint32_t)(first + i < end ? first + i : first);
        const gaussian_lanes lanes = load_gaussians(scene, id, NULL);
        vfloat16 thinnest = dot16(lanes.matrix, lanes.matrix), from[3], far = vfloat16_set1(0);
        for (int k = 1; k < 3; k++)
            thinnest = vfloat16_min(thinnest, dot16(lanes.matrix + 3 * k, lanes.matrix + 3 * k));
        for (int k = 0; k < 3; k++) {
            const float o = (float)view->face[0].frame.origin[k];
            from[k] = vfloat16_sub(lanes.mean[k], vfloat16_set1(o));
            far =
                vfloat16_add(far, vfloat16_add(vfloat16_max(from[k], vfloat16_sub(vfloat16_set1(0), from[k])),
                                               vfloat16_set1(fabsf(o))));
        }
        const vfloat16 cut = cut_squares(scene, g->opacity + first, visible),
                       radius = vfloat16_fma(
                           vfloat16_set1(1e-5f), far,
                           vfloat16_mul(vfloat16_set1(1.001f), vfloat16_sqrt(vfloat16_div(cut, thinnest))));
        for (int f = 0; f < view->face_count; f++) {
            const list_face *face = &view->face[f];
            const float(*axis)[3] = face->frame.axis;
            const vfloat16 depth = dot_lanes(axis[2], from);
            vmask16 out = vfloat16_lt(vfloat16_add(depth, radius), vfloat16_set1(0));
            for (int k = 0; k < 2; k++) {
                const vfloat16 low = vfloat16_set1(face->bounds.low[k]),
                               high = vfloat16_set1(face->bounds.high[k]), x = dot_lanes(axis[k], from),
                               low_length = vfloat16_sqrt(vfloat16_fma(low, low, one)),
                               high_length = vfloat16_sqrt(vfloat16_fma(high, high, one));
                out = vmask16_or(out, vfloat16_lt(vfloat16_mul(radius, low_length),
                                                  vfloat16_fnma(x, one, vfloat16_mul(low, depth))));
                out = vmask16_or(
                    out, vfloat16_lt(vfloat16_mul(radius, high_length), vfloat16_fnma(high, depth, x)));
            }
            const unsigned bits = face->part_count > 0 ? visible & ~vmask16_bits(out) : 0;
            const size_t entry = (size_t)f * view->block_count + block;
            view->reached[entry * (LIST_GRAIN / 16) + (first - begin) / 16] = (uint16_t)bits;
            view->kept[entry].records += (uint32_t)__builtin_popcount(bits);
        }
    }
}

/* Sixteen Gaussians in the axes of a face. */
typedef struct record_lanes {
    list_means means;
    _Alignas(64) float q[5][16], falloff[16], outline[8][16], ellipsoid[8][16]; /* fields of list_shape */
    unsigned holds; /* bit per Gaussian: its form holds, and it has an outline; else, an ellipsoid */
    unsigned kept;  /* bit per Gaussian: its outline meets the bounds of the face, or it has an ellipsoid */
} record_lanes;

static inline void measure_sixteen(const kernel_scene *scene, const gaussians *g, const list_face *face,
                                   size_t first, size_t end, unsigned visible, record_lanes *out)
{
    const slope_box *bounds = &face->bounds;
    uint32_t id[16];
    view_form form;
    for (unsigned i = 0; i < 16; i++)
        id[i] = (uint32_t)(first + i < end ? first + i : first);
    const gaussian_lanes lanes = load_gaussians(scene, id, NULL);
    place_means(g, &face->frame, first, &out->means);
    const vfloat16 slope[2] = {vfloat16_load(out->means.slope[0]), vfloat16_load(out->means.slope[1])},
                   depth = vfloat16_load(out->means.at[2]);
    view_form_find(face->frame.axis, &lanes, slope[0], slope[1], depth, &form);
    const vfloat16 cut = cut_squares(scene, g->opacity + first, visible);
    const outline_lanes outline = find_outlines(scene, &form, depth, cut);
    /* Whether the form holds is decided as if the opacity were 1: then it does so for all of several copies
       or for none. The two formulas for t round differently, and copies would change their order from ray to
       ray. */
    const vmask16 whole = find_outlines(scene, &form, depth, whole_squares(scene, cut)).holds;
    out->holds = vmask16_bits(whole) & visible;
    vmask16 inside = vmask16_from_bits(out->holds);
    for (int k = 0; k < 2; k++) {
        const vfloat16 middle = vfloat16_add(slope[k], outline.field[k]), half = outline.field[5 + k];
        inside = vmask16_and(
            inside, vmask16_and(vfloat16_le(vfloat16_sub(middle, half), vfloat16_set1(bounds->high[k])),
                                vfloat16_le(vfloat16_set1(bounds->low[k]), vfloat16_add(middle, half))));
    }
    out->kept = vmask16_bits(inside) | (visible & ~out->holds);
    for (int k = 0; k < 5; k++)
        vfloat16_store(out->q[k], form.q[k]);
    vfloat16_store(out->falloff, form.falloff);
    for (int k = 0; k < 8; k++)
        vfloat16_store(out->outline[k], outline.field[k]);
    if (out->holds != visible) {
        vfloat16 field[8];
        find_ellipsoids(&lanes, &face->frame, (const float(*)[16])out->means.at, cut, field);
        for (int k = 0; k < 8; k++)
            vfloat16_store(out->ellipsoid[k], field[k]);
    }
}

/* Writes the record of lane `i`, which is Gaussian `id`. False when its ellipsoid misses the bounds. */
static inline bool write_record(const gaussians *g, const slope_box *bounds, const record_lanes *m, int i,
                                size_t id, list_record *record, list_shape *shape)
{
    const bool holds = (m->holds >> i & 1) != 0;
    const float(*field)[16] = holds ? m->outline : m->ellipsoid;
    float eight[8];
    for (int k = 0; k < 8; k++)
        eight[k] = field[k][i];
    memcpy(shape, eight, sizeof eight);
    if (!holds && !ellipsoid_meets_box(&shape->ellipsoid, bounds))
        return false;
    *record = (list_record){.a = m->means.a[i],
                            .b = m->means.b[i],
                            .q = {m->q[0][i], m->q[1][i], m->q[2][i], m->q[3][i], m->q[4][i]},
                            .depth = m->means.at[2][i],
                            .falloff = m->falloff[i],
                            .opacity = g->opacity[id],
                            .color = {g->red[id], g->green[id], g->blue[id]},
                            .id = (uint32_t)id | (holds ? 0 : RECORD_GENERAL)};
    return true;
}

static list_kept make_records(const kernel_scene *scene, const gaussians *g, const list_face *face,
                              size_t block, const uint16_t *reached, list_record *records, list_shape *shapes)
{
    list_kept kept = {0};
    const size_t begin = block * LIST_GRAIN,
                 end = begin + LIST_GRAIN < g->count ? begin + LIST_GRAIN : g->count;
    for (size_t first = begin; first < end; first += 16) {
        const unsigned visible =
            reached != NULL ? reached[(first - begin) / 16] : visible_lanes(scene, g, first, end);
        record_lanes m;
        if (visible == 0)
            continue;
        measure_sixteen(scene, g, face, first, end, visible, &m);
        for (unsigned rest = m.kept; rest != 0; rest &= rest - 1) {
            const int i = __builtin_ctz(rest);
            list_record *record = &records[kept.records];
            if (!write_record(g, &face->bounds, &m, i, first + (size_t)i, record, &shapes[kept.records]))
                continue;
            kept.general += record_is_general(record);
            kept.records++;
        }
    }
    return kept;
}

#endif
