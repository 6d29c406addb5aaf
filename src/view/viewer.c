/* SPDX-License-Identifier: Apache-2.0 */
/* view/viewer.c -- open the run, follow its training, prepare views. Pictures are made in picture.c. */
#include "view/viewer.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/json_out.h"
#include "data/result_folder.h"

static bool is_same_file(const struct stat *a, const struct stat *b)
{
    return a->st_ino == b->st_ino && a->st_size == b->st_size && a->st_mtim.tv_sec == b->st_mtim.tv_sec &&
           a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

/* Open the run with its photos if they can be found; otherwise `note` says why not. */
static gbt_status open_run(viewer_state *s, loaded_run *run, char *note, size_t note_size, gbt_error *err)
{
    gbt_error first = {0};
    note[0] = '\0';
    GBT_TRY(loaded_run_open_model(s->input, run, err));
    run->data_is_known = s->run != NULL;
    const gbt_status status = loaded_run_open_views(s->input, s->data, 0, run, &first);
    if (status == GBT_OK)
        return GBT_OK;
    if (s->data != NULL)
        return base_fail(err, status, "%s", first.text);
    loaded_run_close_views(run);
    const bool hint = loaded_run_cut_hint(first.text);
    if (run->cloud.count == 0)
        snprintf(note, note_size, "No photos: %.500s%s", first.text,
                 hint ? "; to show them, start the viewer with the new place of the data set" : "");
    return GBT_OK;
}

static gbt_status reopen(viewer_state *s, const struct stat *file, gbt_error *err)
{
    char note[sizeof s->note];
    loaded_run *fresh = mem_calloc(1, sizeof *fresh, "run", err);
    if (fresh == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = open_run(s, fresh, note, sizeof note, err);
    if (status != GBT_OK) {
        loaded_run_close(fresh);
        mem_free(fresh);
        return status;
    }
    if (s->run != NULL)
        loaded_run_close(s->run);
    mem_free(s->run);
    s->run = fresh;
    s->trained = fresh->frame.draw.renderer;
    memcpy(s->background, fresh->settings.background, sizeof s->background);
    s->loaded = *file;
    s->version++;
    s->last.known = false;
    memcpy(s->note, note, sizeof note);
    return GBT_OK;
}

static int64_t microseconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

gbt_status viewer_open(const char *input, const char *data, viewer_state *out, gbt_error *err)
{
    struct stat file;
    bool exists;
    char config[4096];
    *out = (viewer_state){.input = input, .data = data, .started = microseconds_now()};
    const bool folder = file_is_folder(input);
    if (folder) {
        GBT_TRY(file_join(out->model_path, sizeof out->model_path, input, "model.gbt", err));
        GBT_TRY(file_join(out->log_path, sizeof out->log_path, input, "log.csv", err));
        GBT_TRY(file_join(config, sizeof config, input, "config", err));
    } else if (snprintf(out->model_path, sizeof out->model_path, "%s", input) >=
               (int)sizeof out->model_path) {
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", input);
    }
    GBT_TRY(file_stat(out->model_path, &file, &exists, err));
    if (!exists && folder) {
        result_folder found;
        GBT_TRY(result_folder_find(input, &found, &exists, err));
        if (exists) {
            memcpy(out->model_path, found.ply, sizeof found.ply);
            GBT_TRY(file_stat(out->model_path, &file, &exists, err));
        }
    }
    if (exists)
        return reopen(out, &file, err);
    if (!folder || !file_exists(config))
        return base_fail(err, GBT_ERR_IO,
                         "%.1000s: does not exist (wanted a run, a model file or plain Gaussians)",
                         out->model_path);
    snprintf(out->note, sizeof out->note,
             "Training has not saved a model yet; it will be shown as soon as it has.");
    return GBT_OK;
}

void viewer_close(viewer_state *s)
{
    if (s->run != NULL)
        loaded_run_close(s->run);
    mem_free(s->run);
    s->run = NULL;
}

bool viewer_follow(viewer_state *s)
{
    struct stat file;
    gbt_error err = {0};
    if (stat(s->model_path, &file) != 0 || is_same_file(&file, &s->loaded))
        return false;
    if (reopen(s, &file, &err) == GBT_OK)
        return true;
    s->loaded = file; /* so that the failure is reported once per file */
    snprintf(s->note, sizeof s->note, "%s", err.text);
    log_warn("%s", err.text);
    return false;
}

char *viewer_status(const viewer_state *s)
{
    struct stat log;
    const bool has_log = s->log_path[0] != '\0' && stat(s->log_path, &log) == 0;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    json_t *note = json_text(s->note);
    json_t *status =
        json_pack("{s:I,s:i,s:I,s:f,s:o?}", "started", (json_int_t)s->started, "version", (int)s->version,
                  "log_bytes", has_log ? (json_int_t)log.st_size : (json_int_t)0, "log_age",
                  has_log ? (double)(now.tv_sec - log.st_mtim.tv_sec) : -1.0, "note", note);
    if (status != NULL && s->run != NULL) {
        json_object_set_new(status, "iterations", json_integer((json_int_t)s->run->model.iterations));
        json_object_set_new(status, "anchors", json_integer((json_int_t)s->run->model.anchors.count));
    }
    char *text = status != NULL ? json_dumps(status, JSON_COMPACT) : NULL;
    json_decref(status);
    const size_t size = text != NULL ? strlen(text) + 1 : 0;
    char *out = text != NULL ? mem_alloc(size, 1, "status", NULL) : NULL;
    if (out != NULL)
        memcpy(out, text, size);
    free(text);
    return out;
}

gbt_status viewer_camera(const viewer_state *s, const request *what, gbt_camera *out, gbt_error *err)
{
    const loaded_run *r = s->run;
    if (what->view < 0) {
        *out = what->camera;
        for (int k = 0; k < 3; k++)
            out->center[k] -= r->model.origin[k];
        return GBT_OK;
    }
    if ((size_t)what->view >= r->scene.view_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "view: %d (there are %zu)", what->view, r->scene.view_count);
    *out = photos_camera(&r->photos, (size_t)what->view, 0);
    if (what->width > 0)
        *out = gbt_camera_resized(out, what->width, what->height);
    return what->kind == REQUEST_PHOTO ? GBT_OK : request_check_size(out->width, out->height, err);
}

gbt_status viewer_prepare(viewer_state *s, const gbt_camera *camera, const request *what, bool draw,
                          gbt_error *err)
{
    loaded_run *r = s->run;
    viewer_picture wanted;
    memset(&wanted, 0, sizeof wanted);
    wanted.camera = *camera;
    wanted.renderer = what->renderer;
    wanted.preset = what->preset;
    wanted.known = true;
    wanted.t_near = what->view >= 0 ? loaded_run_settings(r, (size_t)what->view).t_near : r->settings.t_near;
    memcpy(wanted.background, what->has_background ? what->background : s->background,
           sizeof wanted.background);
    if (memcmp(&wanted, &s->last, sizeof wanted) == 0 && (s->drawn || !draw))
        return GBT_OK;
    memset(&s->last, 0, sizeof s->last);
    r->frame.draw.renderer = what->renderer;
    memcpy(r->settings.background, wanted.background, sizeof wanted.background);
    r->settings.sky.varies = r->model.sky.varies && !what->has_background;
    trace_settings_preset(what->preset, &r->settings);
    trace_settings settings = r->settings;
    settings.t_near = wanted.t_near;
    GBT_TRY(draw ? frame_render(&r->frame, loaded_run_subject(r), camera, &settings, false, err)
                 : frame_prepare(&r->frame, loaded_run_subject(r), camera, &settings, err));
    s->last = wanted;
    s->drawn = draw;
    return GBT_OK;
}
