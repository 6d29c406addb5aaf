/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_code.c -- codes a model in the two small forms, and decodes it. */
#include "io/model_code.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "io/model_parts.h"

/* Indices into coded.shape. */
enum { SHAPE_FORM, SHAPE_COUNT, SHAPE_OFFSETS, SHAPE_PIXELS, SHAPE_LEVELS, SHAPE_NUMBERS };
/* Values of SHAPE_FORM. */
enum { FORM_COARSE = 1, FORM_LOSSLESS = 2 };
/* Indices into coded.steps: the corner of the cube, the side of a cell, then the step of each column. */
enum { STEPS_ORIGIN, STEPS_CELL = 3, STEPS_COLUMNS };
/* A file that claims more anchors than ANCHORS_ALWAYS_ALLOWED + ANCHORS_PER_BYTE x its bytes is rejected
   before anything is allocated. A real anchor takes several bytes, not half a bit. */
enum { ANCHORS_ALWAYS_ALLOWED = 65536, ANCHORS_PER_BYTE = 16 };

_Static_assert(SHAPE_NUMBERS == sizeof((model_coded){0}.shape) / sizeof(uint32_t),
               "the shape has its places");

/* ---- parts ---- */

/* Append what a coder has written as the next part. */
static gbt_status add_part(model_coded *out, size_t *size, int part, range_coder *c, gbt_error *err)
{
    size_t capacity = *size; /* reallocated to the exact size each time, because there are few parts */
    GBT_TRY(coder_write_end(c, err));
    if (c->size > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "the model is too large to be coded");
    GBT_TRY(mem_reserve((void **)&out->bytes, &capacity, *size, *size + c->size, 1, "coded bytes", err));
    if (c->size > 0)
        memcpy(out->bytes + *size, c->bytes, c->size);
    *size += c->size;
    out->part_bytes[part] = (uint32_t)c->size;
    return GBT_OK;
}

static gbt_status write_parts(const model_parts *parts, model_coded *out, gbt_error *err)
{
    range_coder *c = mem_alloc(1, sizeof *c, "coder", err);
    if (c == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t size = 0;
    gbt_status status = GBT_OK;
    for (int part = 0; part < CODE_PARTS && status == GBT_OK; part++) {
        coder_write_start(c);
        status = model_parts_code(parts, (code_part)part, c, err);
        if (status == GBT_OK)
            status = add_part(out, &size, part, c, err);
        coder_free(c);
    }
    mem_free(c);
    return status;
}

static gbt_status read_parts(const model_parts *parts, const char *path, const unsigned char *bytes,
                             const uint32_t part_bytes[CODE_PARTS], gbt_error *err)
{
    static const char *const names[CODE_PARTS] = {[CODE_POSITIONS] = "positions",
                                                  [CODE_DOUBLINGS] = "doublings",
                                                  [CODE_RULES] = "rules",
                                                  [CODE_PIXELS] = "pixels",
                                                  [CODE_NETWORKS] = "networks",
#define X(part, name, field, divisor, most, of_largest) [CODE_##part] = name,
                                                  CODE_FIELD_LIST(X)
#undef X
    };
    range_coder *c = mem_alloc(1, sizeof *c, "coder", err);
    if (c == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = GBT_OK;
    for (int part = 0; part < CODE_PARTS && status == GBT_OK; bytes += part_bytes[part], part++) {
        coder_read_start(c, bytes, part_bytes[part]);
        status = model_parts_code(parts, (code_part)part, c, err);
        if (status == GBT_ERR_FORMAT || (status == GBT_OK && !coder_read_whole(c)))
            status = base_fail(err, GBT_ERR_FORMAT,
                               "%s: section coded.bytes: the part \"%s\" cannot be decoded: it is damaged",
                               path, names[part]);
    }
    mem_free(c);
    return status;
}

/* ---- writing ---- */

static gbt_status keep_steps(const model_parts *parts, model_coded *out, gbt_error *err)
{
    const size_t columns = (size_t)parts->table.columns;
    out->step_count = STEPS_COLUMNS + columns;
    out->steps = mem_alloc(out->step_count, sizeof *out->steps, "steps", err);
    if (out->steps == NULL)
        return GBT_ERR_NO_MEMORY;
    memcpy(out->steps + STEPS_ORIGIN, parts->grid.origin, sizeof parts->grid.origin);
    out->steps[STEPS_CELL] = parts->grid.cell;
    memcpy(out->steps + STEPS_COLUMNS, parts->step, columns * sizeof *out->steps);
    return GBT_OK;
}

gbt_status model_code(const model *m, const model_steps *steps, model_coded *out, model *back, gbt_error *err)
{
    const anchors *a = &m->anchors;
    *back = (model){0};
    if (a->count > UINT32_MAX / ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "too many anchors to code (%zu)", a->count);
    const uint32_t shape[] = {[SHAPE_FORM] = steps != NULL ? FORM_COARSE : FORM_LOSSLESS,
                              [SHAPE_COUNT] = (uint32_t)a->count,
                              [SHAPE_OFFSETS] = (uint32_t)a->offset_count,
                              [SHAPE_PIXELS] = m->anchor_pixel != NULL,
                              [SHAPE_LEVELS] = 0};
    memcpy(out->shape, shape, sizeof shape);
    model_parts parts = {0};
    gbt_status status = model_parts_make(&parts, a->count, a->offset_count, m->anchor_pixel != NULL,
                                         m->decoder.has_distance, steps != NULL, err);
    if (status == GBT_OK)
        status = model_parts_fill(&parts, m, steps, err);
    out->shape[SHAPE_LEVELS] = (uint32_t)parts.grid.levels;
    if (status == GBT_OK)
        status = write_parts(&parts, out, err);
    if (status == GBT_OK && steps != NULL)
        status = keep_steps(&parts, out, err);
    if (status == GBT_OK)
        status = model_parts_to_model(&parts, back, err);
    model_parts_free(&parts);
    if (status != GBT_OK)
        model_free(back);
    return status;
}

void model_add_coded(container_writer *w, const model_coded *coded)
{
    size_t size = 0;
    for (int part = 0; part < CODE_PARTS; part++)
        size += coded->part_bytes[part];
    container_add_small(w, "coded.shape", CONTAINER_U32, SHAPE_NUMBERS, coded->shape);
    if (coded->steps != NULL)
        container_add(w, "coded.steps", CONTAINER_F32, 1, &coded->step_count, coded->steps);
    container_add_small(w, "coded.parts", CONTAINER_U32, CODE_PARTS, coded->part_bytes);
    container_add(w, "coded.bytes", CONTAINER_U8, 1, &size, coded->bytes);
}

void model_coded_free(model_coded *coded)
{
    mem_free(coded->bytes);
    mem_free(coded->steps);
    *coded = (model_coded){0};
}

/* ---- reading ---- */

bool model_is_coded(const container *c) { return container_section_named(c, "coded.shape") != NULL; }

bool model_is_coarse(const container *c)
{
    uint32_t shape[SHAPE_NUMBERS];
    return model_is_coded(c) &&
           container_get(c, "coded.shape", CONTAINER_U32, SHAPE_NUMBERS, shape, NULL) == GBT_OK &&
           shape[SHAPE_FORM] == FORM_COARSE;
}

static gbt_status check_shape(const char *path, const uint32_t shape[SHAPE_NUMBERS], size_t bytes,
                              gbt_error *err)
{
    if (shape[SHAPE_FORM] != FORM_COARSE && shape[SHAPE_FORM] != FORM_LOSSLESS)
        return base_fail(
            err, GBT_ERR_FORMAT,
            "%s: section coded.shape: coded by another version of gbtrace (wanted form 1 or 2, got %u)", path,
            shape[SHAPE_FORM]);
    if (shape[SHAPE_OFFSETS] < 1 || shape[SHAPE_OFFSETS] > ANCHOR_MAX_OFFSETS || shape[SHAPE_PIXELS] > 1 ||
        shape[SHAPE_LEVELS] > POSITION_LEVELS_MAX)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: section coded.shape: %u offsets per anchor, pixel sizes %u, %u levels (wanted "
                         "1 to %d, 0 or 1, 0 to %d)",
                         path, shape[SHAPE_OFFSETS], shape[SHAPE_PIXELS], shape[SHAPE_LEVELS],
                         ANCHOR_MAX_OFFSETS, POSITION_LEVELS_MAX);
    if (shape[SHAPE_COUNT] > ANCHORS_ALWAYS_ALLOWED &&
        (shape[SHAPE_COUNT] - ANCHORS_ALWAYS_ALLOWED) / ANCHORS_PER_BYTE > bytes)
        return base_fail(err, GBT_ERR_FORMAT, "%s: section coded.shape: %u anchors cannot be in %zu bytes",
                         path, shape[SHAPE_COUNT], bytes);
    return GBT_OK;
}

static gbt_status read_steps(const container *c, model_parts *parts, gbt_error *err)
{
    const size_t columns = (size_t)parts->table.columns;
    size_t count = STEPS_COLUMNS + columns;
    const void *data;
    GBT_TRY(container_find(c, "coded.steps", CONTAINER_F32, 1, &count, &data, err));
    const float *steps = data;
    for (size_t i = 0; i < count; i++)
        if (!isfinite(steps[i]) || (i >= STEPS_CELL && !(steps[i] > 0)))
            return base_fail(err, GBT_ERR_FORMAT, "%s: section coded.steps: value %zu is not a step", c->path,
                             i);
    memcpy(parts->grid.origin, steps + STEPS_ORIGIN, sizeof parts->grid.origin);
    parts->grid.cell = steps[STEPS_CELL];
    memcpy(parts->step, steps + STEPS_COLUMNS, columns * sizeof *steps);
    return GBT_OK;
}

static gbt_status read_sizes(const container *c, uint32_t part_bytes[CODE_PARTS], size_t size, gbt_error *err)
{
    uint64_t sum = 0;
    GBT_TRY(container_get(c, "coded.parts", CONTAINER_U32, CODE_PARTS, part_bytes, err));
    for (int part = 0; part < CODE_PARTS; part++)
        sum += part_bytes[part];
    return sum == size
               ? GBT_OK
               : base_fail(err, GBT_ERR_FORMAT,
                           "%s: section coded.parts: the parts do not add up to %zu bytes", c->path, size);
}

gbt_status model_decode(const container *c, bool has_distance, model *out, gbt_error *err)
{
    uint32_t shape[SHAPE_NUMBERS], part_bytes[CODE_PARTS];
    size_t size = CONTAINER_ANY;
    const void *bytes;
    GBT_TRY(container_get(c, "coded.shape", CONTAINER_U32, SHAPE_NUMBERS, shape, err));
    GBT_TRY(container_find(c, "coded.bytes", CONTAINER_U8, 1, &size, &bytes, err));
    GBT_TRY(check_shape(c->path, shape, size, err));
    GBT_TRY(read_sizes(c, part_bytes, size, err));
    const bool coarse = shape[SHAPE_FORM] == FORM_COARSE;
    model_parts parts = {0};
    gbt_status status = model_parts_make(&parts, shape[SHAPE_COUNT], (int)shape[SHAPE_OFFSETS],
                                         shape[SHAPE_PIXELS] == 1, has_distance, coarse, err);
    parts.grid.levels = (int)shape[SHAPE_LEVELS];
    if (status == GBT_OK && coarse)
        status = read_steps(c, &parts, err);
    if (status == GBT_OK)
        status = read_parts(&parts, c->path, bytes, part_bytes, err);
    if (status == GBT_OK)
        status = model_parts_to_model(&parts, out, err);
    model_parts_free(&parts);
    return status;
}
