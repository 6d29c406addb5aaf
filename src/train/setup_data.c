/* SPDX-License-Identifier: Apache-2.0 */
/* train/setup_data.c -- load the photos and points of a run from a data set folder. */
#include "train/setup_data.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/photo_check.h"
#include "gb/balls.h"
#include "train/checkpoint.h"
#include "train/exposure_spread.h"
#include "train/memory_need.h"
#include "train/seed_points.h"
#include "train/seen_points.h"

/* ---- points ---- */

static int compare_points(const void *a, const void *b) { return memcmp(a, b, 3 * sizeof(float)); }

/* Count the distinct positions of the points, up to `most`. */
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

/* Append the points `more`; the result has colours. */
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

/* Make points by photo consistency when the data set has none, few, or none that half of the photos see. The
   reference method accepts few points as they are. */
static gbt_status provide_points(trainer *t, gbt_error *err)
{
    scene_points *points = &t->scene.points, made = {0};
    size_t places = 0;
    const bool blind = !seen_points_match_cameras(&t->scene);
    if (!blind)
        GBT_TRY(count_places(points, SEED_FEW_PLACES, &places, err));
    const bool few = places < SEED_FEW_PLACES && t->rules.adds_to_few_points;
    t->points_used = points->count;
    snprintf(t->start_text, sizeof t->start_text, "%zu sparse points", points->count);
    if (!blind && !few)
        return GBT_OK;
    if (blind && points->count > 0)
        log_warn("%s: most training photos see no sparse point, so none is used: are points and poses in the "
                 "same coordinate system?",
                 t->scene.folder);
    if (blind)
        GBT_TRY(scene_forget_points(&t->scene, t->rules.recentres, err));
    gbt_error why = {0};
    gbt_status status =
        seed_points_make(&t->photos, t->train_views, t->train_count, t->def.seed, &made, &why);
    if (status == GBT_OK)
        status = append_points(points, &made, err);
    else if (blind || status == GBT_ERR_NO_MEMORY)
        status = base_fail(err, status, "%s", why.text);
    else
        status = GBT_OK; /* fall back to the few points of the data set */
    snprintf(t->start_text, sizeof t->start_text, "%zu sparse points and %zu found by photo consistency",
             t->points_used, made.count);
    if (blind)
        snprintf(t->start_text, sizeof t->start_text,
                 "%zu points found by photo consistency (the data set has none that half of the photos see)",
                 made.count);
    t->points_used = points->count;
    mem_free(made.position);
    mem_free(made.color);
    return status;
}

/* ---- photos ---- */

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

/* Choose the downscale factor when it was not given. */
static gbt_status choose_downscale(trainer *t, gbt_error *err)
{
    if (t->def.downscale > 0)
        return GBT_OK;
    GBT_TRY(photos_usual_downscale(&t->scene, t->rules.limits_width, &t->def.downscale, err));
    if (t->def.downscale > 1)
        log_info(
            "%s: photos are reduced to %.0f pixels in width, the %d of their cameras divided by %.4g (set "
            "downscale to change this)",
            t->scene.folder, t->scene.views[t->train_views[0]].camera.width / t->def.downscale,
            t->scene.views[t->train_views[0]].camera.width, t->def.downscale);
    return GBT_OK;
}

/* Refuse, before any work, a memory limit that cannot be kept. */
static gbt_status check_memory(const trainer *t, gbt_error *err)
{
    const memory_need need = memory_need_of(&t->scene, t->def.downscale, &t->rules);
    if (t->def.memory == 0 || (double)t->def.memory >= need.least)
        return GBT_OK;
    return base_fail(
        err, GBT_ERR_NO_MEMORY,
        "memory: %zu MiB is too little: %zu points and photos of %d x %d need about %.0f MiB, or "
        "%.0f MiB without a limit",
        t->def.memory >> 20, t->scene.points.count, t->scene.views[0].camera.width,
        t->scene.views[0].camera.height, ceil(need.least / 0x1p20), ceil(need.whole / 0x1p20));
}

/* Refuse photos without any valid pixel: nothing would be learned, and the loss would not show it. */
static gbt_status need_valid_pixels(trainer *t, gbt_error *err)
{
    bool any;
    GBT_TRY(photos_any_valid(&t->photos, t->train_views, t->train_count, &any, err));
    if (any)
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: masks or alpha channels leave no pixel of any photo to train on (wanted masks "
                     "that are white where a photo counts)",
                     t->scene.folder);
}

/* Held-out photos are only read after the last step, to score them; unreadable ones are reported now.
   Truncated files and wrong shapes were already found in the headers. Damaged pixels are searched in at most
   as many photos as are trained on, so that this takes no longer than reading those. */
static gbt_status try_held_out(trainer *t, gbt_error *err)
{
    const size_t most = t->test_count < t->train_count ? t->test_count : t->train_count;
    size_t *views = mem_alloc(most + 1, sizeof *views, "held-out views", err), count = 0;
    if (views == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < t->scene.view_count && count < most; i++)
        if (t->scene.views[i].is_test)
            views[count++] = i;
    const gbt_status status = photos_try(&t->photos, views, count, err);
    mem_free(views);
    return status;
}

/* Photos that differ in exposure contradict each other wherever they overlap. */
static gbt_status choose_exposure(trainer *t, gbt_error *err)
{
    exposure_spread spread;
    if (t->def.exposure || !t->def.find_exposure || !t->rules.finds_exposure)
        return GBT_OK;
    GBT_TRY(exposure_spread_find(&t->photos, t->train_views, t->train_count, &spread, err));
    t->def.exposure = spread.large;
    if (t->def.exposure)
        log_info(
            "%s: the photos' exposures differ by about %.2g stops: a colour matrix is learned for each, as "
            "with exposure (turned off by find_exposure)",
            t->scene.folder, spread.stops);
    return GBT_OK;
}

gbt_status setup_data(trainer *t, const char *data, gbt_error *err)
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
    if (check.refused.status != GBT_OK)
        return base_fail(err, check.refused.status, "%s", check.refused.text);
    photo_check_warn(&check, data);
    GBT_TRY(choose_downscale(t, err));
    GBT_TRY(check_memory(t, err));
    GBT_TRY(photos_open(&t->photos, &t->scene, def->downscale, err));
    t->photos.decoded_max = def->memory / 4;
    if (def->memory > 0 && t->photos.bytes_max > def->memory / 4)
        t->photos.bytes_max = def->memory / 4;
    GBT_TRY(photos_load(&t->photos, t->train_views, t->train_count, err));
    GBT_TRY(need_valid_pixels(t, err));
    GBT_TRY(try_held_out(t, err));
    GBT_TRY(checkpoint_hash_photos(&t->scene, &t->photos_hash, &t->masks_hash, err));
    t->extent = scene_camera_extent(&t->scene);
    GBT_TRY(provide_points(t, err));
    GBT_TRY(choose_exposure(t, err));
    for (size_t i = 0; i < t->scene.view_count; i++) { /* free the tracks, which are not needed any more */
        mem_free(t->scene.views[i].seen);
        t->scene.views[i].seen = NULL;
        t->scene.views[i].seen_count = 0;
    }
    t->voxel_size = def->voxel_size;
    if (t->voxel_size > 0)
        return GBT_OK;
    return balls_voxel_size(t->scene.points.position, t->scene.points.count, t->rules.voxel, &t->voxel_size,
                            err);
}
