/* SPDX-License-Identifier: Apache-2.0 */
/* train/row_list.h -- numbered rows of floats, those that are not all zero: what one view of a step, or
   several together, say of the anchors that they saw. */
#ifndef GBT_TRAIN_ROW_LIST_H
#define GBT_TRAIN_ROW_LIST_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef union row_word {
    uint32_t number;
    float value;
} row_word;

/** Rows in ascending order of their numbers. Start from {0}; free with row_list_free(). */
typedef struct row_list {
    size_t count, width; /* a row is its number and `width` values */
    row_word *words;     /* owned, [count][1 + width] */
    size_t capacity;     /* words */
} row_list;

/** Makes room for `count` rows, whose words are not set. */
gbt_status row_list_resize(row_list *l, size_t count, size_t width, gbt_error *err);
void row_list_free(row_list *l);

static inline row_word *row_list_row(const row_list *l, size_t i) { return l->words + i * (1 + l->width); }

/** How many rows have a number below `number`. */
size_t row_list_find(const row_list *l, uint32_t number);

/**
 * The sum of `count` lists, a power of two up to 64, by a binary tree over them: (0 + 1) + (2 + 3) ... A
 * row that a list lacks is zero there, so summing blocks of lists that begin at multiples of their size, and
 * then the sums, gives the same bits.
 *
 * @param lists [in]  of one width; borrowed
 * @param out   [out] a row for every number that any list has
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: parallel inside, same bits for every number.
 */
gbt_status row_list_sum(const row_list *const *lists, size_t count, row_list *out, gbt_error *err);

#endif
