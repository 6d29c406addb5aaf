/* SPDX-License-Identifier: Apache-2.0 */
/* io/safetensors.h -- reads float32 arrays from a .safetensors file: u64 length of the header, JSON header,
   raw data. */
#ifndef GBT_IO_SAFETENSORS_H
#define GBT_IO_SAFETENSORS_H

#include "data/bytes.h"

/** A matrix, row-major [rows][columns]. Of an array with two to four dimensions, rows is the first size and
    columns the product of the others; a vector has one row. Start from {0}. */
typedef struct tensor {
    size_t rows, columns;
    float *values; /* owned; all finite; free with mem_free() */
} tensor;

/**
 * Read the array `name`.
 *
 * @param out [out] zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT also when the array is missing, not F32, does not have one to four
 *         dimensions, or contains a value that is not finite; GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status safetensors_read(const source_file *file, const char *name, tensor *out, gbt_error *err);

#endif
