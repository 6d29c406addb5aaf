/* SPDX-License-Identifier: Apache-2.0 */
/* pose/result.c -- chooses one of COLMAP's models, copies it and describes it. */
#include "pose/result.h"

#include <errno.h>
#include <stdint.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/bytes.h"
#include "data/colmap_bin.h"
#include "pose/missing.h"

/* The first three files make a model; COLMAP 4 adds the others. */
static const char *const names[] = {"cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin"};
enum { NAMES = sizeof names / sizeof *names, NAMES_NEEDED = 3 };

/* A model in memory. */
typedef struct found_model {
    unsigned char *bytes[NAMES_NEEDED]; /* owned */
    char paths[NAMES_NEEDED][JOB_PATH_SIZE];
    raw_scene raw;
    double error; /* mean reprojection error of the points, pixels */
} found_model;

static void model_free(found_model *m)
{
    for (int i = 0; i < NAMES_NEEDED; i++)
        mem_free(m->bytes[i]);
    raw_free(&m->raw);
    mem_free(m);
}

/* No bounds checks are needed: points3D.bin has already been read, so its records are complete. */
static double mean_error(const source_file *points)
{
    enum { BEFORE_ERROR = 8 + 24 + 3, TRACK_ENTRY = 8 };
    cursor c = {.file = points};
    const uint64_t count = cursor_u64(&c);
    double sum = 0;
    for (uint64_t i = 0; i < count && !c.short_read; i++) {
        cursor_skip(&c, BEFORE_ERROR);
        sum += cursor_f64(&c);
        cursor_skip(&c, TRACK_ENTRY * cursor_u64(&c));
    }
    return count > 0 ? sum / (double)count : 0;
}

static gbt_status model_read(const char *folder, found_model **out, gbt_error *err)
{
    found_model *m = mem_calloc(1, sizeof *m, "model", err);
    *out = NULL;
    if (m == NULL)
        return GBT_ERR_NO_MEMORY;
    source_file files[NAMES_NEEDED] = {0};
    gbt_status status = GBT_OK;
    for (int i = 0; i < NAMES_NEEDED && status == GBT_OK; i++) {
        status = file_join(m->paths[i], sizeof m->paths[i], folder, names[i], err);
        if (status == GBT_OK)
            status = file_read(m->paths[i], &m->bytes[i], &files[i].size, err);
        files[i].name = m->paths[i];
        files[i].bytes = m->bytes[i];
    }
    const colmap_files all = {.cameras = files[0], .images = files[1], .points = files[2]};
    if (status == GBT_OK)
        status = colmap_bin_read(&all, &m->raw, err);
    if (status == GBT_OK) {
        m->error = mean_error(&files[2]);
        *out = m;
    } else {
        model_free(m);
    }
    return status;
}

/* ---- choosing a model ---- */

static gbt_status find_largest(const job *j, char best[JOB_PATH_SIZE], gbt_error *err)
{
    size_t best_views = 0, best_points = 0, models = 0;
    unsigned long largest;
    best[0] = '\0';
    for (unsigned long i = 0; file_largest_number(j->models, "", &largest) && i <= largest; i++) {
        char name[32], folder[JOB_PATH_SIZE];
        found_model *m;
        file_kind kind;
        snprintf(name, sizeof name, "%lu", i);
        GBT_TRY(file_join(folder, sizeof folder, j->models, name, err));
        GBT_TRY(file_look(folder, &kind, err));
        if (kind != FILE_FOLDER)
            continue;
        const gbt_status status = model_read(folder, &m, err);
        if (status == GBT_ERR_FORMAT) /* COLMAP does not notice a full disk; map again next time */
            job_set_undone(j, "mapping");
        GBT_TRY(status);
        models++;
        if (m->raw.view_count > best_views ||
            (m->raw.view_count == best_views && m->raw.point_count > best_points)) {
            best_views = m->raw.view_count;
            best_points = m->raw.point_count;
            snprintf(best, JOB_PATH_SIZE, "%s", folder);
        }
        model_free(m);
    }
    if (models > 1)
        log_info("COLMAP made %zu models that share too little; the largest, of %zu photos, is taken", models,
                 best_views);
    return best_views >= 2
               ? GBT_OK
               : base_fail(err, GBT_ERR_FORMAT,
                           "%s: no photo could be registered: too few matches (wanted sharp photos "
                           "that overlap by two thirds or more, from different places; log: %s)",
                           j->source, j->work);
}

static gbt_status copy_file(const char *from_folder, const char *to_folder, const char *name, gbt_error *err)
{
    char from[JOB_PATH_SIZE], to[JOB_PATH_SIZE];
    unsigned char *bytes;
    size_t count;
    GBT_TRY(file_join(from, sizeof from, from_folder, name, err));
    GBT_TRY(file_join(to, sizeof to, to_folder, name, err));
    if (!file_exists(from))
        return GBT_OK;
    GBT_TRY(file_read(from, &bytes, &count, err));
    const gbt_status status = file_write_atomic(to, bytes, count, err);
    mem_free(bytes);
    return status;
}

gbt_status result_take(const job *j, gbt_error *err)
{
    char best[JOB_PATH_SIZE], part[JOB_PATH_SIZE], part_0[JOB_PATH_SIZE], sparse[JOB_PATH_SIZE];
    GBT_TRY(find_largest(j, best, err));
    GBT_TRY(job_path(j, "sparse", part, err));
    GBT_TRY(file_join(part_0, sizeof part_0, part, "0", err));
    GBT_TRY(file_join(sparse, sizeof sparse, j->data, "sparse", err));
    job_remove_folder(part_0);
    GBT_TRY(file_make_folder(part_0, err));
    for (int i = 0; i < NAMES; i++)
        GBT_TRY(copy_file(best, part_0, names[i], err));
    if (rename(part, sparse) != 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", sparse, strerror(errno));
    return GBT_OK;
}

/* ---- the report ---- */

static void say_cameras(const raw_scene *raw, FILE *report)
{
    const gbt_camera *first = &raw->views[0].camera;
    bool same = true;
    for (size_t i = 1; i < raw->view_count; i++)
        same = same && raw->views[i].camera.model == first->model &&
               memcmp(raw->views[i].camera.params, first->params, sizeof first->params) == 0;
    fprintf(report, "  camera    %s, %d x %d pixels, focal length %.0f pixels%s\n",
            gbt_camera_model_name(first->model), first->width, first->height, first->params[0],
            same ? ", the same for all" : " for the first photo; others differ");
}

static bool *find_registered(const job *j, const raw_scene *raw, gbt_error *err)
{
    bool *registered = mem_calloc(j->photo_count, sizeof *registered, "photos", err);
    for (size_t i = 0; i < raw->view_count && registered != NULL; i++) {
        size_t low = 0, high = j->photo_count;
        while (low < high) {
            const size_t half = (low + high) / 2;
            const int order = strcmp(j->photos[half].name, raw->views[i].name);
            if (order == 0)
                registered[half] = true;
            if (order == 0)
                break;
            low = order < 0 ? half + 1 : low;
            high = order < 0 ? high : half;
        }
    }
    return registered;
}

gbt_status result_report(const job *j, FILE *report, gbt_error *err)
{
    char folder[JOB_PATH_SIZE];
    found_model *m;
    GBT_TRY(file_join(folder, sizeof folder, j->data, "sparse/0", err));
    GBT_TRY(model_read(folder, &m, err));
    bool *registered = find_registered(j, &m->raw, err);
    gbt_status status = registered != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK && report != NULL) {
        fprintf(report, "%s: %zu of %zu photos registered\n", j->data, m->raw.view_count, j->photo_count);
        if (m->raw.view_count > 0)
            say_cameras(&m->raw, report);
        fprintf(report, "  points    %zu, mean reprojection error %.2f pixels\n", m->raw.point_count,
                m->error);
    }
    if (status == GBT_OK)
        status = missing_report(j, registered, report, err);
    mem_free(registered);
    model_free(m);
    return status;
}
