/* SPDX-License-Identifier: Apache-2.0 */
/* run/loaded_run.c -- open a trained run, or plain Gaussians, for rendering. */
#include "run/loaded_run.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/choice.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "data/cameras_json.h"
#include "data/gaussian_file.h"
#include "data/gaussian_ply.h"
#include "data/result_folder.h"
#include "io/model_file.h"
#include "train/near_distance.h"
#include "train/pose_file.h"
#include "train/rules.h"
#include "train/run_split.h"
#include "train/seen_points.h"

/* Read what a result folder says besides its Gaussians: the data set and the background. */
static gbt_status describe_folder(const char *path, loaded_run *out, gbt_error *err)
{
    result_folder folder;
    bool found;
    GBT_TRY(result_folder_find(path, &folder, &found, err));
    snprintf(out->model.data_folder, sizeof out->model.data_folder, "%.*s",
             (int)sizeof out->model.data_folder - 1, folder.source);
    out->model.iterations = folder.iteration;
    out->def.downscale = folder.downscale;
    out->picture_width = folder.width;
    out->reduced = folder.reduced;
    out->def.alpha = folder.white_background ? GBT_ALPHA_WHITE : GBT_ALPHA_BLACK;
    for (int c = 0; c < 3; c++)
        out->settings.background[c] = folder.white_background;
    return GBT_OK;
}

void loaded_run_draw_plain(loaded_run *r)
{
    r->def = gbt_train_def_default();
    r->frame.draw.footprint = (float)r->def.footprint;
    r->settings = trace_settings_default();
}

void loaded_run_take_cloud(loaded_run *r, gaussian_cloud *cloud)
{
    gaussian_cloud_free(&r->cloud);
    r->cloud = *cloud;
    memset(cloud, 0, sizeof *cloud);
    gaussian_cloud *c = &r->cloud;
    if (c->near > 0)
        r->settings.t_near = c->near;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < 3 * c->count; i++) {
        low[i % 3] = fmin(low[i % 3], (double)c->mean[i]);
        high[i % 3] = fmax(high[i % 3], (double)c->mean[i]);
    }
    double middle[3];
    gaussian_middle(c->mean, c->count, low, high, middle);
    for (size_t i = 0; i < 3 * c->count; i++)
        c->mean[i] = (float)((double)c->mean[i] - middle[i % 3]);
    for (size_t k = 0; k < 3; k++) {
        const double before = r->model.origin[k];
        r->model.origin[k] = c->origin[k] + middle[k];
        c->origin[k] = 0;
        for (size_t i = 0; i < r->scene.view_count; i++) /* if views are open */
            r->scene.views[i].camera.center[k] += before - r->model.origin[k];
    }
}

static gbt_status open_cloud(const char *path, loaded_run *out, gbt_error *err)
{
    gaussian_cloud cloud;
    GBT_TRY(gaussian_file_read(path, &cloud, err));
    loaded_run_draw_plain(out);
    loaded_run_take_cloud(out, &cloud);
    return file_is_folder(path) ? describe_folder(path, out, err) : GBT_OK;
}

/* Path of the .ply in a result folder, or of the file itself. */
static gbt_status find_ply(const char *run, char out[RESULT_PATH_SIZE], bool *found, gbt_error *err)
{
    result_folder folder;
    *found = false;
    if (file_is_folder(run)) {
        GBT_TRY(result_folder_find(run, &folder, found, err));
        memcpy(out, folder.ply, RESULT_PATH_SIZE);
        return GBT_OK;
    }
    *found = strlen(run) < RESULT_PATH_SIZE && file_ends_with(run, ".ply");
    snprintf(out, RESULT_PATH_SIZE, "%s", run);
    return GBT_OK;
}

gbt_status loaded_run_is_larger(const char *run, size_t memory, bool *large, gbt_error *err)
{
    char ply[RESULT_PATH_SIZE];
    gaussian_ply_parts parts;
    GBT_TRY(find_ply(run, ply, large, err));
    if (!*large)
        return GBT_OK;
    gbt_error why = {0}; /* a file that cannot be read in parts is read at once later, which reports any
                            error */
    *large = gaussian_ply_open(ply, &parts, &why) == GBT_OK &&
             cell_memory_whole(parts.count, parts.file.size) > memory;
    gaussian_ply_close(&parts);
    return GBT_OK;
}

gbt_status loaded_run_open_cells(const char *run, size_t memory, const char *folder, loaded_run *out,
                                 gbt_error *err)
{
    char ply[RESULT_PATH_SIZE];
    bool found;
    memset(out, 0, sizeof *out);
    GBT_TRY(find_ply(run, ply, &found, err));
    loaded_run_draw_plain(out);
    GBT_TRY(cell_store_make(ply, folder, memory, 0, &out->cells, err));
    memcpy(out->model.origin, out->cells.origin, sizeof out->model.origin);
    if (out->cells.near > 0)
        out->settings.t_near = out->cells.near;
    if (file_is_folder(run))
        GBT_TRY(describe_folder(run, out, err));
    run_data_find(run, out->model.data_folder, &out->data);
    return GBT_OK;
}

static gbt_status read_model(const char *run, loaded_run *out, gbt_error *err)
{
    char path[4096];
    if (gaussian_file_readable(run))
        return open_cloud(run, out, err);
    const bool folder = file_is_folder(run);
    if (folder)
        GBT_TRY(file_join(path, sizeof path, run, "model.gbt", err));
    else if (snprintf(path, sizeof path, "%s", run) >= (int)sizeof path)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", run);
    if (folder && !file_exists(path))
        return base_fail(err, GBT_ERR_IO,
                         "%.1000s: does not exist (wanted a run, a model file or plain Gaussians)", path);
    GBT_TRY(model_load(path, &out->model, err));
    out->def = gbt_train_def_default();
    out->def.footprint = 0; /* default for models that do not store it */
    GBT_TRY(config_parse(out->model.config, path, &out->def, &out->strings, err));
    out->frame.draw = train_drawing_of(&out->def);
    out->frame.draw.anchor_pixel = out->model.anchor_pixel;
    out->settings = trace_settings_default();
    out->settings.t_near = out->model.t_near;
    memcpy(out->settings.background, out->model.background, sizeof out->settings.background);
    out->settings.sky = out->model.sky;
    return GBT_OK;
}

static gbt_status open_model(const char *run, loaded_run *out, gbt_error *err)
{
    GBT_TRY(read_model(run, out, err));
    run_data_find(run, out->model.data_folder, &out->data);
    return GBT_OK;
}

static bool is_plain(const loaded_run *r) { return r->cloud.count > 0 || r->cells.count > 0; }

/* Move cameras and points to the model's local origin: another data set in the same coordinates has a
   different one. */
static gbt_status place_views(double downscale, loaded_run *out, gbt_error *err)
{
    for (size_t i = 0; i < out->scene.view_count; i++)
        for (int k = 0; k < 3; k++)
            out->scene.views[i].camera.center[k] += out->scene.origin[k] - out->model.origin[k];
    for (size_t i = 0; i < 3 * out->scene.points.count; i++)
        out->scene.points.position[i] += (float)(out->scene.origin[i % 3] - out->model.origin[i % 3]);
    if (downscale <= 0)
        downscale = out->def.downscale;
    if (downscale <= 0) /* not trained here: no setting says at which size */
        GBT_TRY(photos_result_downscale(&out->scene, out->picture_width, out->reduced, &downscale, err));
    return photos_open(&out->photos, &out->scene, downscale, err);
}

/* Replace the poses of the data set by those that training refined. */
static gbt_status take_refined_poses(loaded_run *r, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, r->data.folder, POSE_FILE_NAME, err));
    r->poses_refined = file_exists(path);
    if (r->poses_refined)
        return pose_file_read(path, &r->scene, &r->held_out_aligned, err);
    log_warn("%s is missing: the data set's camera poses are used, not those refined in training", path);
    return GBT_OK;
}

bool loaded_run_cut_hint(char *text)
{
    char *hint = strstr(text, "; `data`");
    if (hint != NULL)
        *hint = '\0';
    return hint != NULL;
}

gbt_status loaded_run_open_views(const char *run, const char *data, double downscale, loaded_run *out,
                                 gbt_error *err)
{
    scene_split split;
    char split_text[RUN_SPLIT_TEXT_SIZE];
    GBT_TRY(run_split_text(out->data.folder, out->def.eval_split, split_text, err));
    GBT_TRY(scene_split_parse(split_text, &split, err));
    const bool has_data = out->data.place[0] != '\0';
    char cameras[4096];
    GBT_TRY(file_join(cameras, sizeof cameras, run, "cameras.json", err));
    if (data == NULL && is_plain(out) && !has_data && file_exists(cameras)) {
        GBT_TRY(cameras_json_load(cameras, &out->scene, err));
        /* the downscale of cfg_args is for the photos of the data set, not for the sizes in cameras.json */
        return place_views(downscale > 0 ? downscale : 1, out, err);
    }
    if (data == NULL && is_plain(out) && !has_data)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%.1000s: plain Gaussians have no cameras (wanted `camera` or `data`)", run);
    if (data == NULL && !has_data && out->data.tried[0] == '\0')
        return base_fail(err, GBT_ERR_IO,
                         "%.1000s: does not say on which data set it was trained; `data` must name it", run);
    if (data == NULL && !has_data)
        return base_fail(err, GBT_ERR_IO,
                         "%.300s: its data set is not found (tried %.1200s); `data` must name its new place",
                         run, out->data.tried);
    if (data == NULL && out->data.moved)
        log_info("%s: its data set is read from %s, as both were moved together", run, out->data.place);
    GBT_TRY((out->data_is_known ? scene_load_known : scene_load)(data != NULL ? data : out->data.place,
                                                                 &split, &out->scene, err));
    if (!seen_points_match_cameras(&out->scene)) /* as training does */
        GBT_TRY(scene_forget_points(&out->scene, false, err));
    scene_set_alpha(&out->scene, out->def.alpha);
    out->poses_refined = false;
    if (out->def.refine_poses && (data == NULL || file_is_same(data, out->data.place)))
        GBT_TRY(take_refined_poses(out, err));
    return place_views(downscale, out, err);
}

gbt_status loaded_run_open_own_views(const char *run, loaded_run *out, gbt_error *err)
{
    const gbt_status status = loaded_run_open_views(run, NULL, 0, out, err);
    if (status != GBT_OK && err != NULL)
        loaded_run_cut_hint(err->text);
    return status;
}

gbt_status loaded_run_open(const char *run, const char *data, double downscale, loaded_run *out,
                           gbt_error *err)
{
    memset(out, 0, sizeof *out);
    GBT_TRY(open_model(run, out, err));
    return loaded_run_open_views(run, data, downscale, out, err);
}

gbt_status loaded_run_open_model(const char *run, loaded_run *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    return open_model(run, out, err);
}

void loaded_run_close_views(loaded_run *r)
{
    if (r->photos.source != NULL)
        photos_close(&r->photos);
    scene_free(&r->scene);
}

void loaded_run_close(loaded_run *r)
{
    model_free(&r->model);
    gaussian_cloud_free(&r->cloud);
    cell_store_free(&r->cells);
    cell_drawer_free(&r->cell_drawer);
    loaded_run_close_views(r);
    frame_free(&r->frame);
}

gbt_status loaded_run_need_anchors(const loaded_run *r, const char *run, gbt_error *err)
{
    return r->cloud.count == 0
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT,
                           "%.1000s: plain Gaussians, no anchors (wanted a run or its model.gbt)", run);
}

frame_subject loaded_run_subject(const loaded_run *r)
{
    return r->cloud.count > 0 ? frame_plain(&r->cloud) : frame_neural(&r->model.anchors, &r->model.decoder);
}

trace_settings loaded_run_settings(const loaded_run *r, size_t view)
{
    trace_settings settings = r->settings;
    settings.t_near = near_of_view(settings.t_near, &r->def, &r->scene.views[view]);
    return settings;
}

gbt_status loaded_run_render(loaded_run *r, size_t view, gbt_error *err)
{
    const gbt_camera camera = photos_camera(&r->photos, view, 0);
    const trace_settings settings = loaded_run_settings(r, view);
    return frame_render(&r->frame, loaded_run_subject(r), &camera, &settings, false, err);
}

gbt_status loaded_run_preset(gbt_preset preset, trace_settings *settings, gbt_error *err)
{
    if (preset != GBT_PRESET_AS_TRAINED)
        GBT_TRY(choice_check("preset", GBT_PRESET_NAMES, (int)preset, err));
    trace_settings_preset(preset, settings);
    return GBT_OK;
}

/* Files are named after views, with endings such as ".transmittance.exr", and ".tmp" while they are written;
   file systems allow 255 bytes. */
enum { FILE_NAME_MAX = 200, FILE_NAME_KEPT = 180 };

/* Append a hash of the whole name, after shortening the name if there is no room. */
static void add_hash(const char *name, char out[FILE_NAME_SIZE])
{
    size_t kept = strlen(out);
    const uint64_t hash = hash_bytes(HASH_START, name, strlen(name));
    if (kept > FILE_NAME_KEPT)
        kept = FILE_NAME_KEPT;
    while (kept > 0 && ((unsigned char)out[kept] & 0xc0) == 0x80) /* never cut within a UTF-8 sequence */
        kept--;
    snprintf(out + kept, FILE_NAME_SIZE - kept, "-%016llx", (unsigned long long)hash);
}

/* The dot before the file ending of a photo. In a time such as "1623.25", ".25" is not an ending. */
static const char *ending_of(const char *name)
{
    static const char *const endings[] = {".png", ".jpg", ".jpeg", ".exr"};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot != NULL && dot != name && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return dot;
    return NULL;
}

/* Whether the name is valid UTF-8, so that JSON can represent it. */
static bool is_utf8(const char *name)
{
    json_t *value = json_string(name);
    json_decref(value);
    return value != NULL;
}

void loaded_run_file_name(const char *name, char out[FILE_NAME_SIZE])
{
    const bool is_text = is_utf8(name);
    const char *ending = ending_of(name);
    const size_t length = ending != NULL ? (size_t)(ending - name) : strlen(name);
    snprintf(out, FILE_NAME_SIZE, "%.*s", length < FILE_NAME_SIZE ? (int)length : FILE_NAME_SIZE - 1, name);
    for (char *c = out; *c != '\0'; c++)
        if (*c == '/' || (!is_text && (unsigned char)*c >= 0x80))
            *c = '_';
    if (length > FILE_NAME_MAX || !is_text)
        add_hash(name, out);
}

/* Whether NAME.png may be a file that belongs to OTHER: OTHER.photo.png, OTHER.median-depth.exr. */
static bool is_beside(const char *name, const char *other)
{
    const size_t length = strlen(other);
    if (strncmp(name, other, length) != 0 || name[length] != '.')
        return false;
    const char *word = name + length + 1;
    return word[strspn(word, "abcdefghijklmnopqrstuvwxyz-")] == '\0';
}

void loaded_run_view_name(const loaded_run *r, size_t view, char out[FILE_NAME_SIZE])
{
    const char *name = r->scene.views[view].name;
    loaded_run_file_name(name, out);
    for (size_t i = 0; i < r->scene.view_count; i++) {
        char other[FILE_NAME_SIZE];
        if (i == view)
            continue;
        loaded_run_file_name(r->scene.views[i].name, other);
        if (strcmp(other, out) != 0 && !is_beside(out, other))
            continue;
        add_hash(name, out);
        return;
    }
}
