/* SPDX-License-Identifier: Apache-2.0 */
/* io/attribute_code.h -- codes the quantized attributes of anchors: each value is predicted from those
   already known, and the prediction error is entropy coded.

   A row is an anchor, in Morton order of the anchors' cells; a column is a channel of an attribute. Columns
   are coded in order; groups of them (log-scales, offsets, features) go into separate coders. All arithmetic
   is in integers, so decoding gives the same bits on every machine. Format: docs/compression.md, "Columns".
   */
#ifndef GBT_IO_ATTRIBUTE_CODE_H
#define GBT_IO_ATTRIBUTE_CODE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/range_coder.h"

enum {
    ATTRIBUTE_COLUMNS_MAX = 96,
    ATTRIBUTE_NEAR = 3,      /* already decoded rows that predict a row */
    ATTRIBUTE_WINDOW = 256,  /* they are searched for among the ATTRIBUTE_WINDOW - 1 rows before it */
    ATTRIBUTE_DOUBLINGS = 8, /* a row's step is 2^d times the column's step, d < this */
    ATTRIBUTE_MAX = 1 << 24, /* largest |value| */
    ATTRIBUTE_INPUTS_MAX = ATTRIBUTE_NEAR + ATTRIBUTE_COLUMNS_MAX,
    ATTRIBUTE_ONE = 256 /* a weight of 1, in fixed point */
};

/** Predicted value of column c in a row: (bias + sum of weight x input) / ATTRIBUTE_ONE. The inputs are
    column c of the neighbour rows, and columns 0 to c - 1 of the row itself. */
typedef struct attribute_rule {
    int32_t bias;
    int32_t weight[ATTRIBUTE_INPUTS_MAX];
} attribute_rule;

typedef struct attribute_table {
    size_t rows;
    int columns;
    int32_t *value;      /* [rows][columns], in steps of the column; a multiple of 2^doubling of the row */
    uint32_t *abs_error; /* [rows][columns], scratch: |prediction error|, in steps of the column */
    uint8_t *doubling;   /* [rows] */
    uint32_t (*near)[ATTRIBUTE_NEAR]; /* [rows]: indices of earlier rows, nearest first; unused in row 0 */
    attribute_rule *rule;             /* [columns] */
} attribute_table;

/** Allocate a table with values, doublings and rules 0. Free with attribute_table_free(), also after a
    failure. */
gbt_status attribute_table_make(attribute_table *t, size_t rows, int columns, gbt_error *err);
void attribute_table_free(attribute_table *t);

/** For each row, find the nearest of the ATTRIBUTE_WINDOW - 1 rows before it. `codes`: Morton codes of the
    cells. */
void attribute_find_near(attribute_table *t, const uint64_t *codes);

/** Fit the rules to the whole table by least squares, rounded to 1/ATTRIBUTE_ONE. Only needed for writing. */
gbt_status attribute_fit(attribute_table *t, gbt_error *err);

/** Write or read the rules. */
void attribute_code_rules(range_coder *c, attribute_table *t);

/** Write or read the doublings. */
void attribute_code_doublings(range_coder *c, attribute_table *t);

/** Write or read columns [begin, end); the columns before are known. GBT_ERR_FORMAT (without a text) when a
    decoded value is beyond ATTRIBUTE_MAX. */
gbt_status attribute_code_columns(range_coder *c, attribute_table *t, int begin, int end, gbt_error *err);

#endif
