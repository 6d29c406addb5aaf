/* SPDX-License-Identifier: Apache-2.0 */
/* train/row_list.h -- a sparse matrix as a list of its nonzero rows: the gradients and statistics of the
   anchors that one view of a step, or several views together, saw. */
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

/** Resize to `count` rows with uninitialised contents. */
gbt_status row_list_resize(row_list *l, size_t count, size_t width, gbt_error *err);
void row_list_free(row_list *l);

static inline row_word *row_list_row(const row_list *l, size_t i) { return l->words + i * (1 + l->width); }

/** Number of rows with a row number below `number`. */
size_t row_list_find(const row_list *l, uint32_t number);

/**
 * The sum of `count` lists, a power of two up to 64, by a binary tree over them: (0 + 1) + (2 + 3) ... A row
 * missing from a list is zero. Because the tree is fixed, summing aligned blocks of lists first (size a power
 * of two, start a multiple of it), and then the block sums, gives the same bits.
 *
 * @param lists [in]  all of the same width; borrowed
 * @param out   [out] has a row for every number that occurs in any list
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: parallel inside, same bits for every number.
 */
gbt_status row_list_sum(const row_list *const *lists, size_t count, row_list *out, gbt_error *err);

#endif
