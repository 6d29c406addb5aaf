/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_file.c -- writes a model as sections of a container and reads it back, checking every value. */
#include "io/model_file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "io/model_code.h"
#include "io/row_sections.h"

/* Scalars are stored in three vectors; the enums are indices into them. */
enum { SCENE_VOXEL_SIZE, SCENE_EXTENT, SCENE_T_NEAR, SCENE_BACKGROUND, SCENE_NUMBERS = SCENE_BACKGROUND + 3 };
enum { DECODER_DISTANCE_SCALE, DECODER_DISTANCE_MIN, DECODER_DISTANCE_MAX, DECODER_NUMBERS };

/* Add everything except the anchors and the network parameters. */
static void add_scene(container_writer *w, const model *m)
{
    const decoder *d = &m->decoder;
    container_add_small(w, "decoder.has_distance", CONTAINER_U8, 1, &(uint8_t){d->has_distance ? 1 : 0});
    container_add_small(w, "decoder.numbers", CONTAINER_F32, DECODER_NUMBERS,
                        (float[DECODER_NUMBERS]){d->distance_scale, d->distance_min, d->distance_max});
    container_add_small(w, "scene.origin", CONTAINER_F64, 3, m->origin);
    container_add_small(w, "scene.numbers", CONTAINER_F32, SCENE_NUMBERS,
                        (float[SCENE_NUMBERS]){m->voxel_size, m->extent, m->t_near, m->background[0],
                                               m->background[1], m->background[2]});
    if (m->sky.varies)
        container_add(w, "scene.sky", CONTAINER_F32, 2, (size_t[]){SKY_HARMONICS, 3}, m->sky.harmonic);
    if (m->sky.varies && m->sky.has_horizon) {
        container_add_small(w, "scene.sky_up", CONTAINER_F32, 3, m->sky.up);
        container_add_small(w, "scene.sky_ground", CONTAINER_F32, 3, m->sky.ground);
    }
    container_add_text(w, "scene.data_folder", m->data_folder);
    container_add_text(w, "train.config", m->config);
    container_add_small(w, "train.iterations", CONTAINER_U64, 1, &m->iterations);
}

void model_add(container_writer *w, const model *m)
{
    const anchors *a = &m->anchors;
    row_sections_add(w, "anchor", anchor_fields, ANCHOR_FIELDS, a->count, (size_t)a->offset_count, a->field);
    if (m->anchor_pixel != NULL)
        container_add(w, "anchor.pixel", CONTAINER_F32, 1, (size_t[]){a->count}, m->anchor_pixel);
    container_add(w, "decoder.params", CONTAINER_F32, 1, (size_t[]){m->decoder.param_count},
                  m->decoder.params);
    add_scene(w, m);
}

static gbt_status check_finite(const char *path, const char *section, const float *values, size_t count,
                               gbt_status failure, gbt_error *err)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return base_fail(err, failure, "%s: section %s: value %zu is not finite", path, section, i);
    return GBT_OK;
}

/** Check all that the rest of the program relies on. `failure` is the status to return: GBT_ERR_ARGUMENT or
    GBT_ERR_FORMAT, depending on where the model came from. */
static gbt_status check_model(const char *path, const model *m, gbt_status failure, gbt_error *err)
{
    const anchors *a = &m->anchors;
    const decoder *d = &m->decoder;
    if (a->offset_count < 1 || a->offset_count > ANCHOR_MAX_OFFSETS)
        return base_fail(
            err, failure,
            "%s: section anchor.offset: bad number of offsets per anchor (wanted 1 to %d, got %d)", path,
            ANCHOR_MAX_OFFSETS, a->offset_count);
    if (a->count > UINT32_MAX / ANCHOR_MAX_OFFSETS) /* Gaussian ids have 32 bits */
        return base_fail(err, failure,
                         "%s: section anchor.position: too many anchors (wanted at most %u, got %zu)", path,
                         UINT32_MAX / ANCHOR_MAX_OFFSETS, a->count);
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    const size_t param_count = networks[DECODER_NETWORKS - 1].end;
    if (d->offset_count != a->offset_count || d->param_count != param_count)
        return base_fail(
            err, failure,
            "%s: section decoder.params does not fit %d offsets per anchor (wanted %zu values, got %zu)",
            path, a->offset_count, param_count, d->param_count);
    for (int f = 0; f < ANCHOR_FIELDS; f++) {
        char section[CONTAINER_NAME_SIZE];
        snprintf(section, sizeof section, "anchor.%s", anchor_fields[f].name);
        GBT_TRY(check_finite(path, section, a->field[f], a->count * anchors_width(a, f), failure, err));
    }
    const struct {
        const char *section;
        const float *values;
        size_t count;
    } arrays[] = {
        {"anchor.pixel", m->anchor_pixel, m->anchor_pixel != NULL ? a->count : 0},
        {"decoder.params", d->params, d->param_count},
        {"scene.numbers", &m->voxel_size, 1},
        {"scene.numbers", &m->extent, 1},
        {"scene.numbers", &m->t_near, 1},
        {"scene.numbers", m->background, 3},
        {"scene.sky", m->sky.harmonic[0], m->sky.varies ? 3 * SKY_HARMONICS : 0},
        {"scene.sky_up", m->sky.up, 3},
        {"scene.sky_ground", m->sky.ground, 3},
        {"decoder.numbers", &d->distance_scale, 1},
    };
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        GBT_TRY(check_finite(path, arrays[i].section, arrays[i].values, arrays[i].count, failure, err));
    for (size_t i = 0; m->anchor_pixel != NULL && i < a->count; i++)
        if (m->anchor_pixel[i] < 0)
            return base_fail(err, failure, "%s: section anchor.pixel: value %zu is negative", path, i);
    if (isnan(d->distance_min) || isnan(d->distance_max)) /* infinite is allowed: no limit */
        return base_fail(err, failure,
                         "%s: section decoder.numbers: the trained range of distances is not a number", path);
    if (m->voxel_size < 0 || m->extent < 0 || m->t_near < 0)
        return base_fail(err, failure,
                         "%s: section scene.numbers: a length is negative (voxel %g, extent %g, near %g)",
                         path, (double)m->voxel_size, (double)m->extent, (double)m->t_near);
    for (int i = 0; i < 3; i++)
        if (!isfinite(m->origin[i]))
            return base_fail(err, failure, "%s: section scene.origin: value %d is not finite", path, i);
    return GBT_OK;
}

gbt_status model_save(const char *path, const model *m, gbt_error *err)
{
    GBT_TRY(check_model(path, m, GBT_ERR_ARGUMENT, err));
    container_writer w = {0};
    model_add(&w, m);
    const gbt_status status = container_save(&w, path, err);
    container_writer_free(&w);
    return status;
}

/* Whether the coded parts of two models are equal to the bit. */
static bool same_parts(const model *a, const model *b)
{
    const size_t n = a->anchors.count;
    if (b->anchors.count != n || b->anchors.offset_count != a->anchors.offset_count ||
        a->decoder.param_count != b->decoder.param_count ||
        (a->anchor_pixel == NULL) != (b->anchor_pixel == NULL))
        return false;
    if (memcmp(a->decoder.params, b->decoder.params, a->decoder.param_count * sizeof(float)) != 0)
        return false;
    for (int f = 0; f < ANCHOR_FIELDS && n > 0; f++)
        if (memcmp(a->anchors.field[f], b->anchors.field[f],
                   n * anchors_width(&a->anchors, f) * sizeof(float)) != 0)
            return false;
    return n == 0 || a->anchor_pixel == NULL ||
           memcmp(a->anchor_pixel, b->anchor_pixel, n * sizeof(float)) == 0;
}

/* Read back the bytes before they are written: an unreadable model must not replace a good file. */
static gbt_status check_bytes(const char *path, const unsigned char *bytes, size_t byte_count,
                              const model *wanted, gbt_error *err)
{
    container c;
    model back = {0};
    GBT_TRY(container_parse(bytes, byte_count, path, &c, err));
    gbt_status status = model_from_container(&c, &back, err);
    if (status == GBT_OK && !same_parts(wanted, &back))
        status = base_fail(err, GBT_ERR_INTERNAL,
                           "%s: compressed, the model decodes to other values (a defect of gbtrace)", path);
    model_free(&back);
    container_free(&c);
    return status;
}

static model_sizes sizes_of(const uint32_t part_bytes[CODE_PARTS], size_t total)
{
    return (model_sizes){.positions = part_bytes[CODE_POSITIONS],
                         .features = part_bytes[CODE_FEATURES],
                         .offsets = part_bytes[CODE_OFFSETS],
                         .scales = part_bytes[CODE_SCALES],
                         .pixels = part_bytes[CODE_PIXELS],
                         .networks = part_bytes[CODE_NETWORKS],
                         .steps = part_bytes[CODE_DOUBLINGS] + part_bytes[CODE_RULES],
                         .total = total};
}

gbt_status model_sizes_read(const container *c, size_t total, model_sizes *out, gbt_error *err)
{
    uint32_t part_bytes[CODE_PARTS];
    GBT_TRY(container_get(c, "coded.parts", CONTAINER_U32, CODE_PARTS, part_bytes, err));
    *out = sizes_of(part_bytes, total);
    return GBT_OK;
}

gbt_status model_save_coded(const char *path, const model *m, const model_steps *steps, model_sizes *sizes,
                            gbt_error *err)
{
    const char *called = path != NULL ? path : "coded model";
    GBT_TRY(check_model(called, m, GBT_ERR_ARGUMENT, err));
    container_writer w = {0};
    model_coded coded = {0};
    model back = {0};
    unsigned char *bytes = NULL;
    size_t byte_count = 0;
    gbt_status status = model_code(m, steps, &coded, &back, err);
    if (status == GBT_OK) {
        model_add_coded(&w, &coded);
        add_scene(&w, m);
        status = container_encode(&w, &bytes, &byte_count, err);
    }
    if (status == GBT_OK)
        status = check_bytes(called, bytes, byte_count, &back, err);
    if (status == GBT_OK && path != NULL)
        status = file_write_atomic(path, bytes, byte_count, err);
    if (status == GBT_OK && sizes != NULL)
        *sizes = sizes_of(coded.part_bytes, byte_count);
    container_writer_free(&w);
    model_coded_free(&coded);
    model_free(&back);
    mem_free(bytes);
    return status;
}

static gbt_status read_anchors(const container *c, anchors *a, gbt_error *err)
{
    size_t count = CONTAINER_ANY, k = CONTAINER_ANY;
    const void *data[ANCHOR_FIELDS];
    GBT_TRY(row_sections_find(c, "anchor", anchor_fields, ANCHOR_FIELDS, &count, &k, data, err));
    if (k < 1 || k > ANCHOR_MAX_OFFSETS)
        return base_fail(
            err, GBT_ERR_FORMAT,
            "%s: section anchor.offset: bad number of offsets per anchor (wanted 1 to %d, got %zu)", c->path,
            ANCHOR_MAX_OFFSETS, k);
    a->offset_count = (int)k;
    GBT_TRY(anchors_resize(a, count, err));
    for (int f = 0; f < ANCHOR_FIELDS && count > 0; f++)
        memcpy(a->field[f], data[f], count * anchors_width(a, f) * sizeof(float));
    return GBT_OK;
}

/* The section is missing in models trained without pixel footprints. */
static gbt_status read_anchor_pixel(const container *c, size_t count, float **out, gbt_error *err)
{
    const void *pixel;
    if (container_section_named(c, "anchor.pixel") == NULL)
        return GBT_OK;
    GBT_TRY(container_find(c, "anchor.pixel", CONTAINER_F32, 1, &count, &pixel, err));
    *out = mem_alloc(count, sizeof **out, "pixel sizes", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    if (count > 0)
        memcpy(*out, pixel, count * sizeof **out);
    return GBT_OK;
}

static gbt_status read_decoder_inputs(const container *c, decoder *d, gbt_error *err)
{
    uint8_t has_distance;
    float numbers[DECODER_NUMBERS];
    GBT_TRY(container_get(c, "decoder.has_distance", CONTAINER_U8, 1, &has_distance, err));
    GBT_TRY(container_get(c, "decoder.numbers", CONTAINER_F32, DECODER_NUMBERS, numbers, err));
    if (has_distance > 1)
        return base_fail(err, GBT_ERR_FORMAT, "%s: section decoder.has_distance: wanted 0 or 1, got %d",
                         c->path, has_distance);
    d->has_distance = has_distance == 1;
    d->distance_scale = numbers[DECODER_DISTANCE_SCALE];
    d->distance_min = numbers[DECODER_DISTANCE_MIN];
    d->distance_max = numbers[DECODER_DISTANCE_MAX];
    return GBT_OK;
}

static gbt_status read_params(const container *c, int offset_count, decoder *d, gbt_error *err)
{
    size_t param_count = CONTAINER_ANY;
    const void *params;
    GBT_TRY(container_find(c, "decoder.params", CONTAINER_F32, 1, &param_count, &params, err));
    d->params = mem_alloc(param_count, sizeof *d->params, "decoder", err);
    if (d->params == NULL)
        return GBT_ERR_NO_MEMORY;
    if (param_count > 0)
        memcpy(d->params, params, param_count * sizeof *d->params);
    d->param_count = param_count;
    d->offset_count = offset_count;
    return GBT_OK;
}

static gbt_status read_plain(const container *c, model *m, gbt_error *err)
{
    GBT_TRY(read_anchors(c, &m->anchors, err));
    GBT_TRY(read_anchor_pixel(c, m->anchors.count, &m->anchor_pixel, err));
    GBT_TRY(read_decoder_inputs(c, &m->decoder, err));
    return read_params(c, m->anchors.offset_count, &m->decoder, err);
}

static gbt_status read_coded(const container *c, model *m, gbt_error *err)
{
    GBT_TRY(read_decoder_inputs(c, &m->decoder, err));
    return model_decode(c, m->decoder.has_distance, m, err);
}

/* The sections are missing in models with a background of one colour, those of the horizon also in models
   whose sky is all around. */
static gbt_status read_sky(const container *c, sky *out, gbt_error *err)
{
    const void *data;
    if (container_section_named(c, "scene.sky") == NULL)
        return GBT_OK;
    GBT_TRY(container_find(c, "scene.sky", CONTAINER_F32, 2, (size_t[]){SKY_HARMONICS, 3}, &data, err));
    memcpy(out->harmonic, data, sizeof out->harmonic);
    out->varies = true;
    out->has_horizon = container_section_named(c, "scene.sky_up") != NULL;
    if (!out->has_horizon)
        return GBT_OK;
    GBT_TRY(container_get(c, "scene.sky_up", CONTAINER_F32, 3, out->up, err));
    return container_get(c, "scene.sky_ground", CONTAINER_F32, 3, out->ground, err);
}

static gbt_status read_scene(const container *c, model *m, gbt_error *err)
{
    float numbers[SCENE_NUMBERS];
    GBT_TRY(container_get(c, "scene.origin", CONTAINER_F64, 3, m->origin, err));
    GBT_TRY(container_get(c, "scene.numbers", CONTAINER_F32, SCENE_NUMBERS, numbers, err));
    m->voxel_size = numbers[SCENE_VOXEL_SIZE];
    m->extent = numbers[SCENE_EXTENT];
    m->t_near = numbers[SCENE_T_NEAR];
    memcpy(m->background, numbers + SCENE_BACKGROUND, sizeof m->background);
    GBT_TRY(read_sky(c, &m->sky, err));
    GBT_TRY(container_get_text(c, "scene.data_folder", m->data_folder, sizeof m->data_folder, err));
    GBT_TRY(container_get_text(c, "train.config", m->config, sizeof m->config, err));
    return container_get(c, "train.iterations", CONTAINER_U64, 1, &m->iterations, err);
}

gbt_status model_from_container(const container *c, model *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    gbt_status status = model_is_coded(c) ? read_coded(c, out, err) : read_plain(c, out, err);
    if (status == GBT_OK)
        status = read_scene(c, out, err);
    if (status == GBT_OK)
        status = check_model(c->path, out, GBT_ERR_FORMAT, err);
    if (status != GBT_OK)
        model_free(out);
    return status;
}

gbt_status model_load(const char *path, model *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    container c;
    GBT_TRY(container_load(path, &c, err));
    const gbt_status status = model_from_container(&c, out, err);
    container_free(&c);
    return status;
}
