/* SPDX-License-Identifier: Apache-2.0 */
/* cells/store.c -- a .ply, row by row into the chunks of a k-d tree.

   a sample of the rows --> cuts of the tree
   all rows, batch by batch --> checked --> chunk of each --> its buffer --> extents of the temporary file */
#include "cells/store.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "data/gaussian_ply.h"

enum {
    BLOCK = 2048, /* rows that are read together */
    BATCH = 16,   /* blocks in memory */
    SAMPLE_BLOCKS = 128,
    SAMPLE_ROWS = 1024, /* of each of these blocks */
    CHUNKS_MOST = 8192,
    CHUNK_ROWS = 16384,
    EXTENT_BYTES = 65536
};

typedef struct block_rows {
    unsigned char *bytes;
    gaussian_cloud cloud;
    uint32_t *number; /* [BLOCK] */
    float *sigma;     /* [BLOCK][3] */
    gbt_status status;
    gbt_error error;
} block_rows;

typedef struct sorting {
    cell_store *store;
    gaussian_ply_parts ply;
    size_t first; /* row of the batch */
    block_rows *blocks;
    float *sample; /* [sample_count][3] means */
    size_t sample_count;
    float *buffer; /* [chunk_count][extent_rows][row_floats] */
    size_t extent_rows;
    uint32_t *buffered; /* [chunk_count] */
    gaussian_cloud all; /* what was left out, for the warning */
} sorting;

/* ---- rows ---- */

static void find_sigmas(block_rows *b)
{
    for (size_t i = 0; i < b->cloud.count; i++) {
        const float *l = b->cloud.scale_log + 3 * i, *q = b->cloud.quat + 4 * i;
        const double unit[4] = {(double)q[0], (double)q[1], (double)q[2], (double)q[3]};
        double m[9], s[3];
        dquat_to_matrix(unit, m);
        for (int k = 0; k < 3; k++)
            s[k] = exp((double)l[k]);
        for (size_t row = 0; row < 3; row++) {
            double square = 0;
            for (size_t k = 0; k < 3; k++)
                square += m[3 * row + k] * m[3 * row + k] * s[k] * s[k];
            b->sigma[3 * i + row] = (float)(sqrt(square) * (1 + 1e-6));
        }
    }
}

static void read_block(size_t block, size_t begin, size_t end, void *context)
{
    sorting *s = context;
    block_rows *b = &s->blocks[block];
    b->status =
        gaussian_ply_part(&s->ply, s->first + begin, end - begin, b->bytes, &b->cloud, b->number, &b->error);
    if (b->status == GBT_OK)
        find_sigmas(b);
}

static gbt_status reserve_blocks(sorting *s, gbt_error *err)
{
    s->blocks = mem_calloc(BATCH, sizeof *s->blocks, "rows of Gaussians", err);
    if (s->blocks == NULL)
        return GBT_ERR_NO_MEMORY;
    for (int i = 0; i < BATCH; i++) {
        block_rows *b = &s->blocks[i];
        GBT_TRY(gaussian_cloud_alloc(&b->cloud, BLOCK, err));
        b->bytes = mem_alloc(BLOCK, s->ply.row_bytes, "rows of Gaussians", err);
        b->number = mem_alloc(BLOCK, sizeof *b->number, "rows of Gaussians", err);
        b->sigma = mem_alloc(BLOCK, 3 * sizeof *b->sigma, "rows of Gaussians", err);
        if (b->bytes == NULL || b->number == NULL || b->sigma == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    return GBT_OK;
}

/* ---- the tree ---- */

/* A sample of the means: runs of rows all over the file. */
static gbt_status read_sample(sorting *s, gbt_error *err)
{
    const size_t count = s->ply.count, wanted = (size_t)SAMPLE_BLOCKS * SAMPLE_ROWS;
    const size_t parts = count <= wanted ? parallel_block_count(count, SAMPLE_ROWS) : SAMPLE_BLOCKS;
    s->sample = mem_alloc(wanted, 3 * sizeof *s->sample, "sample of Gaussians", err);
    if (s->sample == NULL)
        return GBT_ERR_NO_MEMORY;
    block_rows *b = &s->blocks[0];
    for (size_t i = 0; i < parts; i++) {
        const size_t first =
                         count <= wanted ? i * SAMPLE_ROWS : (count - SAMPLE_ROWS) / (SAMPLE_BLOCKS - 1) * i,
                     left = count - first, rows = left < SAMPLE_ROWS ? left : SAMPLE_ROWS;
        GBT_TRY(gaussian_ply_part(&s->ply, first, rows, b->bytes, &b->cloud, b->number, err));
        memcpy(s->sample + 3 * s->sample_count, b->cloud.mean, 3 * b->cloud.count * sizeof *s->sample);
        s->sample_count += b->cloud.count;
    }
    b->cloud.dropped = b->cloud.identity_rotations = b->cloud.scales_clamped = 0; /* they are counted later */
    return GBT_OK;
}

static int by_x(const void *a, const void *b) { return compare_floats(a, b); }
static int by_y(const void *a, const void *b)
{
    return compare_floats((const float *)a + 1, (const float *)b + 1);
}
static int by_z(const void *a, const void *b)
{
    return compare_floats((const float *)a + 2, (const float *)b + 2);
}

/* Cuts a node, and those below it, along the widest axis of its sample, at the median. */
static void cut_node(cell_store *store, size_t node, float *sample, size_t count)
{
    static int (*const by[3])(const void *, const void *) = {by_x, by_y, by_z};
    if (node >= store->chunk_count - 1)
        return;
    float low[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, high[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3; k++) {
            low[k] = fminf(low[k], sample[3 * i + k]);
            high[k] = fmaxf(high[k], sample[3 * i + k]);
        }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (high[k] - low[k] > high[axis] - low[axis])
            axis = k;
    if (count > 0)
        qsort(sample, count, 3 * sizeof *sample, by[axis]);
    const size_t middle = count / 2;
    store->cuts[node] = (cell_cut){axis, count > 0 ? sample[3 * middle + (size_t)axis] : 0};
    cut_node(store, 2 * node + 1, sample, middle);
    cut_node(store, 2 * node + 2, sample + 3 * middle, count - middle);
}

static size_t chunk_of(const cell_store *store, const float mean[3])
{
    size_t node = 0;
    while (node < store->chunk_count - 1)
        node = 2 * node + (mean[store->cuts[node].axis] < store->cuts[node].at ? 1 : 2);
    return node - (store->chunk_count - 1);
}

static gbt_status plan(sorting *s, size_t memory, size_t chunk_rows, gbt_error *err)
{
    cell_store *store = s->store;
    const size_t wanted = chunk_rows > 0 ? chunk_rows : CHUNK_ROWS;
    store->chunk_count = 1;
    while (store->chunk_count < CHUNKS_MOST && store->chunk_count * wanted < s->ply.count)
        store->chunk_count *= 2;
    store->sh_degree = s->ply.sh_degree;
    store->antialiased = s->ply.antialiased;
    store->near = s->ply.near;
    store->row_floats = CELL_ROW_SH + 3 * (size_t)((store->sh_degree + 1) * (store->sh_degree + 1));
    const size_t share = memory / 4 / store->chunk_count, row = store->row_floats * sizeof(float);
    s->extent_rows = (share < EXTENT_BYTES ? share : EXTENT_BYTES) / row;
    if (s->extent_rows < 4)
        s->extent_rows = 4;
    store->chunks = mem_calloc(store->chunk_count, sizeof *store->chunks, "chunks of Gaussians", err);
    store->cuts = mem_alloc(store->chunk_count, sizeof *store->cuts, "chunks of Gaussians", err);
    s->buffer = mem_alloc(store->chunk_count, s->extent_rows * row, "chunks of Gaussians", err);
    s->buffered = mem_calloc(store->chunk_count, sizeof *s->buffered, "chunks of Gaussians", err);
    if (store->chunks == NULL || store->cuts == NULL || s->buffer == NULL || s->buffered == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < store->chunk_count; i++)
        for (int k = 0; k < 3; k++) {
            store->chunks[i].low[k] = FLT_MAX;
            store->chunks[i].high[k] = -FLT_MAX;
        }
    return GBT_OK;
}

/* ---- into the temporary file ---- */

static gbt_status flush(sorting *s, size_t chunk, gbt_error *err)
{
    cell_store *store = s->store;
    cell_chunk *c = &store->chunks[chunk];
    const uint32_t count = s->buffered[chunk];
    if (count == 0)
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&store->extents, &store->extent_capacity, store->extent_count,
                        store->extent_count + 1, sizeof *store->extents, "extents of Gaussians", err));
    const uint32_t number = (uint32_t)store->extent_count++;
    store->extents[number] = (cell_extent){.at = store->rows.size, .count = count};
    if (c->count == count) /* this is the first extent of the chunk */
        c->first_extent = number;
    else
        store->extents[c->last_extent].next = number;
    c->last_extent = number;
    s->buffered[chunk] = 0;
    return large_file_put(&store->rows, s->buffer + chunk * s->extent_rows * store->row_floats,
                          count * store->row_floats * sizeof *s->buffer, err);
}

static gbt_status add_row(sorting *s, const block_rows *b, size_t i, uint32_t number, gbt_error *err)
{
    cell_store *store = s->store;
    const gaussian_cloud *cloud = &b->cloud;
    const float *mean = cloud->mean + 3 * i;
    const size_t chunk = chunk_of(store, mean);
    cell_chunk *c = &store->chunks[chunk];
    for (size_t k = 0; k < 3; k++) {
        c->low[k] = fminf(c->low[k], mean[k]);
        c->high[k] = fmaxf(c->high[k], mean[k]);
        c->sigma[k] = fmaxf(c->sigma[k], b->sigma[3 * i + k]);
    }
    float *row = s->buffer + (chunk * s->extent_rows + s->buffered[chunk]) * store->row_floats;
    memcpy(row + CELL_ROW_NUMBER, &number, sizeof number);
    memcpy(row + CELL_ROW_MEAN, mean, 3 * sizeof *row);
    memcpy(row + CELL_ROW_SCALE, cloud->scale_log + 3 * i, 3 * sizeof *row);
    memcpy(row + CELL_ROW_QUAT, cloud->quat + 4 * i, 4 * sizeof *row);
    row[CELL_ROW_OPACITY] = cloud->opacity[i];
    memcpy(row + CELL_ROW_SH, cloud->sh + i * GAUSSIAN_SH_COUNT * 3,
           (store->row_floats - CELL_ROW_SH) * sizeof *row);
    c->count++;
    store->count++;
    return ++s->buffered[chunk] == s->extent_rows ? flush(s, chunk, err) : GBT_OK;
}

static gbt_status add_batch(sorting *s, size_t rows, gbt_error *err)
{
    parallel_blocks(rows, BLOCK, read_block, s);
    for (size_t k = 0; k < parallel_block_count(rows, BLOCK); k++) {
        const block_rows *b = &s->blocks[k];
        if (b->status != GBT_OK)
            return base_fail(err, b->status, "%s", b->error.text);
        for (size_t i = 0; i < b->cloud.count; i++)
            GBT_TRY(add_row(s, b, i, (uint32_t)(s->first + k * BLOCK) + b->number[i], err));
    }
    return GBT_OK;
}

/* Makes coordinates relative to the middle of the means, as loaded_run_take_cloud() does. */
static void make_local(sorting *s)
{
    cell_store *store = s->store;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < store->chunk_count; i++)
        for (int k = 0; k < 3 && store->chunks[i].count > 0; k++) {
            low[k] = fmin(low[k], (double)store->chunks[i].low[k]);
            high[k] = fmax(high[k], (double)store->chunks[i].high[k]);
        }
    gaussian_middle(s->sample, s->sample_count, low, high, store->middle);
    for (size_t i = 0; i < store->chunk_count; i++)
        for (int k = 0; k < 3 && store->chunks[i].count > 0; k++) {
            store->chunks[i].low[k] = (float)((double)store->chunks[i].low[k] - store->middle[k]);
            store->chunks[i].high[k] = (float)((double)store->chunks[i].high[k] - store->middle[k]);
        }
    for (int k = 0; k < 3; k++)
        store->origin[k] = s->ply.origin[k] + store->middle[k];
    for (size_t i = 0; i + 1 < store->chunk_count; i++)
        store->cuts[i].at = (float)((double)store->cuts[i].at - store->middle[store->cuts[i].axis]);
}

static gbt_status sort_rows(sorting *s, gbt_error *err)
{
    for (s->first = 0; s->first < s->ply.count; s->first += BATCH * BLOCK) {
        const size_t left = s->ply.count - s->first;
        GBT_TRY(add_batch(s, left < BATCH * BLOCK ? left : BATCH * BLOCK, err));
    }
    for (size_t i = 0; i < s->store->chunk_count; i++)
        GBT_TRY(flush(s, i, err));
    s->all.count = s->store->count;
    for (int i = 0; i < BATCH; i++) {
        s->all.dropped += s->blocks[i].cloud.dropped;
        s->all.identity_rotations += s->blocks[i].cloud.identity_rotations;
        s->all.scales_clamped += s->blocks[i].cloud.scales_clamped;
    }
    if (s->store->count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu rows dropped)",
                         s->ply.file.name, s->all.dropped);
    gaussian_cloud_warn(&s->all, s->ply.file.name);
    return GBT_OK;
}

static void release(sorting *s)
{
    for (int i = 0; i < BATCH && s->blocks != NULL; i++) {
        gaussian_cloud_free(&s->blocks[i].cloud);
        mem_free(s->blocks[i].bytes);
        mem_free(s->blocks[i].number);
        mem_free(s->blocks[i].sigma);
    }
    mem_free(s->blocks);
    mem_free(s->sample);
    mem_free(s->buffer);
    mem_free(s->buffered);
    gaussian_ply_close(&s->ply);
}

gbt_status cell_store_make(const char *ply, const char *folder, size_t memory, size_t chunk_rows,
                           cell_store *out, gbt_error *err)
{
    sorting *s = mem_calloc(1, sizeof *s, "sorting of Gaussians", err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    s->store = out;
    gbt_status status = gaussian_ply_open(ply, &s->ply, err);
    if (status == GBT_OK && s->ply.count >= UINT32_MAX)
        status = base_fail(err, GBT_ERR_NO_MEMORY, "%s: %zu Gaussians (limit 2^32)", ply, s->ply.count);
    if (status == GBT_OK)
        status = reserve_blocks(s, err);
    if (status == GBT_OK)
        status = plan(s, memory, chunk_rows, err);
    if (status == GBT_OK)
        status = read_sample(s, err);
    if (status == GBT_OK) {
        cut_node(out, 0, s->sample, s->sample_count);
        status = large_file_scratch(folder, &out->rows, err);
    }
    if (status == GBT_OK)
        status = sort_rows(s, err);
    if (status == GBT_OK)
        make_local(s);
    release(s);
    mem_free(s);
    return status;
}

gbt_status cell_store_read(const cell_store *store, const cell_extent *extent, size_t from, size_t count,
                           float *out, gbt_error *err)
{
    const size_t row = store->row_floats * sizeof *out;
    return large_file_read(&store->rows, extent->at + from * row, out, count * row, err);
}

void cell_store_free(cell_store *store)
{
    large_file_close(&store->rows, false, NULL);
    mem_free(store->chunks);
    mem_free(store->cuts);
    mem_free(store->extents);
    memset(store, 0, sizeof *store);
}
