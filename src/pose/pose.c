/* SPDX-License-Identifier: Apache-2.0 */
/* pose/pose.c -- runs gbt_pose(): prepares the folder, checks its settings, runs the stages that are not
   finished.

   source --> [film: sharp frames] --> DATA/images --> features --> matching --> mapping --> DATA/sparse/0
   DATA/colmap records which stages are finished, and the settings of the first call. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/choice.h"
#include "base/def.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "data/bytes.h"
#include "data/unposed.h"
#include "pose/colmap.h"
#include "pose/film.h"
#include "pose/photos.h"
#include "pose/result.h"

enum { FRAMES_LEAST = 10, FRAMES_MOST = 2000 };

gbt_pose_def gbt_pose_def_default(void) { return (gbt_pose_def){.cookie_ = DEF_COOKIE}; }

static gbt_status check(const gbt_pose_def *def, gbt_error *err)
{
    GBT_TRY(def_check(def->cookie_, "gbt_pose_def_default", err));
    GBT_TRY(choice_check("camera_model", GBT_POSE_CAMERA_NAMES, (int)def->camera_model, err));
    GBT_TRY(choice_check("matcher", GBT_POSE_MATCHER_NAMES, (int)def->matcher, err));
    if (def->frames != 0 && (def->frames < FRAMES_LEAST || def->frames > FRAMES_MOST))
        return base_fail(err, GBT_ERR_ARGUMENT, "frames: %d (wanted %d to %d)", def->frames, FRAMES_LEAST,
                         FRAMES_MOST);
    return GBT_OK;
}

/* ---- folders ---- */

static gbt_status absolute(const char *path, char out[JOB_PATH_SIZE], gbt_error *err)
{
    char *full = realpath(path, NULL);
    if (full == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: %s", path, strerror(errno));
    const size_t length = strlen(full);
    if (length < JOB_PATH_SIZE)
        memcpy(out, full, length + 1);
    free(full);
    return length < JOB_PATH_SIZE ? GBT_OK
                                  : base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", path);
}

static gbt_status set_folders(job *j, const char *source, const char *data, gbt_error *err)
{
    file_kind kind;
    GBT_TRY(file_look(source, &kind, err));
    if (kind == FILE_NONE)
        return base_fail(err, GBT_ERR_IO, "%s: no such file or folder", source);
    GBT_TRY(absolute(source, j->source, err));
    j->is_film = kind == FILE_OTHER;
    if (!j->is_film && !unposed_has_photos(j->source, 0)) {
        char images[JOB_PATH_SIZE];
        GBT_TRY(file_join(images, sizeof images, j->source, "images", err));
        if (unposed_has_photos(images, 1))
            memcpy(j->source, images, sizeof images);
    }
    if (snprintf(j->data, sizeof j->data, "%s", data) >= (int)sizeof j->data)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", data);
    GBT_TRY(file_join(j->images, sizeof j->images, j->data, "images", err));
    GBT_TRY(file_join(j->work, sizeof j->work, j->data, "colmap", err));
    GBT_TRY(job_path(j, "database.db", j->database, err));
    GBT_TRY(job_path(j, "models", j->models, err));
    j->in_place = !j->is_film && file_is_same(j->source, j->images);
    if (!j->in_place && !j->is_film && file_is_same(j->source, j->data))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "%s: the photos are in the folder itself (wanted another folder for the data set, or "
            "the photos in %s)",
            data, j->images);
    if (!j->is_film && j->def.frames != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "frames: only for a film (%.1000s is a folder of photos)",
                         source);
    return GBT_OK;
}

/* ---- the settings of the first call ---- */

static void put_setting(sink *out, const char *name, const char *value)
{
    sink_put_text(out, name);
    sink_put_text(out, " = ");
    sink_put_text(out, value);
    sink_put_text(out, "\n");
}

/* The size in bytes and the modification time distinguish a file from another one of the same name. */
static gbt_status put_file(sink *out, const char *setting, const char *name, const char *path)
{
    struct stat info;
    char value[JOB_PATH_SIZE + 64];
    if (stat(path, &info) != 0)
        return base_fail(out->err, GBT_ERR_IO, "%s: %s", path, strerror(errno));
    snprintf(value, sizeof value, "%s %lld %lld", name, (long long)info.st_size, (long long)info.st_mtime);
    put_setting(out, setting, value);
    return out->status;
}

/** @param files [in] true: with size and time of the film or the photos (put_file()), not only their names */
static gbt_status settings_text(const job *j, bool files, sink *out)
{
    char frames[16], path[JOB_PATH_SIZE];
    snprintf(frames, sizeof frames, "%d", j->def.frames);
    if (j->is_film && files)
        GBT_TRY(put_file(out, "source", j->source, j->source));
    else
        put_setting(out, "source", j->source);
    put_setting(out, "camera_model", CHOICE_NAME(GBT_POSE_CAMERA_NAMES, j->def.camera_model));
    put_setting(out, "matcher", CHOICE_NAME(GBT_POSE_MATCHER_NAMES, j->def.matcher));
    if (j->is_film)
        put_setting(out, "frames", frames);
    for (size_t i = 0; i < j->photo_count && !j->is_film; i++) {
        GBT_TRY(file_join(path, sizeof path, j->source, j->photos[i].name, out->err));
        if (files)
            GBT_TRY(put_file(out, "photo", j->photos[i].name, path));
        else
            put_setting(out, "photo", j->photos[i].name);
    }
    return out->status;
}

static bool is_same(const sink *text, const unsigned char *bytes, size_t size)
{
    return size == text->size && memcmp(bytes, text->bytes, size) == 0;
}

static gbt_status compare_settings(const job *j, const char *path, const sink *now, gbt_error *err)
{
    unsigned char *then;
    size_t size;
    sink names = {.err = err}; /* folders of older versions list only names */
    GBT_TRY(file_read(path, &then, &size, err));
    const gbt_status status = settings_text(j, false, &names);
    const bool same = status == GBT_OK && (is_same(now, then, size) || is_same(&names, then, size));
    sink_free(&names);
    mem_free(then);
    return same || status != GBT_OK
               ? status
               : base_fail(
                     err, GBT_ERR_ARGUMENT,
                     "%s: was begun with other photos or options, listed in %s (use the same, or choose "
                     "another folder)",
                     j->data, path);
}

/* DATA must be a folder that gbt_pose() made, or contain nothing that it would overwrite. */
static gbt_status check_folder(const job *j, gbt_error *err)
{
    char settings[JOB_PATH_SIZE], sparse[JOB_PATH_SIZE];
    GBT_TRY(job_path(j, "settings", settings, err));
    GBT_TRY(file_join(sparse, sizeof sparse, j->data, "sparse", err));
    if (file_exists(settings))
        return GBT_OK;
    const char *const not_ours[] = {sparse, j->in_place ? NULL : j->images};
    for (int i = 0; i < 2 && not_ours[i] != NULL; i++) {
        file_kind kind;
        GBT_TRY(file_look(not_ours[i], &kind, err));
        if (kind != FILE_NONE)
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: already exists (choose another folder)",
                             not_ours[i]);
    }
    return GBT_OK;
}

static gbt_status begin(const job *j, gbt_error *err)
{
    char path[JOB_PATH_SIZE];
    GBT_TRY(job_path(j, "settings", path, err));
    sink now = {.err = err};
    gbt_status status = settings_text(j, true, &now);
    if (status == GBT_OK && file_exists(path))
        status = compare_settings(j, path, &now, err);
    else if (status == GBT_OK)
        status = file_write_atomic(path, now.bytes, now.size, err);
    sink_free(&now);
    return status;
}

/*
 * Two calls must not work in one folder. The lock is released when this process and the COLMAP that it
 * started have ended.
 */
static gbt_status lock(const job *j, int *out, gbt_error *err)
{
    char path[JOB_PATH_SIZE];
    GBT_TRY(job_path(j, "lock", path, err));
    *out = open(path, O_RDWR | O_CREAT, 0666);
    if (*out < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", path, strerror(errno));
    if (flock(*out, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
        return GBT_OK;
    close(*out);
    *out = -1;
    return base_fail(err, GBT_ERR_IO, "%s: another process works in it", j->data);
}

/* ---- stages ---- */

static gbt_status find_poses(job *j, gbt_error *err)
{
    colmap_options colmap;
    GBT_TRY(colmap_find(j, &colmap, err)); /* fail now, not after minutes of decoding a film */
    if (j->is_film && !file_exists(j->images))
        GBT_TRY(film_to_photos(j, err));
    if (j->is_film)
        GBT_TRY(photos_list(j, j->images, err));
    else if (!j->in_place)
        GBT_TRY(photos_link(j, err));
    photos_group(j);
    GBT_TRY(colmap_stages(j, &colmap, err));
    return result_take(j, err);
}

static gbt_status run(job *j, FILE *report, gbt_error *err)
{
    char sparse[JOB_PATH_SIZE];
    GBT_TRY(begin(j, err));
    GBT_TRY(file_join(sparse, sizeof sparse, j->data, "sparse", err));
    if (!file_exists(sparse))
        GBT_TRY(find_poses(j, err));
    else if (j->is_film)
        GBT_TRY(photos_list(j, j->images, err));
    return result_report(j, report, err);
}

gbt_status gbt_pose(const char *source, const gbt_pose_def *def, const char *data, FILE *report,
                    gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(check(def, err));
    job *j = mem_calloc(1, sizeof *j, "pose", err);
    if (j == NULL)
        return GBT_ERR_NO_MEMORY;
    j->def = *def;
    int locked = -1;
    gbt_status status = set_folders(j, source, data, err);
    if (status == GBT_OK && !j->is_film)
        status = photos_list(j, j->source, err);
    if (status == GBT_OK)
        status = check_folder(j, err);
    if (status == GBT_OK)
        status = file_make_folder(j->work, err);
    if (status == GBT_OK)
        status = lock(j, &locked, err);
    if (status == GBT_OK) {
        stop_signal_catch();
        status = run(j, report, err);
        stop_signal_release();
    }
    if (locked >= 0)
        close(locked);
    photos_free(j);
    mem_free(j);
    return status;
}
