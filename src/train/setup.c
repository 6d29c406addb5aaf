/* SPDX-License-Identifier: Apache-2.0 */
/* train/setup.c -- from a data set to a trainer that can take its first step. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "bvh/points.h"
#include "data/photo_check.h"
#include "gbtrace/cluster.h"
#include "train/def.h"
#include "train/light.h"
#include "train/seed_points.h"
#include "train/camera_sees.h"
#include "train/checkpoint.h"
#include "train/memory_need.h"
#include "train/near.h"
#include "train/trainer.h"

enum { STREAM_NETWORKS = 2, FEW_PLACES = 128 };

/* Points that no training photo sees say nothing about what to render. */
static bool any_point_is_seen(const trainer *t)
{
    for (size_t i = 0; i < t->scene.points.count; i++)
        for (size_t v = 0; v < t->train_count; v++)
            if (camera_sees(&t->scene.views[t->train_views[v]].camera, t->scene.points.position + 3 * i,
                            NULL))
                return true;
    return false;
}

static int compare_points(const void *a, const void *b) { return memcmp(a, b, 3 * sizeof(float)); }

/* How many points there are at different places; `most` is enough. */
static gbt_status count_places(const scene_points *points, size_t most, size_t *out, gbt_error *err)
{
    float *sorted = mem_alloc(points->count, 3 * sizeof *sorted, "points", err);
    if (sorted == NULL)
        return GBT_ERR_NO_MEMORY;
    memcpy(sorted, points->position, points->count * 3 * sizeof *sorted);
    qsort(sorted, points->count, 3 * sizeof *sorted, compare_points);
    *out = points->count > 0;
    for (size_t i = 1; i < points->count && *out < most; i++)
        *out += compare_points(sorted + 3 * i, sorted + 3 * (i - 1)) != 0;
    mem_free(sorted);
    return GBT_OK;
}

/* `more` after the points that are there; both have colours then. */
static gbt_status append_points(scene_points *points, const scene_points *more, gbt_error *err)
{
    const size_t before = points->count, after = before + more->count;
    size_t rows[2] = {before, before};
    GBT_TRY(
        mem_reserve((void **)&points->position, &rows[0], before, after, 3 * sizeof(float), "points", err));
    GBT_TRY(mem_reserve((void **)&points->color, &rows[1], before, after, 3 * sizeof(float), "points", err));
    memcpy(points->position + 3 * before, more->position, 3 * more->count * sizeof(float));
    memcpy(points->color + 3 * before, more->color, 3 * more->count * sizeof(float));
    points->count = after;
    points->has_color = true;
    return GBT_OK;
}

/* Points of our own where the data set has none, none that a photo sees, or few; the reference method takes
   what there is. */
static gbt_status provide_points(trainer *t, gbt_error *err)
{
    scene_points *points = &t->scene.points, made = {0};
    size_t places = 0;
    if (any_point_is_seen(t))
        GBT_TRY(count_places(points, FEW_PLACES, &places, err));
    const bool blind = places == 0, few = places < FEW_PLACES && t->rules.adds_to_few_points;
    t->points_used = points->count;
    snprintf(t->start_text, sizeof t->start_text, "%zu sparse points", points->count);
    if (!blind && !few)
        return GBT_OK;
    if (blind && points->count > 0)
        log_warn("%s: no training photo sees any of the %zu sparse points", t->scene.folder, points->count);
    if (blind) {
        points->count = 0;
        for (size_t i = 0; i < t->scene.view_count; i++)
            t->scene.views[i].seen_count = 0;
    }
    gbt_error why = {0};
    gbt_status status =
        seed_points_make(&t->photos, t->train_views, t->train_count, t->def.seed, &made, &why);
    if (status == GBT_OK)
        status = append_points(points, &made, err);
    else if (blind || status == GBT_ERR_NO_MEMORY)
        status = base_fail(err, status, "%s", why.text);
    else
        status = GBT_OK; /* the few must do */
    snprintf(t->start_text, sizeof t->start_text, "%zu sparse points and %zu found by photo consistency",
             t->points_used, made.count);
    if (blind)
        snprintf(t->start_text, sizeof t->start_text,
                 "%zu points found by photo consistency (the data set has none that are seen)", made.count);
    t->points_made = blind;
    t->points_used = points->count;
    mem_free(made.position);
    mem_free(made.color);
    return status;
}

/* Distances from training cameras to a sample of the anchors: they decide whether the networks see the
   distance, its unit, and t_near. */
static gbt_status measure_distances(trainer *t, float *p5, float *median, float *p95, gbt_error *err)
{
    const size_t stride = t->anchors.count / 512 + 1, per_view = (t->anchors.count + stride - 1) / stride;
    float *all = mem_alloc(per_view * t->train_count + 1, sizeof *all, "distances", err);
    if (all == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t count = 0;
    for (size_t v = 0; v < t->train_count; v++) {
        const gbt_camera *camera = &t->scene.views[t->train_views[v]].camera;
        for (size_t i = 0; i < t->anchors.count; i += stride) {
            double distance;
            if (camera_sees(camera, t->anchors.position + 3 * i, &distance))
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

/* The first features carry the colour of the nearest point: the networks need not discover it anchor by
   anchor. The rest is 0. */
static gbt_status start_features(trainer *t, gbt_error *err)
{
    const scene_points *points = &t->scene.points;
    uint32_t *nearest = mem_alloc(t->anchors.count, sizeof *nearest, "features", err);
    if (nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = points_find_nearest(points->position, points->count, t->anchors.position,
                                                  t->anchors.count, nearest, NULL, err);
    for (size_t i = 0; i < t->anchors.count && status == GBT_OK && points->count > 0; i++)
        for (size_t c = 0; c < 3; c++)
            t->anchors.feature[i * ANCHOR_FEATURE_DIM + c] =
                2 * points->color[3 * (size_t)nearest[i] + c] - 1;
    mem_free(nearest);
    return status;
}

/* What lies behind everything and was never photographed looks least wrong in the scene's mean colour. */
static void mean_color(const scene_points *points, float color[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t i = 0; i < points->count; i++)
        for (size_t c = 0; c < 3; c++)
            sum[c] += (double)points->color[3 * i + c];
    for (int c = 0; c < 3; c++)
        color[c] = (float)(sum[c] / (double)points->count);
}

static gbt_status make_anchors(trainer *t, gbt_error *err)
{
    anchor_init_def def = anchor_init_def_default();
    def.kind = t->def.init;
    def.fraction = t->def.init_count;
    def.scale = t->def.scale_prior;
    def.balls.max_depth = t->def.max_depth;
    def.balls.voxel_size = t->voxel_size;
    def.offset_count = t->def.offsets;
    def.scale_factor = (float)t->def.scale_factor;
    /* Cameras that stand together say nothing of the size of what they see. */
    const double away =
        dvec_length(t->scene.views[t->train_views[0]].camera.center); /* from the middle of the points */
    t->first_scale_max = t->rules.limits_first_scale ? 0.1 * fmax(t->extent, 0.1 * away) : (double)INFINITY;
    def.scale_max = (float)t->first_scale_max;
    const scene_points *points = &t->scene.points;
    GBT_TRY(anchors_init(points->position, points->has_color ? points->color : NULL, points->count, &def,
                         &t->anchors, NULL, err));
    t->anchors_initial = t->anchors.count;
    return t->rules.features_from_colors && points->has_color ? start_features(t, err) : GBT_OK;
}

static gbt_status choose_views(trainer *t, gbt_error *err)
{
    t->train_views = mem_alloc(t->scene.view_count + 1, sizeof *t->train_views, "training views", err);
    t->order = mem_alloc(t->scene.view_count + 1, sizeof *t->order, "view order", err);
    if (t->train_views == NULL || t->order == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < t->scene.view_count; i++) {
        if (t->scene.views[i].is_test)
            t->test_count++;
        else
            t->train_views[t->train_count++] = i;
    }
    if (t->train_count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no photo is left to train on (%zu views, %zu held out)",
                         t->scene.folder, t->scene.view_count, t->test_count);
    return GBT_OK;
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
    return growth_stats_resize(&t->stats, t->anchors.count, t->def.offsets, err);
}

static gbt_status make_views(trainer *t, gbt_error *err)
{
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

/* What photos are divided by, where that was left open. */
static void choose_downscale(trainer *t)
{
    if (t->def.downscale > 0)
        return;
    t->def.downscale = t->rules.limits_width ? photos_usual_downscale(&t->scene) : 1;
    if (t->def.downscale > 1)
        log_info("%s: photos are trained on %.0f pixels wide, divided by %.4g (downscale 1: as they are)",
                 t->scene.folder, t->scene.views[t->train_views[0]].camera.width / t->def.downscale,
                 t->def.downscale);
}

/* Before any work: a limit that cannot be kept. */
static gbt_status check_memory(const trainer *t, gbt_error *err)
{
    const memory_need need = memory_need_of(&t->scene, t->def.downscale);
    if (t->def.memory == 0 || (double)t->def.memory >= need.least)
        return GBT_OK;
    return base_fail(
        err, GBT_ERR_NO_MEMORY,
        "memory: %zu MB is too little: %zu points and photos of %d x %d take about %.0f, or %.0f "
        "without a limit",
        t->def.memory >> 20, t->scene.points.count, t->scene.views[0].camera.width,
        t->scene.views[0].camera.height, need.least / 0x1p20, need.whole / 0x1p20);
}

/* Photos that differ in exposure contradict each other wherever they overlap. */
static gbt_status choose_exposure(trainer *t, gbt_error *err)
{
    light_differences differences;
    if (t->def.exposure || !t->def.find_exposure || !t->rules.finds_exposure)
        return GBT_OK;
    GBT_TRY(light_differ(&t->photos, t->train_views, t->train_count, &differences, err));
    t->def.exposure = differences.many;
    if (t->def.exposure)
        log_info(
            "%s: the photos' exposures differ by about %.2g stops: a colour matrix is learned for each, as "
            "with exposure (turned off by find_exposure)",
            t->scene.folder, differences.stops);
    return GBT_OK;
}

static gbt_status load_data(trainer *t, const char *data, gbt_error *err)
{
    const gbt_train_def *def = &t->def;
    scene_split split;
    GBT_TRY(scene_split_parse(def->eval_split, &split, err));
    GBT_TRY((t->rules.recentres ? scene_load : scene_load_in_place)(data, &split, &t->scene, err));
    scene_set_alpha(&t->scene, def->alpha);
    if (t->scene.view_count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no photos to train on (a point cloud alone is not enough)",
                         data);
    GBT_TRY(choose_views(t, err));
    photo_check check;
    photo_check_all(&t->scene, &check);
    photo_check_warn(&check, data);
    choose_downscale(t);
    GBT_TRY(check_memory(t, err));
    GBT_TRY(photos_open(&t->photos, &t->scene, def->downscale, err));
    if (def->memory > 0 && t->photos.bytes_max > def->memory / 4)
        t->photos.bytes_max = def->memory / 4;
    GBT_TRY(photos_load(&t->photos, t->train_views, t->train_count, err));
    GBT_TRY(checkpoint_hash_photos(&t->scene, &t->photos_hash, err));
    t->extent = scene_camera_extent(&t->scene);
    GBT_TRY(provide_points(t, err));
    GBT_TRY(choose_exposure(t, err));
    t->voxel_size = def->voxel_size;
    if (t->voxel_size > 0)
        return GBT_OK;
    return balls_voxel_size(t->scene.points.position, t->scene.points.count, t->rules.voxel, &t->voxel_size,
                            err);
}

/* Networks with random weights, and what the anchors' distances say: their unit, t_near, the range of
   scales. */
static gbt_status make_decoder(trainer *t, gbt_error *err)
{
    const gbt_train_def *def = &t->def;
    float p5, median, p95;
    GBT_TRY(measure_distances(t, &p5, &median, &p95, err));
    /* Off by default in the reference, and a trap where distances vary widely. */
    const bool wide = p95 > 3 * p5;
    const bool has_distance =
        def->distance == GBT_DISTANCE_INPUT_ON ||
        (def->distance == GBT_DISTANCE_INPUT_AUTO && wide && t->rules.distance_where_wide);
    uint32_t words[4];
    rng_philox(def->seed, STREAM_NETWORKS, 0, words);
    GBT_TRY(decoder_init(&t->decoder, def->offsets, has_distance, (uint64_t)words[1] << 32 | words[0], err));
    t->distance = (double)median;
    t->decoder.distance_scale = t->rules.distance_by_median ? 1 / median : 1.0f;
    t->decoder.distance_min = p5 * t->decoder.distance_scale;
    t->decoder.distance_max = p95 * t->decoder.distance_scale;
    t->settings = trace_settings_default();
    if (t->rules.uses_near) {
        GBT_TRY(scene_near(&t->scene, t->train_views, t->train_count, def->near, &t->settings.t_near, err));
        t->settings.t_near = fmaxf(t->settings.t_near, 0.02f * median);
    } else {
        t->settings.t_near = t->rules.near_depth;
    }
    if (!(p5 > t->settings.t_near))
        log_warn("%s: nothing nearer to a camera than %g is drawn, and some of the scene is at %g",
                 t->scene.folder, (double)t->settings.t_near, (double)p5);
    const double size = fmax(t->extent, (double)median);
    t->scale_log_min = (float)log(1e-6 * size);
    t->scale_log_max = (float)log(100 * size);
    return GBT_OK;
}

gbt_status trainer_open(trainer *t, const char *data, const gbt_train_def *def, gbt_error *err)
{
    GBT_TRY(train_def_check(def, err));
    t->def = *def;
    train_def_settle(&t->def);
    t->rules = train_rules_of(&t->def);
    if (t->def.views % gbt_cluster_size() != 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "views: %d a step, for %d processes (wanted a number of processes that divides it)",
                         t->def.views, gbt_cluster_size());
    GBT_TRY(load_data(t, data, err));
    GBT_TRY(make_anchors(t, err));
    GBT_TRY(make_decoder(t, err));
    t->renderer = t->def.renderer;
    GBT_TRY(make_views(t, err));
    GBT_TRY(make_state(t, err));
    if (!scene_background(&t->scene, t->settings.background) && t->rules.background_from_points) {
        if (t->scene.points.has_color)
            mean_color(&t->scene.points, t->settings.background);
        t->settings.sky.varies = t->def.background == GBT_BACKGROUND_SKY;
    }

    if (def->pace != NULL)
        GBT_TRY(pace_parse(def->pace, &t->pace, err));
    else if (def->iterations > 0)
        t->pace = pace_of_iterations(def->iterations);
    return GBT_OK;
}
