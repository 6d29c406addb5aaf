/* SPDX-License-Identifier: Apache-2.0 */
/* train/checkpoint.c -- the trainer's state to and from one file. */
#include "train/checkpoint.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "io/container.h"
#include "train/config.h"

enum { NAME_SIZE = 64 };

static void add_field(container_writer *w, const char *prefix, const char *field, int dim_count,
                      const size_t *dims, const float *data)
{
    char name[NAME_SIZE];
    snprintf(name, sizeof name, "%s.%s", prefix, field);
    container_add(w, name, CONTAINER_F32, dim_count, dims, data);
}

static void add_anchors(container_writer *w, const char *prefix, const anchors *a)
{
    add_field(w, prefix, "position", 2, (const size_t[]){a->count, 3}, a->position);
    add_field(w, prefix, "feature", 2, (const size_t[]){a->count, ANCHOR_FEATURE_DIM}, a->feature);
    add_field(w, prefix, "offset", 3, (const size_t[]){a->count, (size_t)a->offset_count, 3}, a->offset);
    add_field(w, prefix, "scale_log", 2, (const size_t[]){a->count, 6}, a->scale_log);
}

static gbt_status copy_field(const container *c, const char *prefix, const char *field, size_t rows,
                             size_t row_floats, int dim_count, const size_t *tail, float *out, gbt_error *err)
{
    char name[NAME_SIZE];
    snprintf(name, sizeof name, "%s.%s", prefix, field);
    size_t dims[3] = {rows, tail[0], tail[1]};
    const void *data;
    GBT_TRY(container_find(c, name, CONTAINER_F32, dim_count, dims, &data, err));
    memcpy(out, data, rows * row_floats * sizeof *out);
    return GBT_OK;
}

static gbt_status read_anchors(const container *c, const char *prefix, size_t rows, anchors *a,
                               gbt_error *err)
{
    const size_t k = (size_t)a->offset_count;
    GBT_TRY(anchors_resize(a, rows, err));
    GBT_TRY(copy_field(c, prefix, "position", rows, 3, 2, (const size_t[]){3, 0}, a->position, err));
    GBT_TRY(copy_field(c, prefix, "feature", rows, ANCHOR_FEATURE_DIM, 2,
                       (const size_t[]){ANCHOR_FEATURE_DIM, 0}, a->feature, err));
    GBT_TRY(copy_field(c, prefix, "offset", rows, 3 * k, 3, (const size_t[]){k, 3}, a->offset, err));
    return copy_field(c, prefix, "scale_log", rows, 6, 2, (const size_t[]){6, 0}, a->scale_log, err);
}

/* FNV-1a of what tells one data set from another: the names, sizes and centres of its views. */
static uint64_t hash_of_views(const scene *s)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < s->view_count; i++) {
        const scene_view *v = &s->views[i];
        char text[512];
        const int length =
            snprintf(text, sizeof text, "%.300s %d %d %.6g %.6g %.6g", v->name, v->camera.width,
                     v->camera.height, v->camera.center[0], v->camera.center[1], v->camera.center[2]);
        for (int k = 0; k <= length; k++)
            hash = (hash ^ (unsigned char)text[k]) * 0x100000001b3u;
    }
    return hash;
}

gbt_status checkpoint_save(const trainer *t, const char *path, gbt_error *err)
{
    char config[CONFIG_TEXT_SIZE];
    config_text(&t->def, t->scene.folder, config, sizeof config);
    const size_t n = t->decoder.param_count, rows = t->stats.count, k = (size_t)t->stats.offset_count;
    const uint64_t counters[] = {t->step,
                                 t->adjust_step,
                                 t->anchor_t,
                                 t->skipped_steps,
                                 (uint64_t)t->pace.known,
                                 t->scene.view_count,
                                 t->scene.points.count,
                                 t->anchors_initial};
    container_writer w = {0};
    container_add_text(&w, "config", config);
    container_add_small(&w, "counters", CONTAINER_U64, sizeof counters / sizeof *counters, counters);
    container_add(&w, "pace", CONTAINER_U64, 1, (const size_t[]){PACE_SEGMENTS}, t->pace.steps);
    container_add_small(&w, "in_row", CONTAINER_U64, 3,
                        (const uint64_t[]){t->skipped_in_row, t->barren_in_row, t->revivals});
    container_add_small(&w, "seconds", CONTAINER_F64, 1, &t->seconds);
    container_add_small(&w, "views", CONTAINER_U64, 1, (const uint64_t[]){hash_of_views(&t->scene)});
    const exposures *e = &t->exposures;
    const size_t exposure_dims[2] = {e->count, AFFINE_NUMBERS};
    if (e->count > 0) {
        add_field(&w, "exposure", "matrix", 2, exposure_dims, e->matrix);
        add_field(&w, "exposure", "moment1", 2, exposure_dims, e->moment1);
        add_field(&w, "exposure", "moment2", 2, exposure_dims, e->moment2);
        container_add(&w, "exposure.visits", CONTAINER_U64, 1, &e->count, e->visits);
    }
    add_anchors(&w, "anchors", &t->anchors);
    add_anchors(&w, "moment1", &t->moment1);
    add_anchors(&w, "moment2", &t->moment2);
    container_add(&w, "anchors.born", CONTAINER_U64, 1, &rows, t->born);
    container_add(&w, "networks", CONTAINER_F32, 1, &n, t->decoder.params);
    container_add(&w, "networks.moment1", CONTAINER_F32, 1, &n, t->params_m);
    container_add(&w, "networks.moment2", CONTAINER_F32, 1, &n, t->params_v);
    container_add(&w, "stats.use_accum", CONTAINER_F32, 1, &rows, t->stats.use_accum);
    container_add(&w, "stats.visit_count", CONTAINER_F32, 1, &rows, t->stats.visit_count);
    container_add(&w, "stats.grad_accum", CONTAINER_F32, 2, (const size_t[]){rows, k}, t->stats.grad_accum);
    container_add(&w, "stats.grad_count", CONTAINER_F32, 2, (const size_t[]){rows, k}, t->stats.grad_count);
    /* A kill between the two renames leaves only PATH.prev: whoever resumes looks there next. */
    char previous[4096];
    if (snprintf(previous, sizeof previous, "%s.prev", path) < (int)sizeof previous && file_exists(path)) {
        if (rename(path, previous) != 0) {
            container_writer_free(&w);
            return base_fail(err, GBT_ERR_IO, "%s: cannot keep the previous checkpoint: %s", path,
                             strerror(errno));
        }
    }
    const gbt_status status = container_save(&w, path, err);
    container_writer_free(&w);
    return status;
}

gbt_status checkpoint_config(const char *path, char *out, size_t size, gbt_error *err)
{
    container c;
    GBT_TRY(container_load(path, &c, err));
    const gbt_status status = container_get_text(&c, "config", out, size, err);
    container_free(&c);
    return status;
}

static gbt_status read_exposures(const container *c, exposures *e, gbt_error *err)
{
    const struct {
        const char *field;
        float *out;
    } fields[] = {{"matrix", e->matrix}, {"moment1", e->moment1}, {"moment2", e->moment2}};
    for (int i = 0; i < 3; i++)
        GBT_TRY(copy_field(c, "exposure", fields[i].field, e->count, AFFINE_NUMBERS, 2,
                           (const size_t[]){AFFINE_NUMBERS, 0}, fields[i].out, err));
    return container_get(c, "exposure.visits", CONTAINER_U64, e->count, e->visits, err);
}

/* Older checkpoints have none. */
static gbt_status read_births(trainer *t, const container *c, const char *path, gbt_error *err)
{
    const size_t rows = t->anchors.count;
    mem_free(t->born);
    t->born = mem_calloc(rows, sizeof *t->born, "anchors", err);
    if (t->born == NULL)
        return GBT_ERR_NO_MEMORY;
    if (container_section_named(c, "anchors.born") != NULL)
        GBT_TRY(container_get(c, "anchors.born", CONTAINER_U64, rows, t->born, err));
    for (size_t i = 0; i < rows; i++)
        if (t->born[i] > t->anchor_t)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: anchor %zu was made in step %llu (wanted at most %llu)", path, i,
                             (unsigned long long)t->born[i], (unsigned long long)t->anchor_t);
    return GBT_OK;
}

static gbt_status read_state(trainer *t, const container *c, const char *path, gbt_error *err)
{
    uint64_t counters[8];
    GBT_TRY(container_get(c, "counters", CONTAINER_U64, 8, counters, err));
    if (counters[5] != t->scene.view_count || counters[6] != t->scene.points.count)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: made from other data (wanted %zu views and %zu points, got %llu and %llu)%s%s",
                         path, t->scene.view_count, t->scene.points.count, (unsigned long long)counters[5],
                         (unsigned long long)counters[6],
                         t->scene.photos_missing > 0 ? "; photos that are missing: " : "",
                         t->scene.missing_names);
    uint64_t views = hash_of_views(&t->scene);
    if (container_section_named(c, "views") != NULL) /* older checkpoints have none */
        GBT_TRY(container_get(c, "views", CONTAINER_U64, 1, &views, err));
    if (views != hash_of_views(&t->scene))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: made from other data (%.1000s has photos of other names, sizes or cameras)",
                         path, t->scene.folder);
    if (counters[4] > PACE_SEGMENTS)
        return base_fail(err, GBT_ERR_FORMAT, "%s: pace of %llu parts (limit %d)", path,
                         (unsigned long long)counters[4], PACE_SEGMENTS);
    size_t position[2] = {CONTAINER_ANY, 3};
    const void *data;
    GBT_TRY(container_find(c, "anchors.position", CONTAINER_F32, 2, position, &data, err));
    const size_t rows = position[0], n = t->decoder.param_count, k = (size_t)t->def.offsets;
    GBT_TRY(read_anchors(c, "anchors", rows, &t->anchors, err));
    GBT_TRY(read_anchors(c, "moment1", rows, &t->moment1, err));
    GBT_TRY(read_anchors(c, "moment2", rows, &t->moment2, err));
    GBT_TRY(anchors_resize(&t->gradient, rows, err));
    GBT_TRY(container_get(c, "networks", CONTAINER_F32, n, t->decoder.params, err));
    GBT_TRY(container_get(c, "networks.moment1", CONTAINER_F32, n, t->params_m, err));
    GBT_TRY(container_get(c, "networks.moment2", CONTAINER_F32, n, t->params_v, err));
    GBT_TRY(adjust_stats_resize(&t->stats, rows, t->def.offsets, err));
    GBT_TRY(container_get(c, "stats.use_accum", CONTAINER_F32, rows, t->stats.use_accum, err));
    GBT_TRY(container_get(c, "stats.visit_count", CONTAINER_F32, rows, t->stats.visit_count, err));
    GBT_TRY(container_find(c, "stats.grad_accum", CONTAINER_F32, 2, (size_t[]){rows, k}, &data, err));
    memcpy(t->stats.grad_accum, data, rows * k * sizeof(float));
    GBT_TRY(container_find(c, "stats.grad_count", CONTAINER_F32, 2, (size_t[]){rows, k}, &data, err));
    memcpy(t->stats.grad_count, data, rows * k * sizeof(float));
    if (t->exposures.count > 0)
        GBT_TRY(read_exposures(c, &t->exposures, err));
    GBT_TRY(container_get(c, "pace", CONTAINER_U64, PACE_SEGMENTS, t->pace.steps, err));
    GBT_TRY(container_get(c, "seconds", CONTAINER_F64, 1, &t->seconds, err));
    uint64_t in_row[3] = {0, 0, 0};
    if (container_section_named(c, "in_row") != NULL) /* older checkpoints have none */
        GBT_TRY(container_get(c, "in_row", CONTAINER_U64, 3, in_row, err));
    t->skipped_in_row = in_row[0];
    t->barren_in_row = in_row[1];
    t->revivals = in_row[2];
    t->step = counters[0];
    t->adjust_step = counters[1];
    t->anchor_t = counters[2];
    t->skipped_steps = counters[3];
    t->pace.known = (int)counters[4];
    t->anchors_initial = counters[7];
    return read_births(t, c, path, err);
}

gbt_status checkpoint_load(trainer *t, const char *path, gbt_error *err)
{
    container c;
    GBT_TRY(container_load(path, &c, err));
    const gbt_status status = read_state(t, &c, path, err);
    container_free(&c);
    return status;
}
