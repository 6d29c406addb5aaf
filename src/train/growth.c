/* SPDX-License-Identifier: Apache-2.0 */
/* train/growth.c -- what anchors are good for, gathered step by step; and the rounds in which they grow and
   are pruned by it. */
#include "train/growth.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "bvh/points.h"
#include "train/def.h"
#include "train/gradient_check.h"
#include "train/sight.h"

static const float share_min = 2.5e-6f;     /* of short runs: schedule_threshold_factor() */
static const double last_rounds_from = 0.9; /* of growing */
enum {
    ADJUSTS_PER_RUN = 100,
    COMPAT_INTERVAL = 100 /* steps */,
    INTERVAL_MIN = 20 /* a judgement of fewer views is chance */
};
enum { VIEWS_MIN = 2 };

/* What an anchor is good for is what pictures would miss without it: the share of them that its Gaussians
   cover, the mean over rays of T alpha. Opacity, which the reference takes, says nothing of Gaussians that
   are hidden or tiny: a third of all anchors. */
static void gather_use(trainer *t)
{
    const frame *f = &t->frame;
    const float rays = (float)ray_image_count(&f->rays);
    float *use = t->stats.use_accum;
    for (size_t v = 0; v < f->visible_count; v++) {
        t->stats.visit_count[f->visible[v]] += 1;
        if (t->def.compat)
            use[f->visible[v]] += f->tape.opacity_sum[v];
    }
    for (size_t i = 0; !t->def.compat && i < f->gaussians.count; i++)
        use[f->visible[f->tape.slot[i] / (uint32_t)t->anchors.offset_count]] += f->seen[i] / rays;
}

/* The norm of dL/d(projected mean in NDC), from the ray-traced gradient of the mean in camera axes (g): (z
   tan_x g.x, z tan_y g.y). Counted for every Gaussian whose box may touch the image, hit or not: counting
   hits alone would grow what is mostly hidden. */
void growth_gather(trainer *t)
{
    const frame *f = &t->frame;
    const int k_count = t->anchors.offset_count;
    adjust_stats *s = &t->stats;
    gather_use(t);
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
        if (!(cam_z > t->settings.t_near))
            continue;
        const float cam_x = r[0] * x + r[1] * y + r[2] * z, cam_y = r[3] * x + r[4] * y + r[5] * z;
        const float reach = 3 * fmaxf(g->scale_x[i], fmaxf(g->scale_y[i], g->scale_z[i]));
        if (fabsf(cam_x) > tan_x * cam_z + reach || fabsf(cam_y) > tan_y * cam_z + reach)
            continue;
        const float gx = r[0] * dg->mean_x[i] + r[1] * dg->mean_y[i] + r[2] * dg->mean_z[i];
        const float gy = r[3] * dg->mean_x[i] + r[4] * dg->mean_y[i] + r[5] * dg->mean_z[i];
        const float sx = cam_z * tan_x * gx, sy = cam_z * tan_y * gy;
        const uint32_t slot = f->tape.slot[i];
        const size_t at =
            (size_t)f->visible[slot / (uint32_t)k_count] * (size_t)k_count + slot % (uint32_t)k_count;
        s->grad_accum[at] += fminf(sqrtf(sx * sx + sy * sy), GRADIENT_LIMIT);
        s->grad_count[at] += 1;
    }
}

bool growth_is_due(const trainer *t, double progress, double next)
{
    if (!t->def.grow || progress < SCHEDULE_ADJUST_FROM || progress >= t->def.grow_until)
        return false;
    if (t->def.compat)
        return (t->step + 1) % COMPAT_INTERVAL == 0;
    return floor(progress * ADJUSTS_PER_RUN) != floor(next * ADJUSTS_PER_RUN);
}

/* Rows of `a` in the order of `source`; -1 gives zeros (new anchors have no momentum yet). */
static gbt_status follow_rows(anchors *a, const adjust_result *result, gbt_error *err)
{
    anchors old = *a;
    *a = (anchors){.offset_count = old.offset_count};
    const gbt_status status = anchors_resize(a, result->count, err);
    const size_t offset_floats = 3 * (size_t)old.offset_count;
    for (size_t i = 0; status == GBT_OK && i < result->count; i++) {
        if (result->source[i] < 0)
            continue;
        const size_t from = (size_t)result->source[i];
        memcpy(a->feature + i * ANCHOR_FEATURE_DIM, old.feature + from * ANCHOR_FEATURE_DIM,
               ANCHOR_FEATURE_DIM * sizeof(float));
        memcpy(a->offset + i * offset_floats, old.offset + from * offset_floats,
               offset_floats * sizeof(float));
        memcpy(a->scale_log + i * 6, old.scale_log + from * 6, 6 * sizeof(float));
    }
    anchors_free(&old);
    return status;
}

/* New rows come last, so the order by birth stays. The reference corrects all by the age of the run. */
static gbt_status follow_births(trainer *t, const adjust_result *result, gbt_error *err)
{
    uint64_t *born = mem_alloc(result->count, sizeof *born, "growth", err);
    if (born == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < result->count; i++)
        born[i] = result->source[i] >= 0 ? t->born[result->source[i]] : t->def.compat ? 0 : t->anchor_t;
    mem_free(t->born);
    t->born = born;
    return GBT_OK;
}

typedef struct nearest_job {
    const point_tree *anchors;
    const float *point;
    uint32_t *nearest;
} nearest_job;

static void nearest_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const nearest_job *job = context;
    for (size_t i = begin; i < end; i++) {
        double square;
        job->nearest[i] = 0;
        point_tree_nearest(job->anchors, job->point + 3 * i, 1, SIZE_MAX, &job->nearest[i], &square);
    }
}

/* The sparse points are known surface, and a start from balls has left most of them out: where the nearest
   anchor asks for more, they are places to grow. Gaussians are not enough, for they are where anchors are. In
   the first round they make good what the start lacks, as a start would; after it they are asked for and
   sized as Gaussians are. `nearest` and `scale` are the caller's. */
static gbt_status grow_at_points(const trainer *t, adjust_def *def, uint32_t **nearest, float **scale,
                                 gbt_error *err)
{
    const scene_points *points = &t->scene.points;
    const bool first = t->adjust_step == 0;
    *nearest = mem_alloc(points->count, sizeof **nearest, "growth", err);
    if (first)
        *scale = mem_alloc(points->count, sizeof **scale, "growth", err);
    if (*nearest == NULL || (first && *scale == NULL))
        return GBT_ERR_NO_MEMORY;
    if (first)
        GBT_TRY(anchor_scales_from_spacing(points->position, points->count, TRAIN_SPACING_SCALE,
                                           t->first_scale_max, *scale, err));
    point_tree *tree;
    GBT_TRY(point_tree_build(t->anchors.position, NULL, t->anchors.count, &tree, err));
    nearest_job job = {tree, points->position, *nearest};
    parallel_blocks(points->count, 256, nearest_block, &job);
    point_tree_free(tree);
    def->place = points->position;
    def->place_scale = *scale;
    def->place_anchor = *nearest;
    def->place_count = points->count;
    return GBT_OK;
}

/* One photo cannot tell how far off something is: what only it shows may stand anywhere along its rays, as a
   fog before other cameras. The sparse points need no such leave, for other photos have told where they
   are. */
static bool two_views_see(const void *context, const float position[3])
{
    const trainer *t = context;
    size_t seen = 0;
    for (size_t v = 0; v < t->train_count && seen < VIEWS_MIN; v++) {
        double distance;
        seen += camera_sees(&t->scene.views[t->train_views[v]].camera, position, &distance) &&
                distance > (double)t->settings.t_near;
    }
    return seen == VIEWS_MIN;
}

static adjust_def rules_of(const trainer *t)
{
    adjust_def def = adjust_def_default();
    def.voxel_size = t->voxel_size;
    def.max_anchors = t->def.max_anchors;
    def.compat = t->def.compat;
    def.seed = t->def.seed;
    def.step = t->step;
    if (t->def.compat) {
        def.interval = COMPAT_INTERVAL;
        def.shape_log_max = 0.05f;
        return def;
    }
    const float factor =
        (float)t->def.threshold_factor * schedule_threshold_factor(pace_expected(&t->pace, t->step));
    const bool last = t->def.final_prune_factor > 1 &&
                      pace_progress(&t->pace, t->step) >= last_rounds_from * t->def.grow_until;
    def.interval = fmaxf((float)(t->step + 1 - t->adjust_step), (float)INTERVAL_MIN);
    def.grad_threshold *= factor;
    def.min_use = factor * share_min * (last ? (float)t->def.final_prune_factor : 1);
    def.grow = !last;
    if (t->train_count >= VIEWS_MIN) {
        def.may_stand = two_views_see;
        def.may_stand_context = t;
    }
    return def;
}

gbt_status growth_adjust(trainer *t, gbt_error *err)
{
    adjust_def def = rules_of(t);
    uint32_t *nearest = NULL;
    float *scale = NULL;
    adjust_result result = {0};
    gbt_status status = GBT_OK;
    if (!def.compat && def.grow && pace_progress(&t->pace, t->step) < SCHEDULE_POINTS_UNTIL)
        status = grow_at_points(t, &def, &nearest, &scale, err);
    if (status == GBT_OK)
        status = anchors_adjust(&t->anchors, &t->stats, &def, &result, err);
    anchors *followers[] = {&t->gradient, &t->moment1, &t->moment2};
    for (int i = 0; i < 3 && status == GBT_OK; i++)
        status = follow_rows(followers[i], &result, err);
    if (status == GBT_OK)
        status = follow_births(t, &result, err);
    mem_free(nearest);
    mem_free(scale);
    mem_free(result.source);
    if (result.kept_last)
        log_warn("step %llu: every anchor had become transparent; the most opaque one stays",
                 (unsigned long long)t->step);
    t->adjust_step = t->step + 1;
    return status;
}
