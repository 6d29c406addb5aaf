/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_batch.c -- many queries at once: blocks of queries on all threads, and within a block in Morton
   order, so that a query finds in the caches what the one before has read. */
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/morton.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "bvh/point_tree.h"

enum {
    GRAIN_MIN = 256,
    GRAIN_MAX = 32768,
    BLOCKS_WANTED = 64,
    CODE_BITS = 10,
    SPACING_MAX = 64,
    CHECK_QUERIES = 1024
};

/* Depends on the number of queries alone, so that blocks do not depend on the threads. */
static size_t grain_of(size_t count)
{
    const size_t grain = count / BLOCKS_WANTED;
    return grain < GRAIN_MIN ? GRAIN_MIN : grain > GRAIN_MAX ? GRAIN_MAX : grain;
}

/* ---- the order in space ---- */

/* Morton code of a point in a grid over the centres; a coordinate that is NaN is in cell 0. */
static uint32_t code_of(const point_tree *tree, const double p[3])
{
    uint32_t code = 0;
    for (int j = 0; j < 3; j++) {
        const double cells = (1 << CODE_BITS) * ((p[j] - tree->lower[j]) / (tree->upper[j] - tree->lower[j]));
        const uint32_t cell = !(cells > 0)               ? 0
                              : cells < (1 << CODE_BITS) ? (uint32_t)cells
                                                         : (1 << CODE_BITS) - 1;
        code |= (uint32_t)morton_spread(cell) << j;
    }
    return code;
}

/* The queries [begin, end) in Morton order: their numbers, less `begin`, in the lower halves. NULL when
   memory ran out. */
static uint64_t *order_of(const point_tree *tree, number_array query, size_t begin, size_t end,
                          gbt_error *err)
{
    const size_t count = end - begin;
    uint64_t *order = mem_alloc(2 * count, sizeof *order, "points.order", err);
    for (size_t i = 0; i < count && order != NULL; i++) {
        double p[3];
        for (size_t j = 0; j < 3; j++)
            p[j] = number_at(query, 3 * (begin + i) + j);
        order[i] = (uint64_t)code_of(tree, p) << 32 | i;
    }
    if (order != NULL)
        point_sort(order, order + count, count, 3 * CODE_BITS);
    return order;
}

/* ---- failures: that of the first bad query is reported ---- */

typedef struct block_failure {
    gbt_error error;
    size_t query;
} block_failure;

static gbt_status first_failure(const block_failure *failure, size_t blocks, gbt_error *err)
{
    for (size_t b = 0; b < blocks; b++) {
        const block_failure *f = &failure[b];
        if (f->error.status == GBT_ERR_ARGUMENT)
            return base_fail(err, f->error.status, "query %zu: %s", f->query, f->error.text);
        if (f->error.status != GBT_OK)
            return base_fail(err, f->error.status, "%s", f->error.text);
    }
    return GBT_OK;
}

/* ---- nearest ---- */

typedef struct nearest_job {
    const point_tree *tree;
    number_array query;
    size_t k;
    bool skip_same;
    uint32_t *index;
    double *distance_squared;
    block_failure *failure; /* [blocks] */
} nearest_job;

static void nearest_block(size_t block, size_t begin, size_t end, void *context)
{
    const nearest_job *job = context;
    block_failure *failed = &job->failure[block];
    failed->query = SIZE_MAX;
    uint64_t *order = order_of(job->tree, job->query, begin, end, &failed->error);
    for (size_t n = 0; n < end - begin && order != NULL; n++) {
        const size_t i = begin + (uint32_t)order[n];
        if (n % CHECK_QUERIES == 0)
            paged_check();
        point_query q = {.what = POINTS_CONTAINING};
        for (size_t j = 0; j < 3; j++)
            q.a[j] = number_at(job->query, 3 * i + j);
        gbt_error why = {0};
        if (point_query_check(&q, &why) != GBT_OK) {
            if (i < failed->query)
                *failed = (block_failure){why, i};
            continue;
        }
        uint32_t *index = job->index + job->k * i;
        double *d2 = job->distance_squared + job->k * i;
        size_t at = point_tree_nearest(job->tree, q.a, job->k, job->skip_same ? i : SIZE_MAX, index, d2);
        for (; at < job->k; at++) {
            index[at] = UINT32_MAX;
            d2[at] = INFINITY;
        }
    }
    mem_free(order);
}

gbt_status point_tree_nearest_all(const point_tree *tree, number_array query, size_t count, size_t k,
                                  bool skip_same, uint32_t *index, double *distance_squared, gbt_error *err)
{
    const size_t grain = grain_of(count), blocks = parallel_block_count(count, grain);
    block_failure *failure = mem_calloc(blocks, sizeof *failure, "points.blocks", err);
    if (failure == NULL)
        return GBT_ERR_NO_MEMORY;
    nearest_job job = {tree, query, k, skip_same, index, distance_squared, failure};
    parallel_blocks(count, grain, nearest_block, &job);
    const gbt_status status = first_failure(failure, blocks, err);
    mem_free(failure);
    return status;
}

gbt_status points_find_nearest(const float *center, size_t center_count, const float *point, size_t count,
                               uint32_t *nearest, double *squared, gbt_error *err)
{
    point_tree *tree;
    double *own = squared == NULL ? mem_alloc(count, sizeof *own, "points.squared", err) : NULL;
    if (squared == NULL && own == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = point_tree_build(number_floats(center), (number_array){0}, center_count, &tree, err);
    if (status == GBT_OK)
        status = point_tree_nearest_all(tree, number_floats(point != NULL ? point : center), count, 1,
                                        point == NULL, nearest, squared != NULL ? squared : own, err);
    point_tree_free(tree);
    mem_free(own);
    return status;
}

/* ---- spacing ---- */

typedef struct spacing_job {
    const point_tree *tree;
    number_array position;
    size_t k;
    float *spacing;
    block_failure *failure;
} spacing_job;

static void spacing_block(size_t block, size_t begin, size_t end, void *context)
{
    const spacing_job *job = context;
    uint32_t index[SPACING_MAX];
    double d2[SPACING_MAX];
    uint64_t *order = order_of(job->tree, job->position, begin, end, &job->failure[block].error);
    for (size_t n = 0; n < end - begin && order != NULL; n++) {
        const size_t i = begin + (uint32_t)order[n];
        if (n % CHECK_QUERIES == 0)
            paged_check();
        const double p[3] = {number_at(job->position, 3 * i), number_at(job->position, 3 * i + 1),
                             number_at(job->position, 3 * i + 2)};
        const size_t found = point_tree_nearest(job->tree, p, job->k, i, index, d2);
        double sum = 0;
        for (size_t m = 0; m < found; m++)
            sum += d2[m];
        job->spacing[i] = found > 0 ? (float)sqrt(sum / (double)found) : 0;
    }
    mem_free(order);
}

gbt_status point_tree_spacing(const point_tree *tree, number_array position, size_t k, float *spacing,
                              gbt_error *err)
{
    if (k < 1 || k > SPACING_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad number of neighbours (wanted 1..%d, got %zu)",
                         (int)SPACING_MAX, k);
    const size_t grain = grain_of(tree->count), blocks = parallel_block_count(tree->count, grain);
    block_failure *failure = mem_calloc(blocks, sizeof *failure, "points.blocks", err);
    if (failure == NULL)
        return GBT_ERR_NO_MEMORY;
    spacing_job job = {tree, position, k, spacing, failure};
    parallel_blocks(tree->count, grain, spacing_block, &job);
    const gbt_status status = first_failure(failure, blocks, err);
    mem_free(failure);
    return status;
}

/* ---- lists ---- */

typedef struct answer_block {
    block_failure failure;
    uint32_t *index; /* of the block's queries, in the order in which they were worked on */
    double *value;
    size_t count, index_capacity, value_capacity;
} answer_block;

typedef struct list_job {
    const point_tree *tree;
    const point_queries *queries;
    size_t *first; /* [count + 1]: begins as the number of answers of query i at i + 1 */
    size_t *from;  /* [count]: where the answers of a query are in its block */
    answer_block *blocks;
    size_t grain;
    point_lists *out;
} list_job;

static void read3(number_array a, size_t i, double out[3])
{
    for (size_t j = 0; j < 3; j++)
        out[j] = number_at(a, 3 * i + j);
}

static point_query query_at(const point_queries *all, size_t i)
{
    point_query q = {.what = all->what, .t_min = 0, .t_max = HUGE_VAL};
    read3(all->a, i, q.a);
    if (!number_none(all->b))
        read3(all->b, i, q.b);
    if (!number_none(all->radius))
        q.radius = number_at(all->radius, i);
    if (!number_none(all->t_min))
        q.t_min = number_at(all->t_min, i);
    if (!number_none(all->t_max))
        q.t_max = number_at(all->t_max, i);
    return q;
}

static gbt_status keep(const list_job *job, answer_block *b, const point_list *list)
{
    gbt_error *err = &b->failure.error;
    GBT_TRY(mem_reserve((void **)&b->index, &b->index_capacity, b->count, b->count + list->count,
                        sizeof *b->index, "points.answers", err));
    GBT_TRY(mem_reserve((void **)&b->value, &b->value_capacity, b->count, b->count + list->count,
                        sizeof *b->value, "points.answers", err));
    const bool ray = job->queries->what == POINTS_CROSSED;
    for (size_t i = 0; i < list->count; i++) {
        b->index[b->count + i] = point_list_index(list, i);
        b->value[b->count + i] = ray ? point_list_value(list, i) : sqrt(point_list_value(list, i));
    }
    b->count += list->count;
    return GBT_OK;
}

static void list_block(size_t block, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    answer_block *b = &job->blocks[block];
    b->failure.query = SIZE_MAX;
    uint64_t *order = order_of(job->tree, job->queries->a, begin, end, &b->failure.error);
    point_list list = {0};
    for (size_t n = 0; n < end - begin && order != NULL; n++) {
        const size_t i = begin + (uint32_t)order[n];
        const point_query q = query_at(job->queries, i);
        gbt_error why = {0};
        const gbt_status status = point_tree_list(job->tree, &q, &list, &why);
        if (status == GBT_ERR_ARGUMENT) { /* the failure of the first query counts */
            if (i < b->failure.query)
                b->failure = (block_failure){why, i};
            continue;
        }
        if (status != GBT_OK) {
            b->failure = (block_failure){why, i};
            break;
        }
        job->first[i + 1] = list.count;
        job->from[i] = b->count;
        if (keep(job, b, &list) != GBT_OK)
            break;
    }
    point_list_free(&list);
    mem_free(order);
}

static void copy_block(size_t block, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    answer_block *b = &job->blocks[block];
    for (size_t i = begin; i < end; i++) {
        const size_t to = job->first[i], count = job->first[i + 1] - to;
        if (count == 0)
            continue;
        memcpy(job->out->index + to, b->index + job->from[i], count * sizeof *b->index);
        memcpy(job->out->value + to, b->value + job->from[i], count * sizeof *b->value);
    }
}

static gbt_status gather(list_job *job, size_t blocks, gbt_error *err)
{
    const size_t count = job->queries->count;
    for (size_t b = 0; b < blocks; b++)
        GBT_TRY(first_failure(&job->blocks[b].failure, 1, err));
    for (size_t i = 0; i < count; i++)
        job->first[i + 1] += job->first[i];
    point_lists *out = job->out;
    out->index = mem_alloc(job->first[count], sizeof *out->index, "points.answers", err);
    out->value = mem_alloc(job->first[count], sizeof *out->value, "points.answers", err);
    if (out->index == NULL || out->value == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(count, job->grain, copy_block, job);
    return GBT_OK;
}

gbt_status point_tree_list_all(const point_tree *tree, const point_queries *queries, point_lists *out,
                               gbt_error *err)
{
    const size_t count = queries->count, grain = grain_of(count), blocks = parallel_block_count(count, grain);
    *out = (point_lists){.count = count};
    out->first = mem_calloc(count + 1, sizeof *out->first, "points.answers", err);
    size_t *from = mem_alloc(count, sizeof *from, "points.answers", err);
    answer_block *block = mem_calloc(blocks, sizeof *block, "points.blocks", err);
    gbt_status status = GBT_ERR_NO_MEMORY;
    if (out->first != NULL && from != NULL && block != NULL) {
        list_job job = {.tree = tree,
                        .queries = queries,
                        .first = out->first,
                        .from = from,
                        .blocks = block,
                        .grain = grain,
                        .out = out};
        parallel_blocks(count, grain, list_block, &job);
        status = gather(&job, blocks, err);
    }
    for (size_t b = 0; b < blocks && block != NULL; b++) {
        mem_free(block[b].index);
        mem_free(block[b].value);
    }
    mem_free(block);
    mem_free(from);
    if (status != GBT_OK) {
        mem_free(out->first);
        mem_free(out->index);
        mem_free(out->value);
        *out = (point_lists){0};
    }
    return status;
}
