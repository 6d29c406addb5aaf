/* SPDX-License-Identifier: Apache-2.0 */
/* train/growing.c -- the growth rounds of a run: their times, thresholds and sparse-point candidates, and the
   arrays that must follow when rows of anchors are added or removed. */
#include "train/growing.h"

#include <math.h>

#include "anchor/init.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "bvh/points.h"
#include "train/camera_sees.h"
#include "train/def.h"
#include "train/near_distance.h"
#include "train/scale_limit.h"

static const float share_min = 2.5e-6f;     /* pruning threshold of short runs; scaled by
                                               schedule_threshold_factor() */
static const double last_rounds_from = 0.9; /* as a fraction of the growing period */
#define PROGRESS_ROUNDING 1e-10             /* far below the progress of a step */
enum {
    ROUNDS_PER_RUN = 100,
    ROUND_INTERVAL = 100 /* steps, when rounds do not follow progress */,
    INTERVAL_MIN = 20 /* views: fewer give a statistically unreliable decision */,
    INTERVAL_MAX = 100 /* views: more add no information */
};
enum { VIEWS_MIN = 2 };

/* Is `step` between `from`, counted from where the model begins, and the end of growth? */
static bool is_within(const trainer *t, uint64_t step, double from)
{
    const double progress = train_rules_progress(&t->rules, &t->pace, step);
    from += t->rules.begins_at;
    if (!t->def.grow)
        return false;
    if (!t->rules.counts_from_one)
        return progress >= from && progress < t->def.grow_until;
    return progress > from + PROGRESS_ROUNDING && progress < t->def.grow_until - PROGRESS_ROUNDING;
}

bool growing_gathers(const trainer *t) { return is_within(t, t->step, SCHEDULE_STATS_FROM); }

bool growing_is_due(const trainer *t)
{
    if (!is_within(t, t->step, SCHEDULE_ADJUST_FROM))
        return false;
    if (!t->rules.rounds_by_progress)
        return (t->step + 1) % ROUND_INTERVAL == 0;
    const double progress = pace_progress(&t->pace, t->step), next = pace_progress(&t->pace, t->step + 1);
    return floor(progress * ROUNDS_PER_RUN) != floor(next * ROUNDS_PER_RUN);
}

float growing_interval(const trainer *t)
{
    if (!t->rules.rounds_by_progress)
        return (float)t->def.views * ROUND_INTERVAL;
    uint64_t steps = 0;
    for (uint64_t step = t->round_step; step <= t->step; step++)
        steps += is_within(t, step, SCHEDULE_STATS_FROM);
    return fminf(fmaxf((float)t->def.views * (float)steps, (float)INTERVAL_MIN), (float)INTERVAL_MAX);
}

/* New rows come last, so the order of creation stays. */
static gbt_status follow_creation(trainer *t, const growth_result *result, gbt_error *err)
{
    uint64_t *created = mem_alloc(result->count, sizeof *created, "growth", err);
    if (created == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < result->survivors; i++)
        created[i] = t->created[result->source[i]];
    for (size_t i = result->survivors; i < result->count; i++)
        created[i] = t->rules.own_adam_age ? t->anchor_t : 0;
    mem_free(t->created);
    t->created = created;
    return GBT_OK;
}

/* Output of find_points(); owned. */
typedef struct known_points {
    uint32_t *nearest; /* [points]: anchor */
    float *scale;      /* [points] in the first round */
} known_points;

/* Sparse points lie on known surface, and a start from balls leaves most of them out. So a point is a growth
   candidate where the gradient of its nearest anchor is large; Gaussians alone are not enough as candidates,
   because they only exist near anchors. In the first round points add what the start left out, with the
   scales of a start; later their threshold and size are those of Gaussian candidates. */
static gbt_status find_points(const trainer *t, known_points *known, growth_points *out, gbt_error *err)
{
    const scene_points *points = &t->scene.points;
    const bool first = t->round_step == 0;
    known->nearest = mem_alloc(points->count, sizeof *known->nearest, "growth", err);
    if (known->nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    if (first) {
        known->scale = mem_alloc(points->count, sizeof *known->scale, "growth", err);
        if (known->scale == NULL)
            return GBT_ERR_NO_MEMORY;
        GBT_TRY(anchor_scales_from_spacing(points->position, points->count,
                                           ANCHOR_SPACING_LEAST(t->voxel_size), TRAIN_SPACING_SCALE,
                                           t->first_scale_max, known->scale, err));
    }
    if (t->anchors.count == 0)
        return GBT_OK; /* no anchor whose gradient could ask for more */
    GBT_TRY(points_find_nearest(t->anchors.position, t->anchors.count, points->position, points->count,
                                known->nearest, NULL, err));
    *out = (growth_points){.count = points->count,
                           .position = points->position,
                           .anchor = known->nearest,
                           .as_start = first,
                           .scale = known->scale};
    return GBT_OK;
}

/* A single photo does not determine depth: an anchor that only one photo sees may be anywhere along its rays,
   and be a floater in front of other cameras. */
static bool two_views_see(const void *context, const float position[3])
{
    const trainer *t = context;
    size_t seen = 0;
    for (size_t v = 0; v < t->train_count && seen < VIEWS_MIN; v++) {
        double distance;
        const scene_view *view = &t->scene.views[t->train_views[v]];
        seen += camera_sees(&view->camera, position, &distance) &&
                distance > (double)near_of_view(t->settings.t_near, &t->def, view);
    }
    return seen == VIEWS_MIN;
}

static growth_def def_of(const trainer *t)
{
    growth_def def = growth_def_default();
    def.voxel_size = t->voxel_size;
    def.max_anchors = t->def.max_anchors;
    def.integer_division = t->rules.integer_division;
    def.coarse_level_gates = t->rules.coarse_level_gates;
    def.at_cell_center = t->rules.at_cell_center;
    def.shape_log_max = t->rules.shape_log_max;
    def.seed = t->def.seed;
    def.step = t->step;
    if (t->rules.needs_two_views && t->train_count >= VIEWS_MIN) {
        def.may_stand = two_views_see;
        def.may_stand_context = t;
    }
    def.interval = growing_interval(t);
    if (!t->rules.thresholds_by_length)
        return def;
    /* When anchors are left out, the others have larger gradients and larger shares of the image. */
    const float shown = 1 - t->left_out,
                factor = (float)t->def.threshold_factor / (shown * shown) *
                         schedule_threshold_factor(t->def.views * pace_expected(&t->pace, t->step));
    const bool last = t->def.final_prune_factor > 1 &&
                      pace_progress(&t->pace, t->step) >= last_rounds_from * t->def.grow_until;
    def.grad_threshold *= factor;
    def.importance_min = factor * share_min * (last ? (float)t->def.final_prune_factor : 1);
    def.grow = !last;
    return def;
}

enum { FOLLOWERS = 3 };

typedef struct follow_job {
    const growth_result *result;
    learnables *of[FOLLOWERS];
    gbt_status status[FOLLOWERS];
    gbt_error error[FOLLOWERS];
} follow_job;

static void follow_one(size_t block, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    follow_job *job = context;
    job->status[block] = learnables_follow(job->of[block], job->result, &job->error[block]);
}

/* All per-anchor arrays besides the anchors themselves. */
static gbt_status follow_all(trainer *t, const growth_result *result, gbt_error *err)
{
    follow_job job = {.result = result, .of = {&t->gradient, &t->moment1, &t->moment2}};
    parallel_blocks(FOLLOWERS, 1, follow_one, &job);
    for (int i = 0; i < FOLLOWERS; i++)
        if (job.status[i] != GBT_OK) {
            if (err != NULL)
                *err = job.error[i];
            return job.status[i];
        }
    return follow_creation(t, result, err);
}

gbt_status growing_round(trainer *t, gbt_error *err)
{
    growth_def def = def_of(t);
    known_points known = {0};
    growth_result result = {0};
    gbt_status status = GBT_OK;
    if (t->rules.grows_at_points && def.grow &&
        pace_progress(&t->pace, t->step) < t->rules.begins_at + SCHEDULE_POINTS_UNTIL)
        status = find_points(t, &known, &def.points, err);
    if (status == GBT_OK)
        status = growth_round(&t->anchors, &t->stats, &def, &result, err);
    if (status == GBT_OK)
        status = follow_all(t, &result, err);
    if (status == GBT_OK)
        status = scale_limit_update(t, err);
    mem_free(known.nearest);
    mem_free(known.scale);
    mem_free(result.source);
    if (result.kept_last)
        log_warn("step %llu: every anchor would be pruned; the most important one stays",
                 (unsigned long long)t->step);
    t->round_step = t->step + 1;
    return status;
}
