/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_file.h -- the scene model in a file: plain, or in one of the two small forms. */
#ifndef GBT_IO_MODEL_FILE_H
#define GBT_IO_MODEL_FILE_H

#include "gbtrace/status.h"
#include "io/container.h"
#include "io/model.h"

/** Save atomically: after any failure the old file is whole. GBT_ERR_ARGUMENT if the model is not one that
    model_load() would take. */
gbt_status model_save(const char *path, const model *m, gbt_error *err);

/** Bytes of a coded model by what they hold. */
typedef struct model_sizes {
    size_t positions, features, offsets, scales, pixels, networks;
    size_t steps; /* of each anchor, and the rules of prediction */
    size_t total; /* the file: all of these, and the container with what is about the scene */
} model_sizes;

struct model_steps;

/** Of the coded model in a file of `total` bytes. GBT_ERR_FORMAT when it is none. */
gbt_status model_sizes_read(const container *c, size_t total, model_sizes *out, gbt_error *err);

/**
 * Save in one of the two small forms (docs/compression.md), then as model_save(). What the file gives back is
 * compared with what it should before anything is written.
 *
 * @param path  [in]  NULL: write nothing, only measure
 * @param steps [in]  of this model (io/model_steps.h): anchors are put in order of their positions, values
 *                    are rounded. NULL: lossless, all bits and the order are kept
 * @param sizes [out] optional (NULL)
 * @return also GBT_ERR_ARGUMENT for values that no steps can hold, GBT_ERR_INTERNAL when the comparison fails
 */
gbt_status model_save_coded(const char *path, const model *m, const struct model_steps *steps,
                            model_sizes *sizes, gbt_error *err);

/**
 * Load and check, whichever form it has: every byte by checksum, shapes, ranges, all values finite.
 *
 * @param out [out] free with model_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_IO (cannot read), GBT_ERR_FORMAT (damaged, or not a model: says which section),
 *         GBT_ERR_NO_MEMORY
 */
gbt_status model_load(const char *path, model *out, gbt_error *err);

/** The model's sections, for a file that holds more than a model. `m` is borrowed until the writer has
    saved. */
void model_add(container_writer *w, const model *m);

/** The model in a file that holds more; as model_load(). */
gbt_status model_from_container(const container *c, model *out, gbt_error *err);

#endif
