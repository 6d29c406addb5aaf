/* SPDX-License-Identifier: Apache-2.0 */
/* growth/statistics.c -- accumulate the importance of anchors and the gradients of Gaussians over views. */
#include "growth/statistics.h"

#include <math.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { GATHER_BLOCK = 1024 /* visible anchors */ };
static const float gradient_max = 1e18f; /* a clamp, so that sums stay finite */

const row_field growth_stat_fields[GROWTH_STATS] = {
#define X(name, label, per_offset, meaning) {label, label, 1, per_offset},
    GROWTH_STAT_LIST(X)
#undef X
};

gbt_status growth_stats_resize(growth_stats *s, size_t count, int offset_count, gbt_error *err)
{
    if (offset_count < 1 || offset_count > ANCHOR_MAX_OFFSETS ||
        (s->count > 0 && offset_count != s->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT, "statistics: offset_count %d (wanted 1 to %d, constant)",
                         offset_count, ANCHOR_MAX_OFFSETS);
    if (offset_count != s->offset_count)
        s->capacity = 0; /* no rows are in use: reallocate, because the row width may differ */
    GBT_TRY(rows_resize(s->field, growth_stat_fields, GROWTH_STATS, offset_count, &s->capacity, s->count,
                        count, "statistics", err));
    s->count = count;
    s->offset_count = offset_count;
    return GBT_OK;
}

void growth_stats_free(growth_stats *s)
{
    for (int f = 0; f < GROWTH_STATS; f++)
        mem_free(s->field[f]);
    memset(s, 0, sizeof *s);
}

/* Row of the statistics of a visible anchor. */
static size_t stat_row(const growth_stats *s, const frame *f, size_t row)
{
    return s->count == f->visible_count ? row : f->visible[row];
}

/* Statistics of one view to add; an anchor's row and its Gaussians belong to a single block. */
typedef struct gather_job {
    growth_stats *stats;
    const frame *f;
    growth_importance importance;
    growth_counting counting;
    float t_near;
} gather_job;

/* Index of the first Gaussian that belongs to a visible anchor at `row` or later. */
static size_t first_gaussian(const gather_job *job, size_t row)
{
    const uint32_t *slot = job->f->tape.slot;
    const size_t slot_first = row * (size_t)job->stats->offset_count;
    size_t low = 0, high = job->f->gaussians.count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (slot[middle] < slot_first)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Add the importance of visible anchors [begin, end) with Gaussians [first, last). Importance is the anchor's
   share of the image, the sum of blending weights of its Gaussians: what images would lose without it. The
   reference uses opacity, which cannot recognise hidden or tiny Gaussians, a third of all anchors. */
static void gather_importance(const gather_job *job, size_t begin, size_t end, size_t first, size_t last)
{
    const frame *f = job->f;
    growth_stats *s = job->stats;
    const float rays = (float)ray_image_count(&f->rays);
    for (size_t v = begin; v < end; v++) {
        s->visit_count[stat_row(s, f, v)] += 1;
        if (job->importance == GROWTH_BY_OPACITY) {
            s->importance_accum[stat_row(s, f, v)] += f->tape.opacity_sum[v];
            s->shown_count[stat_row(s, f, v)] += 1;
        }
    }
    size_t before = SIZE_MAX; /* the Gaussians of an anchor are consecutive */
    for (size_t i = first; job->importance == GROWTH_BY_SHARE && i < last; i++) {
        const size_t anchor = stat_row(s, f, f->tape.slot[i] / (uint32_t)s->offset_count);
        if (!(f->blend_weight[i] > 0))
            continue;
        s->importance_accum[anchor] += f->blend_weight[i] / rays;
        s->shown_count[anchor] += anchor != before;
        before = anchor;
    }
}

static bool is_on_screen(const screen_view *s, const gaussians *g, size_t i)
{
    const float mean[3] = {g->mean_x[i], g->mean_y[i], g->mean_z[i]},
                quat[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]},
                scale[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    return screen_touches(s, mean, quat, scale);
}

/* Camera axes, and the extent of the view at depth 1. */
typedef struct gradient_view {
    float rotation[9], center[3], tan_half[2];
    bool looks_forward;
} gradient_view;

static gradient_view view_of(const frame *f)
{
    gradient_view v = {.looks_forward = camera_lens_looks_forward(&f->rays.lens)};
    for (int i = 0; i < 9; i++)
        v.rotation[i] = (float)f->camera.rotation[i];
    for (int i = 0; i < 3; i++)
        v.center[i] = (float)f->camera.center[i];
    for (int i = 0; i < 2; i++)
        v.tan_half[i] = (float)f->half_fov_tan[i];
    return v;
}

static void to_camera(const gradient_view *v, const float world[3], float cam[3])
{
    for (int i = 0; i < 3; i++)
        cam[i] = v->rotation[3 * i] * world[0] + v->rotation[3 * i + 1] * world[1] +
                 v->rotation[3 * i + 2] * world[2];
}

/* The norm of dL/d(projected mean in NDC), from the gradient g of the mean p, both in camera axes: (z tan_x
   g.x, z tan_y g.y). For lenses that look to all sides, where depth along an axis is meaningless, it is the
   norm of the gradient for motion of the mean perpendicular to its ray, times the image's extent in
   radians. */
static float screen_gradient(const gradient_view *v, const float p[3], const float g[3])
{
    const float *tan_half = v->tan_half;
    if (v->looks_forward) {
        const float x = p[2] * tan_half[0] * g[0], y = p[2] * tan_half[1] * g[1];
        return sqrtf(x * x + y * y);
    }
    const float far_square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2],
                g_square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2],
                along = p[0] * g[0] + p[1] * g[1] + p[2] * g[2];
    return sqrtf(larger(far_square * g_square - along * along, 0) * tan_half[0] * tan_half[1]);
}

/* Does the Gaussian's bounding box touch the view cone of a centred pinhole, or, for FRAME_SIGHT_BY_ANCHOR
   views, its splat the image? */
static bool is_in_cone(const gradient_view *v, const frame *f, size_t i, const float p[3], float t_near)
{
    if (f->by_screen)
        return p[2] > t_near && is_on_screen(&f->screen, &f->gaussians, i);
    const gaussians *g = &f->gaussians;
    const float reach = 3 * larger(g->scale_x[i], larger(g->scale_y[i], g->scale_z[i]));
    return p[2] > t_near && fabsf(p[0]) <= v->tan_half[0] * p[2] + reach &&
           fabsf(p[1]) <= v->tan_half[1] * p[2] + reach;
}

/* Add the gradient statistics of Gaussians [first, last). */
static void gather_gradients(const gather_job *job, const gradient_view *view, size_t first, size_t last)
{
    const frame *f = job->f;
    growth_stats *s = job->stats;
    const uint32_t k_count = (uint32_t)s->offset_count;
    const gaussians *g = &f->gaussians, *dg = &f->d_gaussians;
    for (size_t i = first; i < last; i++) {
        const float from[3] = {g->mean_x[i] - view->center[0], g->mean_y[i] - view->center[1],
                               g->mean_z[i] - view->center[2]};
        const float gradient[3] = {dg->mean_x[i], dg->mean_y[i], dg->mean_z[i]};
        float p[3], d[3];
        to_camera(view, from, p);
        if (job->counting == GROWTH_COUNT_IN_CONE ? !is_in_cone(view, f, i, p, job->t_near)
                                                  : !(f->blend_weight[i] > 0))
            continue;
        to_camera(view, gradient, d);
        const uint32_t slot = f->tape.slot[i];
        const size_t at = stat_row(s, f, slot / k_count) * k_count + slot % k_count;
        s->grad_accum[at] += smaller(screen_gradient(view, p, d), gradient_max);
        s->grad_count[at] += 1;
    }
}

static void gather_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const gather_job *job = context;
    const gradient_view view = view_of(job->f);
    const size_t first = first_gaussian(job, begin), last = first_gaussian(job, end);
    gather_importance(job, begin, end, first, last);
    gather_gradients(job, &view, first, last);
}

void growth_stats_gather(growth_stats *s, const frame *f, growth_importance importance,
                         growth_counting counting, float t_near)
{
    gather_job job = {s, f, importance, counting, t_near};
    parallel_blocks(f->visible_count, GATHER_BLOCK, gather_block, &job);
}
