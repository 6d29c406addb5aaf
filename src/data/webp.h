/* SPDX-License-Identifier: Apache-2.0 */
/* data/webp.h -- 8-bit data, four values per pixel, as lossless WebP and back, with libwebp. */
#ifndef GBT_DATA_WEBP_H
#define GBT_DATA_WEBP_H

#include "data/bytes.h"

/** Four bytes per pixel; the top row first. */
typedef struct webp_table {
    int width, height;
    unsigned char *bytes; /* [height][width][4] */
} webp_table;

/**
 * Append a WebP file with exactly these bytes, including those of transparent pixels. GBT_ERR_ARGUMENT beyond
 * 16,383 pixels a side.
 */
gbt_status webp_put(sink *out, const webp_table *table, gbt_error *err);

/**
 * Read a file of at most `pixel_limit` pixels; larger ones are rejected before memory is allocated.
 *
 * @param out [out] free `bytes` with mem_free()
 */
gbt_status webp_read(const source_file *file, size_t pixel_limit, webp_table *out, gbt_error *err);

#endif
