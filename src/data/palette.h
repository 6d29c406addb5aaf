/* SPDX-License-Identifier: Apache-2.0 */
/* data/palette.h -- many values told by few: 256 numbers for numbers, and vectors for vectors. */
#ifndef GBT_DATA_PALETTE_H
#define GBT_DATA_PALETTE_H

#include "gbtrace/status.h"

#include <stddef.h>
#include <stdint.h>

enum { PALETTE_LEVELS = 256 };

/** Levels with a small mean squared distance to the values, ascending: as the entries of palette_make(). At
   least one value. */
gbt_status palette_levels(const float *values, size_t count, float levels[PALETTE_LEVELS], gbt_error *err);

/** The nearest level. */
unsigned char palette_nearest(const float levels[PALETTE_LEVELS], float value);

/** Vectors for vectors. */
typedef struct palette {
    size_t count, width;
    float *entries;   /* [count][width] */
    uint32_t *labels; /* [vectors]: the entry of each */
} palette;

/**
 * At most `limit` entries: all vectors are one cell at first, then the cell with the largest squared error is
 * cut in two at its mean, across its principal axis, again and again. Entries are the means of cells; cells
 * of one branch are neighbours in the list.
 *
 * @param vectors [in] [count][width]
 * @param out     [out] free with palette_free()
 */
gbt_status palette_make(const float *vectors, size_t count, size_t width, size_t limit, palette *out,
                        gbt_error *err);
void palette_free(palette *p);

#endif
