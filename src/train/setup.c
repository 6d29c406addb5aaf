/* SPDX-License-Identifier: Apache-2.0 */
/* train/setup.c -- prepare a run up to its first step: anchors, networks, and the rest of the state. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "anchor/init.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "bvh/points.h"
#include "gbtrace/cluster.h"
#include "train/camera_sees.h"
#include "train/config.h"
#include "train/def.h"
#include "train/horizon.h"
#include "train/near_distance.h"
#include "train/scale_limit.h"
#include "train/setup_data.h"
#include "train/step_pixels.h"
#include "train/trainer.h"

enum { DISTANCE_VIEWS = 4096 };

/* Distances from training cameras (of very many, a sample) to a sample of the anchors in view. They decide
   whether the distance is an input of the networks, its unit, and t_near. */
static gbt_status measure_distances(trainer *t, float *p5, float *median, float *p95, gbt_error *err)
{
    const size_t stride = t->anchors.count / 512 + 1, per_view = (t->anchors.count + stride - 1) / stride;
    const size_t step = (t->train_count + DISTANCE_VIEWS - 1) / DISTANCE_VIEWS,
                 views = (t->train_count + step - 1) / step;
    float *all = mem_alloc(per_view * views + 1, sizeof *all, "distances", err);
    if (all == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t count = 0;
    /* The first sampled anchor in the camera's image; if no camera sees one, the last pass accepts any
       direction. */
    for (size_t pass = 0; pass <= stride && count == 0; pass++)
        for (size_t v = 0; v < t->train_count; v += step) {
            const gbt_camera *camera = &t->scene.views[t->train_views[v]].camera;
            for (size_t i = pass % stride; i < t->anchors.count; i += stride) {
                double distance;
                if (camera_sees(camera, t->anchors.position + 3 * i, &distance) || pass == stride)
                    all[count++] = (float)distance;
            }
        }
    *p5 = *median = *p95 = 1;
    if (count > 0) {
        qsort(all, count, sizeof *all, compare_floats);
        *p5 = all[count / 20];
        *median = all[count / 2];
        *p95 = all[count - 1 - count / 20];
    }
    mem_free(all);
    return GBT_OK;
}

/* The first three features are the colour of the nearest point, so that the networks need not learn it anchor
   by anchor. The others are 0. */
static gbt_status start_features(trainer *t, gbt_error *err)
{
    const scene_points *points = &t->scene.points;
    memset(t->anchors.feature, 0, t->anchors.count * ANCHOR_FEATURE_DIM * sizeof *t->anchors.feature);
    if (!t->rules.features_from_colors || !points->has_color || points->count == 0)
        return GBT_OK;
    uint32_t *nearest = mem_alloc(t->anchors.count, sizeof *nearest, "features", err);
    if (nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = points_find_nearest(points->position, points->count, t->anchors.position,
                                                  t->anchors.count, nearest, NULL, err);
    for (size_t i = 0; i < t->anchors.count && status == GBT_OK; i++)
        for (size_t c = 0; c < 3; c++)
            t->anchors.feature[i * ANCHOR_FEATURE_DIM + c] =
                2 * points->color[3 * (size_t)nearest[i] + c] - 1;
    mem_free(nearest);
    return status;
}

/* The mean colour of the points: the least wrong background for what no photo shows. */
static void mean_color(const scene_points *points, float color[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t i = 0; i < points->count; i++)
        for (size_t c = 0; c < 3; c++)
            sum[c] += (double)points->color[3 * i + c];
    for (int c = 0; c < 3; c++)
        color[c] = (float)(sum[c] / (double)points->count);
}

/* Median distance from a camera to a sample of the points in its image; 0 when there are none. */
static double middle_distance(const gbt_camera *camera, const scene_points *points)
{
    float distances[512];
    size_t count = 0;
    for (size_t i = 0; i < points->count; i += points->count / 512 + 1) {
        double distance;
        if (camera_sees(camera, points->position + 3 * i, &distance))
            distances[count++] = (float)distance;
    }
    qsort(distances, count, sizeof *distances, compare_floats);
    return count > 0 ? (double)distances[count / 2] : 0;
}

static gbt_status make_anchors(trainer *t, gbt_error *err)
{
    anchor_init_def def = anchor_init_def_default();
    def.kind = t->def.init;
    def.seed = t->def.seed;
    def.fraction = t->def.init_count;
    def.scale = t->def.scale_prior;
    def.balls.max_depth = t->def.max_depth;
    def.balls.voxel_size = t->voxel_size;
    def.balls.min_radius = t->rules.ball_radius_min;
    def.offset_count = t->def.offsets;
    def.scale_factor = (float)t->def.scale_factor;
    /* The spread of cameras that are close together says nothing about the size of the scene, and for cameras
       in the middle of the scene neither does their distance from the middle of the points. */
    const scene_points *points = &t->scene.points;
    const gbt_camera *camera = &t->scene.views[t->train_views[0]].camera;
    const double away = fmax(dvec_length(camera->center), middle_distance(camera, points));
    t->first_scale_max = t->rules.limits_first_scale ? 0.1 * fmax(t->extent, 0.1 * away) : (double)INFINITY;
    def.scale_max = (float)t->first_scale_max;
    GBT_TRY(anchors_init(points->position, points->has_color ? points->color : NULL, points->count, &def,
                         &t->anchors, NULL, err));
    t->anchors_initial = t->anchors.count;
    if (t->anchors.count > t->def.max_anchors)
        log_warn(
            "max_anchors: the sparse points alone make %zu anchors, so none is added in training (the limit "
            "is %llu)",
            t->anchors.count, (unsigned long long)t->def.max_anchors);
    return start_features(t, err);
}

static gbt_status make_state(trainer *t, gbt_error *err)
{
    learnables *const kept[] = {&t->gradient, &t->moment1, &t->moment2};
    for (int i = 0; i < 3; i++)
        GBT_TRY(learnables_make(kept[i], t->anchors.count, &t->decoder, err));
    t->created = mem_calloc(t->anchors.count, sizeof *t->created, "anchors", err);
    if (t->created == NULL)
        return GBT_ERR_NO_MEMORY;
    if (t->def.exposure)
        GBT_TRY(exposures_make(&t->exposures, t->train_count, err));
    if (t->def.refine_poses)
        GBT_TRY(poses_make(&t->poses, &t->scene, t->train_count, t->distance, err));
    GBT_TRY(scale_limit_update(t, err));
    return growth_stats_resize(&t->stats, t->anchors.count, t->def.offsets, err);
}

static gbt_status make_views(trainer *t, gbt_error *err)
{
    for (size_t i = 0; i < t->train_count; i++) {
        const gbt_camera camera = photos_camera(&t->photos, t->train_views[i], 0);
        t->pixel_share += step_pixel_share(&camera, &t->rules) / (double)t->train_count;
    }
    t->view_count = (size_t)t->def.views / (size_t)gbt_cluster_size();
    t->first_view = t->view_count * (size_t)gbt_cluster_rank();
    t->views = mem_calloc(t->view_count, sizeof *t->views, "views", err);
    if (t->views == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < t->view_count; i++) {
        t->views[i].frame.draw = train_drawing_of(&t->def);
        t->views[i].frame.draw.makes_faint = t->rules.makes_faint;
    }
    return GBT_OK;
}

static gbt_status start_networks(const trainer *t, bool has_distance, decoder *out, gbt_error *err)
{
    uint32_t words[4];
    rng_philox(t->def.seed, RNG_STREAM_NETWORKS, 0, words);
    return decoder_init(out, t->def.offsets, has_distance, (uint64_t)words[1] << 32 | words[0], err);
}

/* Random network weights, and the values that follow from the anchors' distances: the unit of the distance
   input, t_near, and the range of scales. */
static gbt_status make_decoder(trainer *t, gbt_error *err)
{
    const gbt_train_def *def = &t->def;
    float p5, median, p95;
    GBT_TRY(measure_distances(t, &p5, &median, &p95, err));
    /* The reference has the distance input off by default; it matters when distances vary widely. */
    const bool wide = p95 > 3 * p5;
    const bool has_distance =
        def->distance == GBT_DISTANCE_INPUT_ON ||
        (def->distance == GBT_DISTANCE_INPUT_AUTO && wide && t->rules.distance_where_wide);
    GBT_TRY(start_networks(t, has_distance, &t->decoder, err));
    t->distance = (double)median;
    t->decoder.distance_scale = t->rules.distance_by_median ? 1 / median : 1.0f;
    t->decoder.distance_min = p5 * t->decoder.distance_scale;
    t->decoder.distance_max = p95 * t->decoder.distance_scale;
    t->settings = trace_settings_default();
    if (t->rules.near_depth == 0) {
        GBT_TRY(
            near_of_scene(&t->scene, t->train_views, t->train_count, def->near, &t->settings.t_near, err));
        t->settings.t_near = fmaxf(t->settings.t_near, 0.02f * median);
    } else {
        t->settings.t_near = t->rules.near_depth;
    }
    if (!(p5 > t->settings.t_near))
        log_warn("%s: nothing nearer to a camera than %g is drawn, and some of the scene is at %g",
                 t->scene.folder, (double)t->settings.t_near, (double)p5);
    const double size = fmax(t->extent, (double)median);
    t->scale_log_min = (float)log(1e-6 * size);
    t->scale_log_limit = (float)log(100 * size);
    return GBT_OK;
}

static void choose_background(trainer *t)
{
    const bool given = scene_background(&t->scene, t->settings.background),
               wants_sky = t->def.background == GBT_BACKGROUND_SKY;
    if (!given && t->rules.background_from_points) {
        if (t->scene.points.has_color)
            mean_color(&t->scene.points, t->settings.background);
        t->settings.sky.varies = wants_sky;
    }
    sky *s = &t->settings.sky;
    if (s->varies) {
        s->has_horizon = horizon_find(&t->scene, t->train_views, t->train_count, s->up);
        memcpy(s->ground, t->settings.background, sizeof s->ground);
    }
    if (s->varies && !s->has_horizon) /* all around there is what the photos show */
        t->rules.opaque_from = HUGE_VAL;
    else if (wants_sky && !s->varies)
        log_warn("%s: no sky is learned: %s", t->scene.folder,
                 given ? "photos with an alpha channel are composited on one colour"
                       : "compat uses one colour");
}

/* Set the length of the run; with a budget it is decided during the run. A resumed run already has its
   length. */
static gbt_status take_length(trainer *t, gbt_error *err)
{
    gbt_train_def *def = &t->def;
    if (def->pace == NULL) {
        if (def->iterations > 0)
            t->pace = pace_of_iterations(def->iterations);
        return GBT_OK;
    }
    GBT_TRY(pace_parse(def->pace, &t->pace, err));
    if (pace_total(&t->pace) == 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "pace: adds up to no step (wanted at least one)");
    if (!def->resume && def->iterations > 0 && def->iterations != pace_total(&t->pace))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "iterations: %llu, but `pace` adds up to %llu (wanted only one of the two)",
                         (unsigned long long)def->iterations, (unsigned long long)pace_total(&t->pace));
    pace_text(&t->pace, t->pace_words);
    def->pace = t->pace_words;
    return GBT_OK;
}

gbt_status trainer_open(trainer *t, const char *data, const gbt_train_def *def, gbt_error *err)
{
    GBT_TRY(train_def_check(def, err));
    t->def = *def;
    train_def_warn_unused(def);
    train_def_settle(&t->def);
    GBT_TRY(take_length(t, err));
    GBT_TRY(config_check(&t->def, data, err));
    t->rules = train_rules_of(&t->def);
    if (t->def.views % gbt_cluster_size() != 0)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "views: %d per step cannot be shared by %d processes (wanted a number that divides it)",
            t->def.views, gbt_cluster_size());
    GBT_TRY(setup_data(t, data, err));
    GBT_TRY(make_anchors(t, err));
    GBT_TRY(make_decoder(t, err));
    GBT_TRY(make_views(t, err));
    GBT_TRY(make_state(t, err));
    choose_background(t);
    return GBT_OK;
}

gbt_status trainer_begin_again(trainer *t, gbt_error *err)
{
    decoder first = {0};
    GBT_TRY(start_networks(t, t->decoder.has_distance, &first, err));
    memcpy(t->decoder.params, first.params, first.param_count * sizeof *first.params);
    decoder_free(&first);
    learnables_zero(&t->moment1, t->decoder.param_count);
    learnables_zero(&t->moment2, t->decoder.param_count);
    memset(t->created, 0, t->anchors.count * sizeof *t->created);
    t->anchor_t = 0;
    return start_features(t, err);
}
