/* SPDX-License-Identifier: Apache-2.0 */
/* io/attribute_code.h -- the quantised attributes of anchors: predicted from what is already known, what is
   left coded in contexts.

   A row is an anchor, in the Morton order of its cell; a column is a channel. Columns are written in their
   order, parts of them into coders of their own. Everything is integers: reading gives the same bits on every
   machine. */
#ifndef GBT_IO_ATTRIBUTE_CODE_H
#define GBT_IO_ATTRIBUTE_CODE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/range_coder.h"

enum {
    ATTRIBUTE_COLUMNS_MAX = 96,
    ATTRIBUTE_NEAR = 3,      /* decoded neighbours of a row */
    ATTRIBUTE_WINDOW = 256,  /* rows before it among which they are looked for */
    ATTRIBUTE_DOUBLINGS = 8, /* a row's steps are 2^d times those of its columns, d below this */
    ATTRIBUTE_MAX = 1 << 24, /* largest |value| */
    ATTRIBUTE_INPUTS_MAX = ATTRIBUTE_NEAR + ATTRIBUTE_COLUMNS_MAX,
    ATTRIBUTE_ONE = 256 /* a coefficient of 1 */
};

/** Expected value of column c in a row: (bias + sum of weight x input) / ATTRIBUTE_ONE. Inputs: column c of
    the neighbours, columns below c of the row. */
typedef struct attribute_rule {
    int32_t bias;
    int32_t weight[ATTRIBUTE_INPUTS_MAX];
} attribute_rule;

typedef struct attribute_table {
    size_t rows;
    int columns;
    int32_t *value;    /* [rows][columns], in steps of the column: a multiple of 2^doubling of the row */
    uint32_t *rest;    /* [rows][columns], scratch: |value - expected| */
    uint8_t *doubling; /* [rows] */
    uint32_t (*near)[ATTRIBUTE_NEAR]; /* [rows]: rows before, nearest first; of row 0: none */
    attribute_rule *rule;             /* [columns] */
} attribute_table;

/** Room for a table; values, doublings and rules are 0. Free with attribute_table_free(), after failure
    too. */
gbt_status attribute_table_make(attribute_table *t, size_t rows, int columns, gbt_error *err);
void attribute_table_free(attribute_table *t);

/** The nearest rows among the last ATTRIBUTE_WINDOW before each, by cells. */
void attribute_find_near(attribute_table *t, const uint64_t *codes);

/** Least squares over the whole table, rounded to 1/ATTRIBUTE_ONE. Only writing needs it. */
gbt_status attribute_fit(attribute_table *t, gbt_error *err);

/** Write or read the rules. */
void attribute_code_rules(range_coder *c, attribute_table *t);

/** Write or read the doublings. */
void attribute_code_doublings(range_coder *c, attribute_table *t);

/** Write or read columns [begin, end); those before are known. GBT_ERR_FORMAT (without a text): a value read
    is beyond ATTRIBUTE_MAX. */
gbt_status attribute_code_columns(range_coder *c, attribute_table *t, int begin, int end, gbt_error *err);

#endif
