/* SPDX-License-Identifier: Apache-2.0 */
/* train/save.c -- write the files of a run, at once or in the background from a copy while training
   continues. */
#include "train/save.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "io/model_file.h"
#include "train/checkpoint.h"
#include "train/config.h"
#include "train/finest_pixel.h"
#include "train/pose_file.h"

/* The smallest pixel of each anchor, from the training views; NULL without a footprint. */
static gbt_status find_anchor_pixels(const trainer *t, float **out, gbt_error *err)
{
    *out = NULL;
    if (t->def.footprint == 0)
        return GBT_OK;
    gbt_camera *cameras = mem_alloc(t->train_count, sizeof *cameras, "cameras", err);
    *out = mem_alloc(t->anchors.count, sizeof **out, "pixel sizes", err);
    const bool fine = cameras != NULL && *out != NULL;
    if (fine) {
        for (size_t i = 0; i < t->train_count; i++)
            cameras[i] = photos_camera(&t->photos, t->train_views[i], 0);
        finest_pixel_find(&t->anchors, cameras, t->train_count, *out);
    }
    mem_free(cameras);
    return fine ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static gbt_status save_model(const trainer *t, const char *path, gbt_error *err)
{
    model m = {.anchors = t->anchors,
               .decoder = t->decoder,
               .voxel_size = t->voxel_size,
               .extent = (float)t->extent,
               .t_near = t->settings.t_near,
               .sky = t->settings.sky,
               .iterations = t->step};
    for (int i = 0; i < 3; i++) {
        m.origin[i] = t->scene.origin[i];
        m.background[i] = t->settings.background[i];
    }
    snprintf(m.data_folder, sizeof m.data_folder, "%s", t->scene.folder);
    /* The model of a budget run records its pace instead, so that repeating it with --pace writes the same
       file. */
    gbt_train_def def = t->def;
    def.lossless = false; /* not a property of this uncompressed file */
    char text[PACE_TEXT_SIZE];
    if (def.iterations == 0 && t->pace.known == PACE_SEGMENTS) {
        pace_text(&t->pace, text);
        def.pace = text;
        def.budget_seconds = 0;
    }
    config_text(&def, t->scene.folder, m.config, sizeof m.config);
    gbt_status status = find_anchor_pixels(t, &m.anchor_pixel, err);
    if (status == GBT_OK)
        status = model_save(path, &m, err);
    mem_free(m.anchor_pixel);
    return status;
}

static gbt_status save_exposures(const trainer *t, const char *path, gbt_error *err)
{
    const char **names = mem_alloc(t->train_count, sizeof *names, "photo names", err);
    if (names == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < t->train_count; i++)
        names[i] = t->scene.views[t->train_views[i]].name;
    const gbt_status status = exposures_write(&t->exposures, names, path, err);
    mem_free(names);
    return status;
}

/* The model also where the checkpoint, which is 20 times as large, cannot be written; exposures and poses
   only beside a model of the same step. The first failure. */
static gbt_status save_all(trainer *t, const run_paths *paths, gbt_error *err)
{
    gbt_status status[4] = {checkpoint_save(t, paths->checkpoint, err)};
    status[1] = save_model(t, paths->model, err);
    if (status[1] == GBT_OK && t->exposures.count > 0)
        status[2] = save_exposures(t, paths->exposure, err);
    if (status[1] == GBT_OK && t->poses.count > 0)
        status[3] = pose_file_write(&t->scene, t->poses.held_out_aligned, paths->poses, err);
    for (int i = 0; i < 4; i++)
        GBT_TRY(status[i]);
    return GBT_OK;
}

gbt_status save_surely(trainer *t, const run_paths *paths, gbt_error *err)
{
    gbt_error why = {0};
    if (save_all(t, paths, &why) == GBT_OK)
        return GBT_OK;
    log_warn("%s; saving once more", why.text);
    return save_all(t, paths, err);
}

/* ---- beside the steps ---- */

enum { COPY_PIECE = 1 << 20, COPIES_MAX = 32 };

/* An array to copy: the pointer is the trainer's array until copy_trainer() has replaced it by the copy. */
typedef struct copied_array {
    void **array;
    size_t bytes;
} copied_array;

typedef struct copy_list {
    copied_array arrays[COPIES_MAX];
    int count;
    size_t bytes; /* of all arrays, each aligned to a cache line */
} copy_list;

static size_t to_lines(size_t bytes) { return (bytes + MEM_ALIGN - 1) / MEM_ALIGN * MEM_ALIGN; }

static void list_array(copy_list *list, void *array, size_t bytes)
{
    list->arrays[list->count++] = (copied_array){array, bytes};
    list->bytes += to_lines(bytes);
}

static void list_anchors(copy_list *list, anchors *a)
{
    for (int f = 0; f < ANCHOR_FIELDS; f++)
        list_array(list, &a->field[f], a->count * anchors_width(a, f) * sizeof(float));
}

/* All state that steps change and files contain. */
static copy_list list_arrays(trainer *t)
{
    copy_list list = {.count = 0};
    const size_t networks = t->decoder.param_count * sizeof(float), rows = t->stats.count;
    list_anchors(&list, &t->anchors);
    list_anchors(&list, &t->moment1.anchors);
    list_anchors(&list, &t->moment2.anchors);
    list_array(&list, &t->decoder.params, networks);
    list_array(&list, &t->moment1.networks, networks);
    list_array(&list, &t->moment2.networks, networks);
    list_array(&list, &t->created, rows * sizeof *t->created);
    for (int f = 0; f < GROWTH_STATS; f++)
        list_array(&list, &t->stats.field[f],
                   rows * row_field_width(&growth_stat_fields[f], t->stats.offset_count) * sizeof(float));
    checkpoint_array arrays[CHECKPOINT_ARRAYS];
    const int count = checkpoint_arrays(t, arrays);
    for (const checkpoint_array *a = arrays; a < arrays + count; a++)
        if (a->pointer != NULL)
            list_array(&list, a->pointer, checkpoint_array_bytes(a));
    if (t->poses.count > 0)
        list_array(&list, &t->scene.views, t->scene.view_count * sizeof *t->scene.views);
    return list;
}

typedef struct copy_job {
    const unsigned char *from;
    unsigned char *to;
} copy_job;

static void copy_piece(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const copy_job *job = context;
    memcpy(job->to + begin, job->from + begin, end - begin);
}

/* False without the memory. */
static bool copy_trainer(const trainer *t, trainer *copy, void **memory)
{
    *copy = *t;
    copy->photos.source = &copy->scene;
    const copy_list list = list_arrays(copy);
    unsigned char *at = mem_alloc(list.bytes, 1, "copy for a checkpoint", NULL);
    if (at == NULL)
        return false;
    *memory = at;
    for (int i = 0; i < list.count; i++) {
        const copied_array *a = &list.arrays[i];
        copy_job job = {*a->array, at};
        parallel_blocks(a->bytes, COPY_PIECE, copy_piece, &job);
        *a->array = at;
        at += to_lines(a->bytes);
    }
    return true;
}

static void write_copy(void *context)
{
    save_in_background *s = context;
    s->error = (gbt_error){0};
    s->status = save_all(&s->copy, s->paths, &s->error);
}

gbt_status save_begin(save_in_background *s, trainer *t, const run_paths *paths, gbt_error *err)
{
    if (!copy_trainer(t, &s->copy, &s->memory))
        return save_surely(t, paths, err);
    s->paths = paths;
    background_start(&s->job, write_copy, s);
    return GBT_OK;
}

bool save_is_under_way(save_in_background *s) { return s->memory != NULL && !background_is_over(&s->job); }

gbt_status save_finish(save_in_background *s, gbt_error *err)
{
    if (s->memory == NULL)
        return GBT_OK;
    background_wait(&s->job);
    mem_free(s->memory);
    s->memory = NULL;
    return s->status == GBT_OK ? GBT_OK : base_fail(err, s->status, "%s", s->error.text);
}
