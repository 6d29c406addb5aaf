/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_parts.c -- quantizes a model to integers, codes them part by part, and converts back. */
#include "io/model_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "io/float_code.h"
#include "io/half.h"

enum { PIXEL_NONE = INT32_MIN, PIXEL_LEAST = -126 * 8, PIXEL_MOST = 127 * 8, INDEX_MAX = 1 << 20 };

/* The fields in the order of their columns in the table. */
static const struct {
    code_part part;
    anchor_field field;
} coded_fields[] = {
#define X(part, name, field, divisor, most, of_largest) {CODE_##part, field},
    CODE_FIELD_LIST(X)
#undef X
};
enum { CODED_FIELDS = sizeof coded_fields / sizeof *coded_fields };

_Static_assert(CODED_FIELDS == ANCHOR_FIELDS - ANCHOR_FIRST_LEARNED, "all that learns is coded");

#define X(name, id, label, width, per_offset, meaning) +(width) * ((per_offset) ? ANCHOR_MAX_OFFSETS : 1)
_Static_assert(0 ANCHOR_FIELD_LIST(X) - 3 <= ATTRIBUTE_COLUMNS_MAX, "all but the position has its columns");
#undef X

static int field_width(const model_parts *p, int coded)
{
    return (int)row_field_width(&anchor_fields[coded_fields[coded].field], p->offset_count);
}

/* The first column of a coded field; for the index past the last field, the number of columns. */
static int first_column(const model_parts *p, int coded)
{
    int first = 0;
    for (int i = 0; i < coded; i++)
        first += field_width(p, i);
    return first;
}

/* ---- allocation ---- */

static gbt_status make_coarse(model_parts *p, bool has_pixel, gbt_error *err)
{
    GBT_TRY(attribute_table_make(&p->table, p->count, first_column(p, CODED_FIELDS), err));
    p->cell = mem_calloc(p->count, sizeof *p->cell, "cells", err);
    p->half = mem_calloc(p->param_count, sizeof *p->half, "networks", err);
    if (has_pixel)
        p->pixel = mem_calloc(p->count, sizeof *p->pixel, "pixel sizes", err);
    return p->cell == NULL || p->half == NULL || (has_pixel && p->pixel == NULL) ? GBT_ERR_NO_MEMORY : GBT_OK;
}

gbt_status model_parts_make(model_parts *p, size_t count, int offset_count, bool has_pixel, bool has_distance,
                            bool coarse, gbt_error *err)
{
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(&(decoder){.offset_count = offset_count, .has_distance = has_distance}, networks);
    *p = (model_parts){.coarse = coarse,
                       .count = count,
                       .offset_count = offset_count,
                       .has_distance = has_distance,
                       .param_count = networks[DECODER_NETWORKS - 1].end};
    if (coarse)
        return make_coarse(p, has_pixel, err);
    p->anchors.offset_count = offset_count;
    GBT_TRY(anchors_resize(&p->anchors, count, err));
    p->params = mem_calloc(p->param_count, sizeof *p->params, "networks", err);
    if (has_pixel)
        p->anchor_pixel = mem_calloc(count, sizeof *p->anchor_pixel, "pixel sizes", err);
    return p->params == NULL || (has_pixel && p->anchor_pixel == NULL) ? GBT_ERR_NO_MEMORY : GBT_OK;
}

void model_parts_free(model_parts *p)
{
    mem_free(p->cell);
    attribute_table_free(&p->table);
    mem_free(p->pixel);
    mem_free(p->half);
    anchors_free(&p->anchors);
    mem_free(p->anchor_pixel);
    mem_free(p->params);
    *p = (model_parts){0};
}

/* ---- floats to integers ---- */

typedef struct placed {
    uint64_t cell;
    uint32_t anchor;
} placed;

static int by_cell(const void *a, const void *b)
{
    const placed *x = a, *y = b;
    if (x->cell != y->cell)
        return x->cell < y->cell ? -1 : 1;
    return x->anchor < y->anchor ? -1 : x->anchor > y->anchor;
}

static gbt_status sort_anchors(model_parts *p, const model *m, double cell_wanted, placed **order,
                               gbt_error *err)
{
    p->grid = position_grid_over(m->anchors.position, p->count, cell_wanted);
    *order = mem_alloc(p->count, sizeof **order, "order of anchors", err);
    if (*order == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < p->count; i++)
        (*order)[i] = (placed){position_cell(&p->grid, m->anchors.position + 3 * i), (uint32_t)i};
    qsort(*order, p->count, sizeof **order, by_cell);
    for (size_t i = 0; i < p->count; i++)
        p->cell[i] = (*order)[i].cell;
    return GBT_OK;
}

/* Quantize rows of floats into columns [first, first + width). */
static void fill_columns(model_parts *p, const placed *order, const float *values, int first, int width,
                         const float *steps)
{
    for (int c = 0; c < width; c++) {
        double largest = 0;
        for (size_t i = 0; i < p->count; i++)
            largest = fmax(largest, fabs((double)values[i * (size_t)width + (size_t)c]));
        const float step = (float)fmin(fmax((double)steps[c], largest / INDEX_MAX), 1e38);
        p->step[first + c] = step;
        for (size_t i = 0; i < p->count; i++) {
            const int d = p->table.doubling[i];
            const double index =
                (double)values[order[i].anchor * (size_t)width + (size_t)c] / ((double)step * (1 << d));
            p->table.value[i * (size_t)p->table.columns + (size_t)(first + c)] =
                (int32_t)lrint(index) * (1 << d);
        }
    }
}

static int32_t pixel_number(float pixel)
{
    if (!(pixel > 0))
        return PIXEL_NONE;
    return (int32_t)fmin(fmax(floor(log2((double)pixel) * 8 + 0.5), PIXEL_LEAST), PIXEL_MOST);
}

static gbt_status fill_coarse(model_parts *p, const model *m, const model_steps *steps, gbt_error *err)
{
    const anchors *a = &m->anchors;
    placed *order;
    if (steps->doubling != NULL && steps->count != p->count)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "quantization steps of another model (wanted %zu anchors, got %zu)", p->count,
                         steps->count);
    GBT_TRY(sort_anchors(p, m, steps->position, &order, err));
    for (size_t i = 0; i < p->count; i++) {
        if (steps->doubling != NULL)
            p->table.doubling[i] = steps->doubling[order[i].anchor] & (ATTRIBUTE_DOUBLINGS - 1);
        if (p->pixel != NULL)
            p->pixel[i] = pixel_number(m->anchor_pixel[order[i].anchor]);
    }
    for (int i = 0; i < CODED_FIELDS; i++) {
        const anchor_field field = coded_fields[i].field;
        fill_columns(p, order, a->field[field], first_column(p, i), field_width(p, i), steps->field[field]);
    }
    for (size_t i = 0; i < p->param_count; i++)
        p->half[i] = half_from_float(m->decoder.params[i]);
    mem_free(order);
    attribute_find_near(&p->table, p->cell);
    return attribute_fit(&p->table, err);
}

static void copy_floats(float *to, const float *from, size_t count)
{
    if (count > 0)
        memcpy(to, from, count * sizeof *to);
}

gbt_status model_parts_fill(model_parts *p, const model *m, const model_steps *steps, gbt_error *err)
{
    if (m->decoder.param_count != p->param_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "the networks do not fit %d offsets per anchor",
                         p->offset_count);
    if (p->coarse)
        return fill_coarse(p, m, steps, err);
    anchors_copy(&p->anchors, &m->anchors);
    copy_floats(p->params, m->decoder.params, p->param_count);
    if (p->anchor_pixel != NULL)
        copy_floats(p->anchor_pixel, m->anchor_pixel, p->count);
    return GBT_OK;
}

/* ---- coding ---- */

static gbt_status code_pixels(const model_parts *p, range_coder *c)
{
    coder_bit_model none;
    coder_int_model left;
    int32_t last = 0;
    coder_bits_start(&none, 1);
    coder_ints_start(&left, 1);
    for (size_t i = 0; p->pixel != NULL && i < p->count; i++) {
        if (coder_adaptive(c, &none, p->pixel[i] == PIXEL_NONE)) {
            p->pixel[i] = PIXEL_NONE;
            continue;
        }
        last += coder_int_alone(c, &left, p->pixel[i] - last);
        if (last < PIXEL_LEAST || last > PIXEL_MOST)
            return GBT_ERR_FORMAT;
        p->pixel[i] = last;
    }
    return GBT_OK;
}

/* The networks as halves: sign and exponent with adaptive contexts, the mantissa as plain bits. */
static void code_networks(const model_parts *p, range_coder *c)
{
    coder_bit_model tree[64];
    coder_bits_start(tree, 64);
    for (size_t i = 0; i < p->param_count; i++) {
        const uint32_t high = coder_tree(c, tree, 6, p->half[i] >> 10);
        p->half[i] = (uint16_t)(high << 10 | coder_plain(c, 10, p->half[i] & 0x3FF));
    }
}

static gbt_status code_coarse(const model_parts *p, code_part part, range_coder *c, gbt_error *err)
{
    attribute_table table = p->table; /* a copy of the struct, whose arrays are shared and written */
    for (int i = 0; i < CODED_FIELDS; i++)
        if (coded_fields[i].part == part)
            return attribute_code_columns(c, &table, first_column(p, i), first_column(p, i + 1), err);
    gbt_status status = GBT_OK;
    switch (part) {
    case CODE_POSITIONS:
        status = positions_code(c, p->grid.levels, p->cell, p->count, err);
        if (status == GBT_OK && c->reading)
            attribute_find_near(&table, p->cell);
        return status;
    case CODE_DOUBLINGS:
        attribute_code_doublings(c, &table);
        return GBT_OK;
    case CODE_RULES:
        attribute_code_rules(c, &table);
        return GBT_OK;
    case CODE_PIXELS:
        return code_pixels(p, c);
    case CODE_NETWORKS:
        code_networks(p, c);
        return GBT_OK;
    default:
        break;
    }
    return GBT_OK;
}

static gbt_status code_lossless(const model_parts *p, code_part part, range_coder *c, gbt_error *err)
{
    const anchors *a = &p->anchors;
    for (int i = 0; i < CODED_FIELDS; i++)
        if (coded_fields[i].part == part)
            return floats_code(c, a->field[coded_fields[i].field], p->count, (size_t)field_width(p, i), err);
    switch (part) {
    case CODE_POSITIONS:
        return floats_code(c, a->position, p->count, 3, err);
    case CODE_PIXELS:
        return floats_code(c, p->anchor_pixel, p->anchor_pixel != NULL ? p->count : 0, 1, err);
    case CODE_NETWORKS:
        return floats_code(c, p->params, p->param_count, 1, err);
    default:
        break;
    }
    return GBT_OK;
}

gbt_status model_parts_code(const model_parts *p, code_part part, range_coder *c, gbt_error *err)
{
    return p->coarse ? code_coarse(p, part, c, err) : code_lossless(p, part, c, err);
}

/* ---- integers to floats ---- */

static float pixel_size(int32_t number)
{
    static const float eighths[8] = {0x1p+0f,        0x1.172b84p+0f, 0x1.306fep+0f,  0x1.4bfdaep+0f,
                                     0x1.6a09e6p+0f, 0x1.8ace54p+0f, 0x1.ae89fap+0f, 0x1.d5818ep+0f};
    return number == PIXEL_NONE
               ? 0.0f
               : ldexpf(eighths[(number - PIXEL_LEAST) % 8], (number - PIXEL_LEAST) / 8 + PIXEL_LEAST / 8);
}

static void columns_to_floats(const model_parts *p, int first, int width, float *out)
{
    for (size_t i = 0; i < p->count; i++)
        for (int c = 0; c < width; c++)
            out[i * (size_t)width + (size_t)c] =
                (float)p->table.value[i * (size_t)p->table.columns + (size_t)(first + c)] *
                p->step[first + c];
}

gbt_status model_parts_to_model(const model_parts *p, model *out, gbt_error *err)
{
    const bool has_pixel = p->pixel != NULL || p->anchor_pixel != NULL;
    out->anchors.offset_count = p->offset_count;
    GBT_TRY(anchors_resize(&out->anchors, p->count, err));
    out->decoder.params = mem_alloc(p->param_count, sizeof *out->decoder.params, "networks", err);
    out->anchor_pixel = has_pixel ? mem_alloc(p->count, sizeof *out->anchor_pixel, "pixel sizes", err) : NULL;
    if (out->decoder.params == NULL || (has_pixel && out->anchor_pixel == NULL))
        return GBT_ERR_NO_MEMORY;
    out->decoder.param_count = p->param_count;
    out->decoder.offset_count = p->offset_count;
    out->decoder.has_distance = p->has_distance;
    if (!p->coarse) {
        anchors_copy(&out->anchors, &p->anchors);
        copy_floats(out->decoder.params, p->params, p->param_count);
        if (has_pixel)
            copy_floats(out->anchor_pixel, p->anchor_pixel, p->count);
        return GBT_OK;
    }
    for (size_t i = 0; i < p->count; i++) {
        position_middle(&p->grid, p->cell[i], out->anchors.position + 3 * i);
        if (has_pixel)
            out->anchor_pixel[i] = pixel_size(p->pixel[i]);
    }
    for (int i = 0; i < CODED_FIELDS; i++)
        columns_to_floats(p, first_column(p, i), field_width(p, i),
                          out->anchors.field[coded_fields[i].field]);
    for (size_t i = 0; i < p->param_count; i++)
        out->decoder.params[i] = float_from_half(p->half[i]);
    return GBT_OK;
}
