/* SPDX-License-Identifier: Apache-2.0 */
/* train/row_list.c -- lists of numbered rows, and their sum in the order of a binary tree. */
#include "train/row_list.h"

#include <stdbool.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { LISTS_MAX = 64, NUMBER_BLOCK = 1024, ROW_WORDS_MAX = 128 };

gbt_status row_list_resize(row_list *l, size_t count, size_t width, gbt_error *err)
{
    void *words = l->words;
    const gbt_status status = mem_reserve(&words, &l->capacity, 0, count * (1 + width) + 1, sizeof *l->words,
                                          "rows of a step", err);
    l->words = words;
    l->count = status == GBT_OK ? count : 0;
    l->width = width;
    return status;
}

void row_list_free(row_list *l)
{
    mem_free(l->words);
    *l = (row_list){0};
}

size_t row_list_find(const row_list *l, uint32_t number)
{
    size_t low = 0, high = l->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (row_list_row(l, middle)->number < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* ---- sum ---- */

typedef struct sum_job {
    const row_list *const *lists;
    size_t count;
    row_list *out;
    size_t *first; /* [blocks]: number of rows of the sum per block of numbers; later the index of each
                      block's first row */
} sum_job;

/* A simultaneous walk through all lists over the row numbers of one block (a merge). */
typedef struct walk {
    const sum_job *job;
    size_t at[LISTS_MAX], end[LISTS_MAX];
    uint32_t number;
} walk;

static walk walk_of(const sum_job *job, size_t begin, size_t end)
{
    walk w = {.job = job};
    for (size_t i = 0; i < job->count; i++) {
        w.at[i] = row_list_find(job->lists[i], (uint32_t)begin);
        w.end[i] = row_list_find(job->lists[i], (uint32_t)end);
    }
    return w;
}

/* Advance to the smallest next row number of all lists; false at the end. */
static bool walk_next(walk *w)
{
    bool found = false;
    for (size_t i = 0; i < w->job->count; i++) {
        if (w->at[i] == w->end[i])
            continue;
        const uint32_t number = row_list_row(w->job->lists[i], w->at[i])->number;
        if (!found || number < w->number)
            w->number = number;
        found = true;
    }
    return found;
}

static bool walk_has(const walk *w, size_t list)
{
    return w->at[list] < w->end[list] && row_list_row(w->job->lists[list], w->at[list])->number == w->number;
}

static void walk_pass(walk *w)
{
    for (size_t i = 0; i < w->job->count; i++)
        w->at[i] += walk_has(w, i);
}

static void count_block(size_t block, size_t begin, size_t end, void *context)
{
    const sum_job *job = context;
    walk w = walk_of(job, begin, end);
    size_t count = 0;
    for (; walk_next(&w); count++)
        walk_pass(&w);
    job->first[block] = count;
}

/* Sum of the rows with the walk's current number over `size` lists from `list` on; NULL when none of them has
   such a row. `scratch` has a row for each node of the summation tree; `node` is this one's. */
static const row_word *sum_rows(const walk *w, size_t list, size_t size, row_word *scratch, size_t node)
{
    const size_t words = 1 + w->job->out->width;
    if (size == 1)
        return walk_has(w, list) ? row_list_row(w->job->lists[list], w->at[list]) : NULL;
    const row_word *a = sum_rows(w, list, size / 2, scratch, 2 * node),
                   *b = sum_rows(w, list + size / 2, size / 2, scratch, 2 * node + 1);
    if (a == NULL || b == NULL)
        return a != NULL ? a : b;
    row_word *sum = scratch + node * words;
    sum[0] = a[0];
    for (size_t i = 1; i < words; i++)
        sum[i].value = a[i].value + b[i].value;
    return sum;
}

static void sum_block(size_t block, size_t begin, size_t end, void *context)
{
    const sum_job *job = context;
    const size_t words = 1 + job->out->width;
    row_word scratch[LISTS_MAX * ROW_WORDS_MAX]; /* nodes are numbered from 1 */
    walk w = walk_of(job, begin, end);
    for (size_t row = job->first[block]; walk_next(&w); row++) {
        memcpy(row_list_row(job->out, row), sum_rows(&w, 0, job->count, scratch, 1), words * sizeof *scratch);
        walk_pass(&w);
    }
}

gbt_status row_list_sum(const row_list *const *lists, size_t count, row_list *out, gbt_error *err)
{
    size_t numbers = 0;
    for (size_t i = 0; i < count; i++)
        if (lists[i]->count > 0) {
            const size_t last = row_list_row(lists[i], lists[i]->count - 1)->number;
            numbers = last + 1 > numbers ? last + 1 : numbers;
        }
    const size_t blocks = parallel_block_count(numbers, NUMBER_BLOCK);
    sum_job job = {.lists = lists,
                   .count = count,
                   .out = out,
                   .first = mem_alloc(blocks + 1, sizeof *job.first, "rows of a step", err)};
    if (job.first == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(numbers, NUMBER_BLOCK, count_block, &job);
    size_t rows = 0;
    for (size_t i = 0; i < blocks; i++) {
        const size_t here = job.first[i];
        job.first[i] = rows;
        rows += here;
    }
    const gbt_status status = row_list_resize(out, rows, lists[0]->width, err);
    if (status == GBT_OK)
        parallel_blocks(numbers, NUMBER_BLOCK, sum_block, &job);
    mem_free(job.first);
    return status;
}
