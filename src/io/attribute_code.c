/* SPDX-License-Identifier: Apache-2.0 */
/* io/attribute_code.c -- predicts and codes the quantized attributes of anchors. */
#include "io/attribute_code.h"

#include <stdbool.h>

#include "base/memory.h"
#include "io/position_code.h"

enum { BUCKETS = 14, RECENT = 4 };

gbt_status attribute_table_make(attribute_table *t, size_t rows, int columns, gbt_error *err)
{
    *t = (attribute_table){.rows = rows, .columns = columns};
    const size_t cells = (size_t)columns * sizeof *t->value;
    t->value = mem_calloc(rows, cells, "quantized attributes", err);
    t->abs_error = mem_calloc(rows, cells, "quantized attributes", err);
    t->doubling = mem_calloc(rows, sizeof *t->doubling, "quantized attributes", err);
    t->near = mem_calloc(rows, sizeof *t->near, "neighbours", err);
    t->rule = mem_calloc((size_t)columns, sizeof *t->rule, "prediction rules", err);
    return t->value == NULL || t->abs_error == NULL || t->doubling == NULL || t->near == NULL ||
                   t->rule == NULL
               ? GBT_ERR_NO_MEMORY
               : GBT_OK;
}

void attribute_table_free(attribute_table *t)
{
    mem_free(t->value);
    mem_free(t->abs_error);
    mem_free(t->doubling);
    mem_free(t->near);
    mem_free(t->rule);
    *t = (attribute_table){0};
}

/* ---- neighbours ---- */

void attribute_find_near(attribute_table *t, const uint64_t *codes)
{
    int32_t cells[ATTRIBUTE_WINDOW][3];
    for (size_t i = 0; i < t->rows; i++) {
        uint32_t own[3];
        uint64_t best[ATTRIBUTE_NEAR] = {UINT64_MAX, UINT64_MAX, UINT64_MAX};
        position_split(codes[i], own);
        for (size_t back = 1; back < ATTRIBUTE_WINDOW && back <= i; back++) {
            const int32_t *other = cells[(i - back) % ATTRIBUTE_WINDOW];
            uint64_t apart = 0;
            for (int k = 0; k < 3; k++) {
                const int64_t d = (int64_t)own[k] - other[k];
                apart += (uint64_t)(d * d);
            }
            if (apart >= best[ATTRIBUTE_NEAR - 1])
                continue;
            int place = ATTRIBUTE_NEAR - 1;
            for (; place > 0 && apart < best[place - 1]; place--) {
                best[place] = best[place - 1];
                t->near[i][place] = t->near[i][place - 1];
            }
            best[place] = apart;
            t->near[i][place] = (uint32_t)(i - back);
        }
        for (int k = 1; k < ATTRIBUTE_NEAR; k++) /* the first rows have fewer neighbours */
            if (best[k] == UINT64_MAX)
                t->near[i][k] = t->near[i][0];
        for (int k = 0; k < 3; k++)
            cells[i % ATTRIBUTE_WINDOW][k] = (int32_t)own[k];
    }
}

/* ---- one value ---- */

/* The predicted value of a column. Rounding relies on right shifts of negative numbers rounding down, as all
   supported compilers do. */
static int64_t expect(const attribute_table *t, size_t row, size_t column)
{
    const size_t columns = (size_t)t->columns;
    const attribute_rule *rule = &t->rule[column];
    const int32_t *own = t->value + row * columns;
    int64_t sum = rule->bias;
    for (size_t k = 0; row > 0 && k < ATTRIBUTE_NEAR; k++)
        sum += (int64_t)rule->weight[k] * t->value[t->near[row][k] * columns + column];
    for (size_t j = 0; j < column; j++)
        sum += (int64_t)rule->weight[ATTRIBUTE_NEAR + j] * own[j];
    sum = (sum + ATTRIBUTE_ONE / 2) >> 8;
    return sum > ATTRIBUTE_MAX ? ATTRIBUTE_MAX : sum < -ATTRIBUTE_MAX ? -ATTRIBUTE_MAX : sum;
}

/* About twice the base-2 logarithm: a bucket each for 0, 1, 2, 3, 4-5, 6-7, 8-11, ... */
static size_t bucket(uint64_t x)
{
    if (x < 2)
        return (size_t)x;
    const int high = 63 - __builtin_clzll(x);
    const size_t b = (size_t)(2 * high) + (x >> (high - 1) & 1);
    return b < BUCKETS ? b : BUCKETS - 1;
}

/* ---- contexts ---- */

typedef struct column_models {
    coder_int_model by_step[ATTRIBUTE_DOUBLINGS];
    coder_int_model by_near[BUCKETS];
    coder_int_mixer mixer;
} column_models;

typedef struct attribute_models {
    coder_int_model by_row[BUCKETS][ATTRIBUTE_DOUBLINGS]; /* shared by all columns of a part */
    column_models column[];
} attribute_models;

static attribute_models *make_models(int columns, gbt_error *err)
{
    attribute_models *m =
        mem_alloc(1, sizeof *m + (size_t)columns * sizeof *m->column, "attribute contexts", err);
    if (m == NULL)
        return NULL;
    coder_ints_start(&m->by_row[0][0], BUCKETS * ATTRIBUTE_DOUBLINGS);
    for (int c = 0; c < columns; c++) {
        coder_ints_start(m->column[c].by_step, ATTRIBUTE_DOUBLINGS);
        coder_ints_start(m->column[c].by_near, BUCKETS);
        coder_mixers_start(m->column[c].mixer.bin, CODER_INT_BINS);
    }
    return m;
}

/* A context from the neighbours' prediction errors in this column, in steps of this row. */
static size_t bucket_near(const attribute_table *t, size_t row, size_t column)
{
    const size_t columns = (size_t)t->columns;
    uint64_t sum = 0;
    for (size_t k = 0; row > 0 && k < ATTRIBUTE_NEAR; k++)
        sum += t->abs_error[t->near[row][k] * columns + column];
    return bucket(sum >> t->doubling[row]);
}

gbt_status attribute_code_columns(range_coder *c, attribute_table *t, int begin, int end, gbt_error *err)
{
    attribute_models *m = make_models(end - begin, err);
    if (m == NULL)
        return GBT_ERR_NO_MEMORY;
    const size_t columns = (size_t)t->columns;
    bool good = true;
    for (size_t row = 0; row < t->rows && good; row++) {
        const int d = t->doubling[row];
        uint32_t recent[RECENT] = {0}; /* prediction errors| of the last columns of this row, in its steps */
        for (int column = begin; column < end && good; column++) {
            const size_t at = row * columns + (size_t)column;
            column_models *own = &m->column[column - begin];
            const int64_t expected = expect(t, row, (size_t)column);
            const int32_t base = (int32_t)((expected + (INT64_C(1) << d) / 2) >> d);
            uint64_t sum = 0;
            for (int k = 0; k < RECENT; k++)
                sum += recent[k];
            const size_t near = bucket_near(t, row, (size_t)column);
            coder_int_model *const models[CODER_INPUTS] = {&own->by_step[d], &own->by_near[near],
                                                           &m->by_row[bucket(sum)][d]};
            const int32_t left = coder_int(c, models, &own->mixer, t->value[at] / (1 << d) - base);
            const int64_t value = ((int64_t)base + left) * (1 << d);
            good = value >= -ATTRIBUTE_MAX && value <= ATTRIBUTE_MAX;
            t->value[at] = good ? (int32_t)value : 0;
            t->abs_error[at] = (uint32_t)(left < 0 ? -left : left) << d;
            recent[column % RECENT] = (uint32_t)(left < 0 ? -left : left);
        }
    }
    mem_free(m);
    return good ? GBT_OK : GBT_ERR_FORMAT;
}

/* ---- side information ---- */

void attribute_code_doublings(range_coder *c, attribute_table *t)
{
    coder_bit_model trees[ATTRIBUTE_DOUBLINGS][ATTRIBUTE_DOUBLINGS][ATTRIBUTE_DOUBLINGS];
    coder_bits_start(&trees[0][0][0], sizeof trees / sizeof(coder_bit_model));
    for (size_t row = 0; row < t->rows; row++) {
        const uint32_t *near = t->near[row];
        const int first = row > 0 ? t->doubling[near[0]] : 0, second = row > 0 ? t->doubling[near[1]] : 0;
        t->doubling[row] = (uint8_t)coder_tree(c, trees[first][second], 3, t->doubling[row]);
    }
}

void attribute_code_rules(range_coder *c, attribute_table *t)
{
    coder_int_model bias, near, other;
    coder_ints_start(&bias, 1);
    coder_ints_start(&near, 1);
    coder_ints_start(&other, 1);
    for (int column = 0; column < t->columns; column++) {
        attribute_rule *rule = &t->rule[column];
        rule->bias = coder_int_alone(c, &bias, rule->bias);
        for (int k = 0; k < ATTRIBUTE_NEAR + column; k++)
            rule->weight[k] = coder_int_alone(c, k < ATTRIBUTE_NEAR ? &near : &other, rule->weight[k]);
    }
}
