/* SPDX-License-Identifier: Apache-2.0 */
/* data/palette.h -- quantization with palettes: 256 levels for scalars, codebooks for vectors. */
#ifndef GBT_DATA_PALETTE_H
#define GBT_DATA_PALETTE_H

#include "gbtrace/status.h"

#include <stddef.h>
#include <stdint.h>

enum { PALETTE_LEVELS = 256 };

/** 256 levels, ascending, with a small mean squared distance to the values; chosen by splitting as in
    palette_make(). There must be at least one value. */
gbt_status palette_scalar_levels(const float *values, size_t count, float levels[PALETTE_LEVELS],
                                 gbt_error *err);

/** The index of the nearest level. */
unsigned char palette_nearest(const float levels[PALETTE_LEVELS], float value);

/** A codebook, and the entry of each vector. */
typedef struct palette {
    size_t count, width;
    float *entries;   /* [count][width] */
    uint32_t *labels; /* [vectors]: index of the entry for each vector */
} palette;

/**
 * Make a codebook of at most `limit` entries. All vectors start in one cell; the cell with the largest
 * squared error is split again and again, at its mean, perpendicular to its principal axis. The entries are
 * the means of the cells, in an order that keeps the cells of a split close together.
 *
 * @param vectors [in] [count][width]
 * @param out     [out] free with palette_free()
 */
gbt_status palette_make(const float *vectors, size_t count, size_t width, size_t limit, palette *out,
                        gbt_error *err);
void palette_free(palette *p);

#endif
