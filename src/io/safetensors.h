/* SPDX-License-Identifier: Apache-2.0 */
/* io/safetensors.h -- arrays of float32 out of a .safetensors file: u64 length, JSON header, raw data. */
#ifndef GBT_IO_SAFETENSORS_H
#define GBT_IO_SAFETENSORS_H

#include "data/bytes.h"

/** Row-major [rows][columns]: the first size of up to four, and the product of the others; a vector has one
    row. Start from {0}. */
typedef struct tensor {
    size_t rows, columns;
    float *values; /* owned; all finite; free with mem_free() */
} tensor;

/**
 * Read the array `name`.
 *
 * @param out [out] zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT also when it is not there, not F32, not of one to four dimensions, or holds
 *         a value that is not finite; GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status safetensors_read(const source_file *file, const char *name, tensor *out, gbt_error *err);

#endif
