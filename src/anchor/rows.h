/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/rows.h -- float arrays with one row per anchor that are resized together, and the description of
   their rows. */
#ifndef GBT_ANCHOR_ROWS_H
#define GBT_ANCHOR_ROWS_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

enum { ROWS_FIELDS_MAX = 16, ROWS_DIMS_MAX = 3 };

typedef struct row_field {
    const char *name;  /* name of its section in files */
    const char *label; /* name in messages */
    size_t width;      /* floats per anchor, or, with per_offset, */
    bool per_offset;   /* floats for each of the anchor's K Gaussians */
} row_field;

/** Floats in one row. */
static inline size_t row_field_width(const row_field *field, int offset_count)
{
    return field->width * (field->per_offset ? (size_t)offset_count : 1);
}

/** The shape of `count` rows: [count], then [K] if per_offset, then [width] if that is not 1. Returns the
    number of dimensions. */
int row_field_dims(const row_field *field, size_t count, size_t offset_count, size_t dims[ROWS_DIMS_MAX]);

/**
 * Resize every array to `count` rows: the first min(used, count) are kept, the others are zero.
 *
 * @param arrays      [in,out] [field_count], owned by the caller, freed by mem_free(); NULL at the start
 * @param fields      [in] [field_count] description of the rows; at most ROWS_FIELDS_MAX
 * @param capacity    [in,out] rows allocated; grows by half at least
 * @return GBT_OK or GBT_ERR_NO_MEMORY: then nothing has changed
 */
gbt_status rows_resize(float **arrays, const row_field *fields, int field_count, int offset_count,
                       size_t *capacity, size_t used, size_t count, const char *what, gbt_error *err);

/** The rows source[0] < source[1] < ... become the first `count` of every array. Threads: uses several. */
void rows_keep(float *const *arrays, const row_field *fields, int field_count, int offset_count,
               const size_t *source, size_t count);

#endif
