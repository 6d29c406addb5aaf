/* SPDX-License-Identifier: Apache-2.0 */
/* growth/statistics.c -- importance of anchors and gradients of Gaussians, added up view by view. */
#include "growth/statistics.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

static const float gradient_max = 1e18f; /* sums of these stay finite */

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
        s->capacity = 0; /* no rows are in use: arrays of another width must be made */
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

/* The importance of an anchor is what pictures would miss without it: the share of them that its Gaussians
   cover. Opacity, which the reference takes, says nothing of Gaussians that are hidden or tiny: a third of
   all anchors. */
static void gather_importance(growth_stats *s, const frame *f, growth_importance importance)
{
    const float rays = (float)ray_image_count(&f->rays);
    for (size_t v = 0; v < f->visible_count; v++) {
        s->visit_count[f->visible[v]] += 1;
        if (importance == GROWTH_BY_OPACITY)
            s->importance_accum[f->visible[v]] += f->tape.opacity_sum[v];
    }
    for (size_t i = 0; importance == GROWTH_BY_SHARE && i < f->gaussians.count; i++)
        s->importance_accum[f->visible[f->tape.slot[i] / (uint32_t)s->offset_count]] +=
            f->blend_weight[i] / rays;
}

static bool is_on_screen(const screen_view *s, const gaussians *g, size_t i)
{
    const float mean[3] = {g->mean_x[i], g->mean_y[i], g->mean_z[i]},
                quat[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]},
                scale[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    return screen_touches(s, mean, quat, scale);
}

/* The norm of dL/d(projected mean in NDC), from the ray-traced gradient of the mean in camera axes (g): (z
   tan_x g.x, z tan_y g.y). Counted for every Gaussian whose box may touch the image, hit or not: counting
   hits alone would grow what is mostly hidden. */
static void gather_gradients(growth_stats *s, const frame *f, float t_near)
{
    const int k_count = s->offset_count;
    float r[9], c[3];
    for (int i = 0; i < 9; i++)
        r[i] = (float)f->camera.rotation[i];
    for (int i = 0; i < 3; i++)
        c[i] = (float)f->camera.center[i];
    const float tan_x = (float)f->half_fov_tan[0], tan_y = (float)f->half_fov_tan[1];
    const gaussians *g = &f->gaussians, *dg = &f->d_gaussians;
    for (size_t i = 0; i < g->count; i++) {
        const float x = g->mean_x[i] - c[0], y = g->mean_y[i] - c[1], z = g->mean_z[i] - c[2];
        const float cam_z = r[6] * x + r[7] * y + r[8] * z;
        if (!(cam_z > t_near))
            continue;
        const float cam_x = r[0] * x + r[1] * y + r[2] * z, cam_y = r[3] * x + r[4] * y + r[5] * z;
        const float reach = 3 * fmaxf(g->scale_x[i], fmaxf(g->scale_y[i], g->scale_z[i]));
        if (f->by_screen ? !is_on_screen(&f->screen, g, i)
                         : fabsf(cam_x) > tan_x * cam_z + reach || fabsf(cam_y) > tan_y * cam_z + reach)
            continue;
        const float gx = r[0] * dg->mean_x[i] + r[1] * dg->mean_y[i] + r[2] * dg->mean_z[i];
        const float gy = r[3] * dg->mean_x[i] + r[4] * dg->mean_y[i] + r[5] * dg->mean_z[i];
        const float sx = cam_z * tan_x * gx, sy = cam_z * tan_y * gy;
        const uint32_t slot = f->tape.slot[i];
        const size_t at =
            (size_t)f->visible[slot / (uint32_t)k_count] * (size_t)k_count + slot % (uint32_t)k_count;
        s->grad_accum[at] += fminf(sqrtf(sx * sx + sy * sy), gradient_max);
        s->grad_count[at] += 1;
    }
}

void growth_stats_gather(growth_stats *s, const frame *f, growth_importance importance, float t_near)
{
    gather_importance(s, f, importance);
    gather_gradients(s, f, t_near);
}
