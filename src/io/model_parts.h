/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_parts.h -- a model as the numbers that its parts of bytes hold: quantised, or its floats. */
#ifndef GBT_IO_MODEL_PARTS_H
#define GBT_IO_MODEL_PARTS_H

#include "io/attribute_code.h"
#include "io/model_code.h"
#include "io/position_code.h"

typedef struct model_parts {
    bool coarse;
    size_t count;
    int offset_count;
    bool has_distance;
    /* coarse: anchors in the order of their cells */
    position_grid grid;
    uint64_t *cell;        /* [count] */
    attribute_table table; /* columns: CODE_FIELD_LIST */
    float step[ATTRIBUTE_COLUMNS_MAX];
    int32_t *pixel; /* [count], optional: eighths of a doubling, or PIXEL_NONE */
    uint16_t *half; /* [param_count]: the networks */
    /* lossless */
    anchors anchors;
    float *anchor_pixel;
    float *params;
    size_t param_count;
} model_parts;

/** Room for a model of that shape. Start from {0}; free with model_parts_free(), after failure too. */
gbt_status model_parts_make(model_parts *p, size_t count, int offset_count, bool has_pixel, bool has_distance,
                            bool coarse, gbt_error *err);
void model_parts_free(model_parts *p);

/** The numbers of a model. Steps are widened where a value would be beyond ATTRIBUTE_MAX of them. */
gbt_status model_parts_fill(model_parts *p, const model *m, const model_steps *steps, gbt_error *err);

/** Write or read one part; those before are known. GBT_ERR_FORMAT (without a text) for what no writing
    gives. */
gbt_status model_parts_code(const model_parts *p, code_part part, range_coder *c, gbt_error *err);

/** Anchors, pixels and parameters as floats: each is a number times a step, once rounded. Other fields of
    `out` are left; what it owned is not freed. */
gbt_status model_parts_to_model(const model_parts *p, model *out, gbt_error *err);

#endif
