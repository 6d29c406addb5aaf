/* SPDX-License-Identifier: Apache-2.0 */
/* data/palette.c -- vector quantization: repeatedly split the cell with the largest error. */
#include "data/palette.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"

enum { AXIS_STEPS = 6, WIDTH_MAX = 64 };

/* ---- scalars ---- */

/* How many of the sorted values are below `value`. */
static size_t count_below(const float *sorted, size_t count, double value)
{
    size_t from = 0, to = count;
    while (from < to) {
        const size_t middle = (from + to) / 2;
        if ((double)sorted[middle] < value)
            from = middle + 1;
        else
            to = middle;
    }
    return from;
}

/* The sorted values with indices [begin, end), their mean, and the sum of squared distances to it. */
typedef struct range {
    size_t begin, end;
    double mean, error;
} range;

/* sums[i]: the sum of the first i values, and of their squares. */
static range range_of(const double (*sums)[2], size_t begin, size_t end)
{
    const double count = (double)(end - begin), sum = sums[end][0] - sums[begin][0];
    return (range){begin, end, sum / count, sums[end][1] - sums[begin][1] - sum * sum / count};
}

static void cut_ranges(const float *sorted, const double (*sums)[2], size_t count,
                       float levels[PALETTE_LEVELS])
{
    range ranges[PALETTE_LEVELS] = {range_of(sums, 0, count)};
    size_t used = 1;
    while (used < PALETTE_LEVELS) {
        size_t worst = 0;
        for (size_t k = 1; k < used; k++)
            worst = ranges[k].error > ranges[worst].error ? k : worst;
        const range r = ranges[worst];
        const size_t middle = r.begin + count_below(sorted + r.begin, r.end - r.begin, r.mean);
        if (!(r.error > 0))
            break;
        if (middle == r.begin || middle == r.end) { /* all values are equal; the error is rounding */
            ranges[worst].error = 0;
            continue;
        }
        ranges[worst] = range_of(sums, r.begin, middle);
        ranges[used++] = range_of(sums, middle, r.end);
    }
    for (size_t k = 0; k < PALETTE_LEVELS; k++)
        levels[k] = (float)ranges[k < used ? k : 0].mean;
    qsort(levels, PALETTE_LEVELS, sizeof *levels, compare_floats);
}

gbt_status palette_scalar_levels(const float *values, size_t count, float levels[PALETTE_LEVELS],
                                 gbt_error *err)
{
    float *sorted = mem_alloc(count, sizeof *sorted, "levels", err);
    double(*sums)[2] = mem_calloc(count + 1, sizeof *sums, "levels", err);
    const gbt_status status = sorted == NULL || sums == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK) {
        memcpy(sorted, values, count * sizeof *sorted);
        qsort(sorted, count, sizeof *sorted, compare_floats);
        for (size_t i = 0; i < count; i++) {
            const double value = (double)sorted[i];
            sums[i + 1][0] = sums[i][0] + value;
            sums[i + 1][1] = sums[i][1] + value * value;
        }
        cut_ranges(sorted, (const double(*)[2])sums, count, levels);
    }
    mem_free(sorted);
    mem_free(sums);
    return status;
}

unsigned char palette_nearest(const float levels[PALETTE_LEVELS], float value)
{
    size_t k = count_below(levels, PALETTE_LEVELS, (double)value);
    if (k == PALETTE_LEVELS || (k > 0 && value - levels[k - 1] < levels[k] - value))
        k--;
    return (unsigned char)k;
}

/* ---- vectors ---- */

/* The vectors order[begin] to order[end - 1]. */
typedef struct cell {
    size_t begin, end;
    double error;
    float mean[WIDTH_MAX];
} cell;

typedef struct cell_splitter {
    const float *vectors;
    size_t width;
    uint32_t *order, *spare;
    cell *heap; /* a max-heap by error */
    size_t count;
} cell_splitter;

static void measure(const cell_splitter *c, cell *out)
{
    double mean[WIDTH_MAX] = {0}, error = 0;
    for (size_t i = out->begin; i < out->end; i++)
        for (size_t k = 0; k < c->width; k++)
            mean[k] += (double)c->vectors[c->order[i] * c->width + k];
    for (size_t k = 0; k < c->width; k++)
        out->mean[k] = (float)(mean[k] / (double)(out->end - out->begin));
    for (size_t i = out->begin; i < out->end; i++)
        for (size_t k = 0; k < c->width; k++) {
            const double d = (double)(c->vectors[c->order[i] * c->width + k] - out->mean[k]);
            error += d * d;
        }
    out->error = out->end - out->begin > 1 ? error : 0;
}

static double along(const cell_splitter *c, const cell *from, uint32_t row, const double *axis)
{
    double sum = 0;
    for (size_t k = 0; k < c->width; k++)
        sum += (double)(c->vectors[row * c->width + k] - from->mean[k]) * axis[k];
    return sum;
}

/* The principal axis of a cell by power iteration, started with the difference of the farthest vector to the
   mean. */
static void principal_axis(const cell_splitter *c, const cell *from, double axis[WIDTH_MAX])
{
    double farthest = -1;
    for (size_t i = from->begin; i < from->end; i++) {
        double square = 0, d[WIDTH_MAX];
        for (size_t k = 0; k < c->width; k++) {
            d[k] = (double)(c->vectors[c->order[i] * c->width + k] - from->mean[k]);
            square += d[k] * d[k];
        }
        if (square > farthest) {
            farthest = square;
            memcpy(axis, d, c->width * sizeof *d);
        }
    }
    for (int step = 0; step < AXIS_STEPS; step++) {
        double next[WIDTH_MAX] = {0}, square = 0;
        for (size_t i = from->begin; i < from->end; i++) {
            const double share = along(c, from, c->order[i], axis);
            for (size_t k = 0; k < c->width; k++)
                next[k] += share * (double)(c->vectors[c->order[i] * c->width + k] - from->mean[k]);
        }
        for (size_t k = 0; k < c->width; k++)
            square += next[k] * next[k];
        if (!(square > 0))
            return;
        for (size_t k = 0; k < c->width; k++)
            axis[k] = next[k] / sqrt(square);
    }
}

/* Partition a cell by the side of the mean on which its vectors lie along the principal axis: those below
   first, each half in its old order. Returns where the second half begins. */
static size_t split_cell(const cell_splitter *c, const cell *from)
{
    double axis[WIDTH_MAX];
    principal_axis(c, from, axis);
    size_t below = from->begin, above = 0;
    for (size_t i = from->begin; i < from->end; i++) {
        if (along(c, from, c->order[i], axis) < 0)
            c->order[below++] = c->order[i];
        else
            c->spare[above++] = c->order[i];
    }
    memcpy(c->order + below, c->spare, above * sizeof *c->order);
    return below;
}

static bool goes_before(const cell *a, const cell *b)
{
    return a->error > b->error || (!(a->error < b->error) && a->begin < b->begin);
}

/* Sinks the first cell of the heap to its place. */
static void sink_down(cell_splitter *c)
{
    for (size_t at = 0, child; (child = 2 * at + 1) < c->count; at = child) {
        if (child + 1 < c->count && goes_before(&c->heap[child + 1], &c->heap[child]))
            child++;
        if (!goes_before(&c->heap[child], &c->heap[at]))
            return;
        const cell swapped = c->heap[at];
        c->heap[at] = c->heap[child];
        c->heap[child] = swapped;
    }
}

static void push(cell_splitter *c, const cell *added)
{
    size_t at = c->count++;
    for (; at > 0 && goes_before(added, &c->heap[(at - 1) / 2]); at = (at - 1) / 2)
        c->heap[at] = c->heap[(at - 1) / 2];
    c->heap[at] = *added;
}

static int by_begin(const void *a, const void *b)
{
    const cell *x = a, *y = b;
    return (x->begin > y->begin) - (x->begin < y->begin);
}

static void split_cells(cell_splitter *c, size_t count, size_t limit)
{
    cell all = {.end = count};
    for (size_t i = 0; i < count; i++)
        c->order[i] = (uint32_t)i;
    measure(c, &all);
    push(c, &all);
    while (c->count < limit && c->heap[0].error > 0) {
        cell low = c->heap[0], high = c->heap[0];
        low.end = high.begin = split_cell(c, &c->heap[0]);
        if (low.end == low.begin || high.end == high.begin) { /* the vectors do not differ measurably */
            c->heap[0].error = 0;
            sink_down(c);
            continue;
        }
        measure(c, &low);
        measure(c, &high);
        c->heap[0] = low;
        sink_down(c);
        push(c, &high);
    }
    qsort(c->heap, c->count, sizeof *c->heap, by_begin);
}

gbt_status palette_make(const float *vectors, size_t count, size_t width, size_t limit, palette *out,
                        gbt_error *err)
{
    *out = (palette){.width = width};
    cell_splitter c = {.vectors = vectors, .width = width};
    c.order = mem_alloc(count, sizeof *c.order, "a palette", err);
    c.spare = mem_alloc(count, sizeof *c.spare, "a palette", err);
    c.heap = mem_alloc(limit, sizeof *c.heap, "a palette", err);
    out->labels = mem_alloc(count, sizeof *out->labels, "a palette", err);
    gbt_status status = GBT_ERR_NO_MEMORY;
    if (c.order != NULL && c.spare != NULL && c.heap != NULL && out->labels != NULL) {
        split_cells(&c, count, limit);
        out->count = c.count;
        out->entries = mem_alloc(c.count, width * sizeof *out->entries, "a palette", err);
        status = out->entries == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    }
    for (size_t e = 0; e < c.count && status == GBT_OK; e++) {
        memcpy(out->entries + e * width, c.heap[e].mean, width * sizeof *out->entries);
        for (size_t i = c.heap[e].begin; i < c.heap[e].end; i++)
            out->labels[c.order[i]] = (uint32_t)e;
    }
    mem_free(c.order);
    mem_free(c.spare);
    mem_free(c.heap);
    if (status != GBT_OK)
        palette_free(out);
    return status;
}

void palette_free(palette *p)
{
    mem_free(p->entries);
    mem_free(p->labels);
    *p = (palette){0};
}
