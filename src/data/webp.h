/* SPDX-License-Identifier: Apache-2.0 */
/* data/webp.h -- numbers of 8 bits, four to a pixel, as lossless WebP and back, by libwebp. */
#ifndef GBT_DATA_WEBP_H
#define GBT_DATA_WEBP_H

#include "data/bytes.h"

/** Four bytes for each pixel, rows from the top. */
typedef struct webp_table {
    int width, height;
    unsigned char *bytes; /* [height][width][4] */
} webp_table;

/** Put a file with exactly these bytes, invisible pixels' too. GBT_ERR_ARGUMENT beyond 16,383 pixels a side.
 */
gbt_status webp_put(sink *out, const webp_table *table, gbt_error *err);

/**
 * Read one of `pixel_limit` pixels at most: larger ones are refused before memory is taken.
 *
 * @param out [out] free `bytes` with mem_free()
 */
gbt_status webp_read(const source_file *file, size_t pixel_limit, webp_table *out, gbt_error *err);

#endif
