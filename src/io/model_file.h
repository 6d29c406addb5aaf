/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_file.h -- saves and loads a model: uncompressed, or in one of the two small forms. */
#ifndef GBT_IO_MODEL_FILE_H
#define GBT_IO_MODEL_FILE_H

#include "gbtrace/status.h"
#include "io/container.h"
#include "io/model.h"

/** Save atomically: after any failure the old file is intact. GBT_ERR_ARGUMENT if model_load() would reject
    the model. */
gbt_status model_save(const char *path, const model *m, gbt_error *err);

/** How many bytes of a coded model each kind of content takes. */
typedef struct model_sizes {
    size_t positions, features, offsets, scales, pixels, networks;
    size_t steps; /* doublings of each anchor, and the prediction rules */
    size_t total; /* the file: all of these, the container, and the sections about the scene */
} model_sizes;

struct model_steps;

/** The sizes in a coded model, whose file has `total` bytes. GBT_ERR_FORMAT when it is not coded. */
gbt_status model_sizes_read(const container *c, size_t total, model_sizes *out, gbt_error *err);

/**
 * Save in one of the two small forms (docs/compression.md), otherwise as model_save(). Before anything is
 * written, the coded model is decoded and compared with the expected result.
 *
 * @param path  [in]  NULL: write nothing, only measure
 * @param steps [in]  quantization steps for this model (io/model_steps.h): anchors are sorted by position and
 *                    values are rounded. NULL: lossless, which also keeps the order
 * @param sizes [out] optional (NULL)
 * @return also GBT_ERR_ARGUMENT for values that cannot be quantized, GBT_ERR_INTERNAL when the comparison
 *         fails
 */
gbt_status model_save_coded(const char *path, const model *m, const struct model_steps *steps,
                            model_sizes *sizes, gbt_error *err);

/**
 * Load a model in any of the three forms and check it: checksums of all bytes, shapes, ranges, all values
 * finite.
 *
 * @param out [out] free with model_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_IO (cannot read), GBT_ERR_FORMAT (damaged, or not a model: says which section),
 *         GBT_ERR_NO_MEMORY
 */
gbt_status model_load(const char *path, model *out, gbt_error *err);

/** Add the model's sections to a file that also holds other things. `m` is borrowed until the writer has
    saved. */
void model_add(container_writer *w, const model *m);

/** Read the model from a file that also holds other things; otherwise as model_load(). */
gbt_status model_from_container(const container *c, model *out, gbt_error *err);

#endif
