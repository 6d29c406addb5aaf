/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_parts.h -- a model in the representation that is coded: quantized to integers, or lossless as
   floats. */
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
    /* coarse form: anchors are in Morton order of their cells */
    position_grid grid;
    uint64_t *cell;        /* [count] */
    attribute_table table; /* columns: CODE_FIELD_LIST */
    float step[ATTRIBUTE_COLUMNS_MAX];
    int32_t *pixel; /* [count], optional: log2 of the pixel size in eighths, or PIXEL_NONE */
    uint16_t *half; /* [param_count]: the parameters of the networks as halves */
    /* lossless form */
    anchors anchors;
    float *anchor_pixel;
    float *params;
    size_t param_count;
} model_parts;

/** Allocate for a model of this shape. Start from {0}; free with model_parts_free(), also after a failure. */
gbt_status model_parts_make(model_parts *p, size_t count, int offset_count, bool has_pixel, bool has_distance,
                            bool coarse, gbt_error *err);
void model_parts_free(model_parts *p);

/** Quantize a model. A step is widened where a value would be more than ATTRIBUTE_MAX steps. */
gbt_status model_parts_fill(model_parts *p, const model *m, const model_steps *steps, gbt_error *err);

/** Write or read one part; the parts before are known. GBT_ERR_FORMAT (without a text) for bytes that no
    writer produces. */
gbt_status model_parts_code(const model_parts *p, code_part part, range_coder *c, gbt_error *err);

/** Convert anchors, pixel sizes and parameters to floats: each is an integer times a step, rounded once.
    Other fields of `out` are not touched, and nothing that it owned is freed. */
gbt_status model_parts_to_model(const model_parts *p, model *out, gbt_error *err);

#endif
