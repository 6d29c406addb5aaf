/* SPDX-License-Identifier: Apache-2.0 */
/* train/checkpoint.c -- the trainer's state to and from one file. */
#include "train/checkpoint.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/memory.h"
#include "io/container.h"
#include "io/row_sections.h"
#include "train/config.h"
#include "train/scale_limit.h"

enum { PHOTO_END_BYTES = 2048 };

int checkpoint_arrays(trainer *t, checkpoint_array out[CHECKPOINT_ARRAYS])
{
    exposures *e = &t->exposures;
    poses *p = &t->poses;
    sky_moments *s = &t->sky;
    const size_t views = p->count > 0 ? t->scene.view_count : 0,
                 sky_rows = t->settings.sky.varies ? SH_COUNT : 0;
    const checkpoint_array all[CHECKPOINT_ARRAYS] = {
        {"exposure.matrix", CONTAINER_F32, 2, {e->count, AFFINE_NUMBERS}, e->matrix, &e->matrix},
        {"exposure.moment1", CONTAINER_F32, 2, {e->count, AFFINE_NUMBERS}, e->moment1, &e->moment1},
        {"exposure.moment2", CONTAINER_F32, 2, {e->count, AFFINE_NUMBERS}, e->moment2, &e->moment2},
        {"exposure.visits", CONTAINER_U64, 1, {e->count, 1}, e->visits, &e->visits},
        {"pose.views", CONTAINER_F64, 2, {views, POSE_PACKED}, p->packed, &p->packed},
        {"pose.moment1", CONTAINER_F32, 2, {p->count, POSE_NUMBERS}, p->moment1, &p->moment1},
        {"pose.moment2", CONTAINER_F32, 2, {p->count, POSE_NUMBERS}, p->moment2, &p->moment2},
        {"pose.visits", CONTAINER_U64, 1, {p->count, 1}, p->visits, &p->visits},
        {"pose.began", CONTAINER_U64, 1, {p->count > 0, 1}, &t->began, NULL},
        {"sky.values", CONTAINER_F32, 2, {sky_rows, 3}, s->packed, NULL},
        {"sky.moment1", CONTAINER_F32, 2, {sky_rows, 3}, s->first, NULL},
        {"sky.moment2", CONTAINER_F32, 2, {sky_rows, 3}, s->second, NULL},
    };
    int count = 0;
    for (int i = 0; i < CHECKPOINT_ARRAYS; i++)
        if (all[i].dims[0] > 0)
            out[count++] = all[i];
    return count;
}

size_t checkpoint_array_bytes(const checkpoint_array *a)
{
    return a->dims[0] * a->dims[1] * (a->dtype == CONTAINER_F32 ? sizeof(float) : sizeof(double));
}

/* Sets of anchor arrays in the file (values and Adam moments), in the order of their sections. */
enum { ANCHOR_SETS = 3 };
static const char *const anchor_set_names[ANCHOR_SETS] = {"anchors", "moment1", "moment2"};
static const char *const network_set_names[ANCHOR_SETS] = {"networks", "networks.moment1",
                                                           "networks.moment2"};

static void add_anchors(container_writer *w, const char *prefix, const anchors *a)
{
    row_sections_add(w, prefix, anchor_fields, ANCHOR_FIELDS, a->count, (size_t)a->offset_count, a->field);
}

static gbt_status read_anchors(const container *c, const char *prefix, size_t rows, anchors *a,
                               gbt_error *err)
{
    GBT_TRY(anchors_resize(a, rows, err));
    return row_sections_get(c, prefix, anchor_fields, ANCHOR_FIELDS, rows, (size_t)a->offset_count, a->field,
                            err);
}

/* FNV-1a hash that identifies a data set: names, sizes and centres of its views. */
static uint64_t hash_of_views(const trainer *t)
{
    uint64_t hash = HASH_START;
    for (size_t i = 0; i < t->scene.view_count; i++) {
        const scene_view *v = &t->scene.views[i];
        const gbt_camera *camera = poses_given(&t->poses, &t->scene, i);
        char text[512];
        const int length = snprintf(text, sizeof text, "%.300s %d %d %.6g %.6g %.6g", v->name, camera->width,
                                    camera->height, camera->center[0], camera->center[1], camera->center[2]);
        hash = hash_bytes(hash, text, (size_t)length + 1);
    }
    return hash;
}

/* FNV-1a of the views' lenses, orientations and shutter motions, and of the sparse points. */
static uint64_t hash_of_geometry(const trainer *t)
{
    const scene_points *points = &t->scene.points;
    uint64_t hash = hash_bytes(HASH_START, points->position, points->count * 3 * sizeof *points->position);
    for (size_t i = 0; i < t->scene.view_count; i++) {
        const gbt_camera *c = poses_given(&t->poses, &t->scene, i);
        double values[2 + GBT_CAMERA_MAX_PARAMS + 9 + 6] = {(double)c->model, (double)c->shutter};
        memcpy(values + 2, c->params, (size_t)gbt_camera_param_count(c->model) * sizeof *values);
        memcpy(values + 2 + GBT_CAMERA_MAX_PARAMS, c->rotation, sizeof c->rotation);
        memcpy(values + 2 + GBT_CAMERA_MAX_PARAMS + 9, c->motion, sizeof c->motion);
        for (size_t k = 0; k < sizeof values / sizeof *values; k++) {
            char text[32];
            hash = hash_bytes(hash, text, (size_t)snprintf(text, sizeof text, "%.6g ", values[k]));
        }
    }
    return hash;
}

/* Which views are held out. */
static uint64_t hash_of_split(const trainer *t)
{
    uint64_t hash = HASH_START;
    for (size_t i = 0; i < t->scene.view_count; i++)
        hash = hash_bytes(hash, t->scene.views[i].is_test ? "1" : "0", 1);
    return hash;
}

/* The colours of the sparse points, and what is kept of their tracks. */
static uint64_t hash_of_points(const trainer *t)
{
    const scene_points *points = &t->scene.points;
    uint64_t hash = hash_bytes(HASH_START, points->color, points->count * 3 * sizeof *points->color);
    for (size_t i = 0; i < t->scene.view_count; i++) {
        char text[32];
        hash =
            hash_bytes(hash, text, (size_t)snprintf(text, sizeof text, "%.6g ", t->scene.views[i].nearest));
    }
    return hash;
}

/* In the order of checkpoint_hash_data(). */
static const struct {
    const char *section, *other;
} data_hashes[CHECKPOINT_DATA_HASHES] = {
    {"views", "photos of other names, sizes or cameras"},
    {"split", "other photos held out"},
    {"geometry", "photos with other lenses or directions, or other sparse points"},
    {"points", "other colours or tracks of the sparse points"},
    {"photos", "photos of the same names, but other pictures"},
    {"masks", "other masks"},
};

void checkpoint_hash_data(const trainer *t, uint64_t out[CHECKPOINT_DATA_HASHES])
{
    const uint64_t all[CHECKPOINT_DATA_HASHES] = {hash_of_views(t),  hash_of_split(t), hash_of_geometry(t),
                                                  hash_of_points(t), t->photos_hash,   t->masks_hash};
    memcpy(out, all, sizeof all);
}

const char *checkpoint_data_difference(const uint64_t a[CHECKPOINT_DATA_HASHES],
                                       const uint64_t b[CHECKPOINT_DATA_HASHES])
{
    for (int i = 0; i < CHECKPOINT_DATA_HASHES; i++)
        if (a[i] != b[i])
            return data_hashes[i].other;
    return NULL;
}

static gbt_status hash_ends(const char *path, uint64_t *hash, gbt_error *err)
{
    unsigned char ends[2 * PHOTO_END_BYTES + sizeof(uint64_t)];
    size_t count = 0;
    if (path != NULL)
        GBT_TRY(file_read_ends(path, PHOTO_END_BYTES, ends, &count, err));
    *hash = hash_bytes(*hash, ends, count);
    return GBT_OK;
}

gbt_status checkpoint_hash_photos(const scene *s, uint64_t *of_photos, uint64_t *of_masks, gbt_error *err)
{
    *of_photos = *of_masks = HASH_START;
    for (size_t i = 0; i < s->view_count; i++) {
        GBT_TRY(hash_ends(s->views[i].path, of_photos, err));
        GBT_TRY(hash_ends(s->views[i].mask_path, of_masks, err));
    }
    return GBT_OK;
}

/* Give the old file a second name, PATH.prev (a hard link), so that PATH exists at every moment while the new
   file is written. On file systems without hard links the file is renamed instead: resuming tries PATH.prev
   next. */
static gbt_status keep_previous(const char *path, gbt_error *err)
{
    char previous[4096];
    if (snprintf(previous, sizeof previous, "%s.prev", path) >= (int)sizeof previous || !file_exists(path))
        return GBT_OK;
    unlink(previous);
    if (link(path, previous) == 0 || rename(path, previous) == 0)
        return GBT_OK;
    return base_fail(err, GBT_ERR_IO, "%s: cannot keep the previous checkpoint: %s", path, strerror(errno));
}

gbt_status checkpoint_save(trainer *t, const char *path, gbt_error *err)
{
    char config[CONFIG_TEXT_SIZE];
    config_text(&t->def, t->scene.folder, config, sizeof config);
    const size_t n = t->decoder.param_count, rows = t->stats.count;
    const anchors *const sets[ANCHOR_SETS] = {&t->anchors, &t->moment1.anchors, &t->moment2.anchors};
    const float *const networks[ANCHOR_SETS] = {t->decoder.params, t->moment1.networks, t->moment2.networks};
    const uint64_t counters[] = {t->step,
                                 t->round_step,
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
                        (const uint64_t[]){t->skipped_in_row, t->empty_in_row, t->opacity_raises});
    container_add_small(&w, "seconds", CONTAINER_F64, 1, &t->seconds);
    uint64_t of_data[CHECKPOINT_DATA_HASHES];
    checkpoint_hash_data(t, of_data);
    for (int i = 0; i < CHECKPOINT_DATA_HASHES; i++)
        container_add_small(&w, data_hashes[i].section, CONTAINER_U64, 1, &of_data[i]);
    checkpoint_array arrays[CHECKPOINT_ARRAYS];
    const int array_count = checkpoint_arrays(t, arrays);
    if (t->poses.count > 0)
        poses_pack(&t->poses, &t->scene);
    sky_pack(&t->settings, t->sky.packed);
    for (const checkpoint_array *a = arrays; a < arrays + array_count; a++)
        container_add(&w, a->section, a->dtype, a->dim_count, a->dims, a->data);
    for (int i = 0; i < ANCHOR_SETS; i++)
        add_anchors(&w, anchor_set_names[i], sets[i]);
    container_add(&w, "anchors.born", CONTAINER_U64, 1, &rows, t->created);
    for (int i = 0; i < ANCHOR_SETS; i++)
        container_add(&w, network_set_names[i], CONTAINER_F32, 1, &n, networks[i]);
    row_sections_add(&w, "stats", growth_stat_fields, GROWTH_STATS, rows, (size_t)t->stats.offset_count,
                     t->stats.field);
    gbt_status status = keep_previous(path, err);
    if (status == GBT_OK)
        status = container_save(&w, path, err);
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

static gbt_status read_arrays(trainer *t, const container *c, gbt_error *err)
{
    checkpoint_array arrays[CHECKPOINT_ARRAYS];
    const int count = checkpoint_arrays(t, arrays);
    for (checkpoint_array *a = arrays; a < arrays + count; a++) {
        const void *data;
        GBT_TRY(container_find(c, a->section, a->dtype, a->dim_count, a->dims, &data, err));
        memcpy(a->data, data, checkpoint_array_bytes(a));
    }
    if (t->poses.count > 0)
        poses_unpack(&t->poses, &t->scene);
    if (t->settings.sky.varies)
        sky_unpack(t->sky.packed, &t->settings);
    return GBT_OK;
}

static gbt_status read_creation(trainer *t, const container *c, const char *path, gbt_error *err)
{
    const size_t rows = t->anchors.count;
    mem_free(t->created);
    t->created = mem_calloc(rows, sizeof *t->created, "anchors", err);
    if (t->created == NULL)
        return GBT_ERR_NO_MEMORY;
    GBT_TRY(container_get(c, "anchors.born", CONTAINER_U64, rows, t->created, err));
    for (size_t i = 0; i < rows; i++)
        if (t->created[i] > t->anchor_t)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: anchor %zu was made in step %llu (wanted at most %llu)", path, i,
                             (unsigned long long)t->created[i], (unsigned long long)t->anchor_t);
    return GBT_OK;
}

static gbt_status check_data(const trainer *t, const container *c, const char *path, gbt_error *err)
{
    uint64_t own[CHECKPOINT_DATA_HASHES], saved[CHECKPOINT_DATA_HASHES];
    checkpoint_hash_data(t, own);
    for (int i = 0; i < CHECKPOINT_DATA_HASHES; i++)
        GBT_TRY(container_get(c, data_hashes[i].section, CONTAINER_U64, 1, &saved[i], err));
    const char *other = checkpoint_data_difference(own, saved);
    if (other != NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: made from other data (%.1000s has %s)", path,
                         t->scene.folder, other);
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
    GBT_TRY(check_data(t, c, path, err));
    if (counters[4] > PACE_SEGMENTS)
        return base_fail(err, GBT_ERR_FORMAT, "%s: the pace has %llu parts (wanted at most %d)", path,
                         (unsigned long long)counters[4], PACE_SEGMENTS);
    size_t position[2] = {CONTAINER_ANY, 3};
    const void *data;
    GBT_TRY(container_find(c, "anchors.position", CONTAINER_F32, 2, position, &data, err));
    const size_t rows = position[0], n = t->decoder.param_count;
    anchors *const sets[ANCHOR_SETS] = {&t->anchors, &t->moment1.anchors, &t->moment2.anchors};
    float *const networks[ANCHOR_SETS] = {t->decoder.params, t->moment1.networks, t->moment2.networks};
    for (int i = 0; i < ANCHOR_SETS; i++)
        GBT_TRY(read_anchors(c, anchor_set_names[i], rows, sets[i], err));
    GBT_TRY(anchors_resize(&t->gradient.anchors, rows, err));
    for (int i = 0; i < ANCHOR_SETS; i++)
        GBT_TRY(container_get(c, network_set_names[i], CONTAINER_F32, n, networks[i], err));
    GBT_TRY(growth_stats_resize(&t->stats, rows, t->def.offsets, err));
    GBT_TRY(row_sections_get(c, "stats", growth_stat_fields, GROWTH_STATS, rows, (size_t)t->def.offsets,
                             t->stats.field, err));
    GBT_TRY(read_arrays(t, c, err));
    GBT_TRY(container_get(c, "pace", CONTAINER_U64, PACE_SEGMENTS, t->pace.steps, err));
    GBT_TRY(container_get(c, "seconds", CONTAINER_F64, 1, &t->seconds, err));
    uint64_t in_row[3];
    GBT_TRY(container_get(c, "in_row", CONTAINER_U64, 3, in_row, err));
    t->skipped_in_row = in_row[0];
    t->empty_in_row = in_row[1];
    t->opacity_raises = in_row[2];
    t->step = counters[0];
    t->round_step = counters[1];
    t->anchor_t = counters[2];
    t->skipped_steps = counters[3];
    t->pace.known = (int)counters[4];
    t->anchors_initial = counters[7];
    GBT_TRY(read_creation(t, c, path, err));
    return scale_limit_update(t, err);
}

gbt_status checkpoint_load(trainer *t, const char *path, gbt_error *err)
{
    container c;
    GBT_TRY(container_load(path, &c, err));
    const gbt_status status = read_state(t, &c, path, err);
    container_free(&c);
    return status;
}
