/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_code.h -- the two small forms of a model file: coarse (quantised, predicted, coded) and lossless.
   docs/compression.md

   Both put the anchors and the networks into one section of bytes; what else a model file holds stays as it
   is. */
#ifndef GBT_IO_MODEL_CODE_H
#define GBT_IO_MODEL_CODE_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"
#include "io/container.h"
#include "io/model.h"
#include "io/model_steps.h"

/** The parts of the bytes, in their order. */
typedef enum code_part {
    CODE_POSITIONS,
    CODE_DOUBLINGS, /* of the steps of each anchor */
    CODE_RULES,     /* of prediction */
#define X(part, name, field, divisor, most, of_largest) CODE_##part,
    CODE_FIELD_LIST(X)
#undef X
        CODE_PIXELS,
    CODE_NETWORKS,
    CODE_PARTS
} code_part;

/** A model as it is written; owns its bytes. Start from {0}; free with model_coded_free(). */
typedef struct model_coded {
    unsigned char *bytes; /* of all parts */
    uint32_t part_bytes[CODE_PARTS];
    uint32_t shape[5];
    float *steps; /* NULL: lossless */
    size_t step_count;
} model_coded;

/**
 * Code a model.
 *
 * @param m     [in]  one that model_save() takes
 * @param steps [in]  of this model (model_steps_at()); NULL: lossless, every float and the order of anchors
 *                    are kept
 * @param out   [out] for model_add_coded()
 * @param back  [out] what reading will give: anchors in the Morton order of their positions, other values
 *                    rounded; free with model_free()
 * @return GBT_OK, GBT_ERR_ARGUMENT (a value cannot be coded), GBT_ERR_NO_MEMORY
 * Cost: about 40 us per anchor (K = 2). One thread; the same bytes every time.
 */
gbt_status model_code(const model *m, const model_steps *steps, model_coded *out, model *back,
                      gbt_error *err);

/** The sections; `coded` is borrowed until the writer has saved. */
void model_add_coded(container_writer *w, const model_coded *coded);

void model_coded_free(model_coded *coded);

/** Are the anchors and networks in `c` coded, and are they coarse? */
bool model_is_coded(const container *c);
bool model_is_coarse(const container *c);

/** Anchors, pixels and networks' parameters of a coded model. GBT_ERR_FORMAT for anything that model_code()
    did not write; `out` is then to be freed. */
gbt_status model_decode(const container *c, bool has_distance, model *out, gbt_error *err);

#endif
