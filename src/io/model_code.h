/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_code.h -- the two small forms of a model file: coarse (quantized, predicted, entropy coded) and
   lossless. docs/compression.md specifies both.

   Both replace the sections of the anchors and the networks by one section of coded bytes; the other sections
   of a model file stay as they are. */
#ifndef GBT_IO_MODEL_CODE_H
#define GBT_IO_MODEL_CODE_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"
#include "io/container.h"
#include "io/model.h"
#include "io/model_steps.h"

/** The parts of the coded bytes, in order. */
typedef enum code_part {
    CODE_POSITIONS,
    CODE_DOUBLINGS, /* powers of two by which each anchor's steps are larger */
    CODE_RULES,     /* weights of the prediction */
#define X(part, name, field, divisor, most, of_largest) CODE_##part,
    CODE_FIELD_LIST(X)
#undef X
        CODE_PIXELS,
    CODE_NETWORKS,
    CODE_PARTS
} code_part;

/** A coded model; owns its bytes. Start from {0}; free with model_coded_free(). */
typedef struct model_coded {
    unsigned char *bytes; /* of all parts, one after the other */
    uint32_t part_bytes[CODE_PARTS];
    uint32_t shape[5];
    float *steps; /* NULL: lossless form */
    size_t step_count;
} model_coded;

/**
 * Code a model.
 *
 * @param m     [in]  one that model_save() accepts
 * @param steps [in]  quantization steps for this model (model_steps_at()); NULL: lossless, which also keeps
 *                    the order of the anchors
 * @param out   [out] for model_add_coded()
 * @param back  [out] the model that decoding will give: unless lossless, anchors are in Morton order of their
 *                    positions and values are rounded; free with model_free()
 * @return GBT_OK, GBT_ERR_ARGUMENT (a value cannot be coded), GBT_ERR_NO_MEMORY
 * Cost: about 40 us per anchor (K = 2). One thread; the same bytes every time.
 */
gbt_status model_code(const model *m, const model_steps *steps, model_coded *out, model *back,
                      gbt_error *err);

/** Add the sections of a coded model. `coded` is borrowed until the writer has saved. */
void model_add_coded(container_writer *w, const model_coded *coded);

void model_coded_free(model_coded *coded);

/** Whether the anchors and networks in `c` are coded, and whether in the coarse form. */
bool model_is_coded(const container *c);
bool model_is_coarse(const container *c);

/** Decode the anchors, pixel sizes and network parameters of a coded model. GBT_ERR_FORMAT for anything that
    model_code() cannot have written. The caller frees `out`, also after a failure. */
gbt_status model_decode(const container *c, bool has_distance, model *out, gbt_error *err);

#endif
