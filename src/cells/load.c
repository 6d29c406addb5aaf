/* SPDX-License-Identifier: Apache-2.0 */
/* cells/load.c -- the Gaussians that a view may see in a part of space.

     chunks in view that reach into the part --> rows, ROWS_TOGETHER at a time --> unpacked
         --> those in view, coloured and widened (trace/footprint.h)
         --> those that reach into the part are kept, until the budget is exceeded
     kept rows --> radix sort by their number in the .ply, the order in which all of them would be traced */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "cells/view.h"
#include "frame/plain.h"

enum { ROWS_TOGETHER = 16384, UNPACK_BLOCK = 1024, SORT_BITS = 11 };

/* ---- one piece of rows ---- */

typedef struct unpack_job {
    const cell_store *store;
    cell_load *load;
} unpack_job;

static void unpack_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const unpack_job *job = context;
    const cell_store *store = job->store;
    const gaussian_cloud *cloud = &job->load->cloud;
    const size_t sh = store->row_floats - CELL_ROW_SH;
    for (size_t i = begin; i < end; i++) {
        const float *row = job->load->raw + i * store->row_floats;
        for (size_t k = 0; k < 3; k++)
            cloud->mean[3 * i + k] = (float)((double)row[CELL_ROW_MEAN + k] - store->middle[k]);
        memcpy(cloud->scale_log + 3 * i, row + CELL_ROW_SCALE, 3 * sizeof *row);
        memcpy(cloud->quat + 4 * i, row + CELL_ROW_QUAT, 4 * sizeof *row);
        cloud->opacity[i] = row[CELL_ROW_OPACITY];
        memcpy(cloud->sh + i * GAUSSIAN_SH_COUNT * 3, row + CELL_ROW_SH, sh * sizeof *row);
    }
}

/* How far a Gaussian reaches along each axis while its response counts, and a little farther, because depths
   in float, and so the places of hits, have errors. False for one that is never hit. */
static bool find_extent(const cell_drawer *d, const gaussians *g, size_t i, float half[3], float *radius)
{
    const float share = g->opacity[i] / d->settings.alpha_min;
    if (!(share >= 1) || !(g->scale_x[i] > 0 && g->scale_y[i] > 0 && g->scale_z[i] > 0))
        return false;
    const float k = sqrtf(2 * logf(share)) * 1.01f;
    const float sx = k * g->scale_x[i], sy = k * g->scale_y[i], sz = k * g->scale_z[i];
    const float quat[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]};
    float m[9];
    quat_to_matrix(quat, m);
    for (int a = 0; a < 3; a++) {
        const float *row = m + 3 * a;
        half[a] = sqrtf(row[0] * row[0] * sx * sx + row[1] * row[1] * sy * sy + row[2] * row[2] * sz * sz);
    }
    *radius = fmaxf(sx, fmaxf(sy, sz));
    return true;
}

/* An estimate, rather too large, of how many tiles a ball of the Gaussian's reach covers. */
static double count_tiles(const cell_drawer *d, const float mean[3], float radius)
{
    const double tiles =
        ceil((double)d->rays.width / TILE_PIXELS) * ceil((double)d->rays.height / TILE_PIXELS);
    double to[3], square = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        to[k] = (double)mean[k] - d->view.center[k];
        square += to[k] * to[k];
        along += to[k] * d->view.axis[k];
    }
    const double distance = sqrt(square) - (double)radius;
    /* Off the axis of a perspective picture things appear larger. */
    const double depth =
        d->view.kind == FOOTPRINT_PERSPECTIVE ? along * along / sqrt(square) - (double)radius : distance;
    if (!(depth > 0) || !(distance > 0))
        return tiles;
    const double across = 2 * (double)radius / (depth * d->view.pixel * TILE_PIXELS) + 1.5;
    return fmin(tiles, across * across);
}

static bool reaches_into(const cell_drawer *d, const cell_part *part, const float mean[3],
                         const float half[3])
{
    float rounding = 0;
    for (int k = 0; k < 3; k++)
        rounding += fabsf(mean[k]) + 2 * fabsf(d->rays.origin[k]);
    rounding *= 1e-5f;
    for (int k = 0; k < 3; k++)
        if (!(mean[k] - half[k] - rounding <= part->high[k] && mean[k] + half[k] + rounding >= part->low[k]))
            return false;
    return true;
}

/* Keeps the rows of the piece that reach into the part. @return false when they are too many */
static bool keep_rows(cell_drawer *d, const cell_part *part, const gaussians *g)
{
    cell_load *load = &d->load;
    const float *const fields[GAUSSIANS_FIELD_COUNT] = {
#define X(name, pad, meaning) g->name,
        GAUSSIANS_FIELDS(X)
#undef X
    };
    for (size_t i = 0; i < g->count; i++) {
        const float mean[3] = {g->mean_x[i], g->mean_y[i], g->mean_z[i]};
        float half[3], radius;
        if (!find_extent(d, g, i, half, &radius) || !reaches_into(d, part, mean, half))
            continue;
        load->pairs += count_tiles(d, mean, radius);
        const double bytes = (double)(load->count + 1) * CELL_BYTES_EACH + load->pairs * CELL_BYTES_PAIR;
        if (bytes > (double)d->budget || load->count == load->capacity)
            return false;
        uint32_t number;
        memcpy(&number, load->raw + load->visible[i] * d->store->row_floats + CELL_ROW_NUMBER, sizeof number);
        load->order[0][load->count] = (uint64_t)number << 32 | load->count;
        float *row = load->rows + load->count++ * CELL_LOAD_FLOATS;
        for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
            row[k] = fields[k][i];
    }
    return true;
}

static gbt_status keep_piece(cell_drawer *d, const cell_part *part, size_t count, bool *fits, gbt_error *err)
{
    cell_load *load = &d->load;
    unpack_job job = {d->store, load};
    load->cloud.count = count;
    load->cloud.sh_degree = d->store->sh_degree;
    parallel_blocks(count, UNPACK_BLOCK, unpack_rows, &job);
    GBT_TRY(visible_find(frame_plain(&load->cloud), &d->bounds, &d->reach, NULL, NULL, &load->visible,
                         &load->visible_count, &load->visible_capacity, err));
    GBT_TRY(
        plain_forward(&load->cloud, d->bounds.center, load->visible, load->visible_count, &load->seen, err));
    if (d->variance > 0)
        GBT_TRY(footprint_forward(&d->view, d->variance, NULL, &load->seen, &load->wide, err));
    *fits = keep_rows(d, part, d->variance > 0 ? &load->wide : &load->seen);
    return GBT_OK;
}

/* ---- chunks ---- */

static bool chunk_reaches_into(const cell_drawer *d, const cell_chunk *c, const cell_part *part)
{
    float square = 0;
    for (int k = 0; k < 3; k++) {
        const float far = fmaxf(fabsf(c->low[k] - d->rays.origin[k]), fabsf(c->high[k] - d->rays.origin[k]));
        square += far * far;
    }
    const float wide = d->reach.width * d->reach.pixel * sqrtf(square);
    for (int k = 0; k < 3; k++) {
        const float more = 1.01f * d->reach.sigmas * (c->sigma[k] + wide) +
                           1e-5f * (fabsf(c->low[k]) + fabsf(c->high[k]) + sqrtf(square));
        if (!(c->low[k] - more <= part->high[k] && c->high[k] + more >= part->low[k]))
            return false;
    }
    return true;
}

static gbt_status load_chunk(cell_drawer *d, const cell_chunk *c, const cell_part *part, bool *fits,
                             gbt_error *err)
{
    const cell_store *store = d->store;
    size_t have = 0, left = c->count;
    uint32_t extent = c->first_extent;
    for (size_t from = 0; left > 0 && *fits;) {
        const cell_extent *e = &store->extents[extent];
        const size_t room = ROWS_TOGETHER - have, rows = e->count - from < room ? e->count - from : room;
        GBT_TRY(cell_store_read(store, e, from, rows, d->load.raw + have * store->row_floats, err));
        have += rows;
        left -= rows;
        from += rows;
        if (from == e->count) {
            extent = e->next;
            from = 0;
        }
        if (have < ROWS_TOGETHER && left > 0)
            continue;
        GBT_TRY(keep_piece(d, part, have, fits, err));
        have = 0;
    }
    return GBT_OK;
}

static gbt_status reserve(cell_drawer *d, gbt_error *err)
{
    cell_load *load = &d->load;
    const size_t capacity = d->budget / CELL_BYTES_EACH;
    if (load->raw == NULL) {
        GBT_TRY(gaussian_cloud_alloc(&load->cloud, ROWS_TOGETHER, err));
        memset(load->cloud.sh, 0, ROWS_TOGETHER * GAUSSIAN_SH_COUNT * 3 * sizeof *load->cloud.sh);
        load->raw = mem_alloc(ROWS_TOGETHER, d->store->row_floats * sizeof *load->raw, "rows of a cell", err);
        if (load->raw == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    if (load->capacity == capacity)
        return GBT_OK;
    /* Room for as many as the budget can hold: pages that are not used take no memory. */
    load->capacity = 0;
    mem_free(load->rows);
    load->rows = mem_alloc(capacity, CELL_LOAD_FLOATS * sizeof *load->rows, "rows of a cell", err);
    for (int k = 0; k < 2; k++) {
        mem_free(load->order[k]);
        load->order[k] = mem_alloc(capacity, sizeof *load->order[k], "rows of a cell", err);
    }
    if (load->rows == NULL || load->order[0] == NULL || load->order[1] == NULL)
        return GBT_ERR_NO_MEMORY;
    load->capacity = capacity;
    return GBT_OK;
}

/* ---- order ---- */

/* Radix sort by the upper halves, which are all different. */
static const uint64_t *sort_numbers(uint64_t *from, uint64_t *to, size_t count)
{
    enum { PLACES = 1 << SORT_BITS };
    for (int shift = 32; shift < 64; shift += SORT_BITS) {
        size_t place[PLACES] = {0}, next = 0;
        for (size_t i = 0; i < count; i++)
            place[from[i] >> shift & (PLACES - 1)]++;
        for (size_t k = 0; k < PLACES; k++) {
            const size_t here = place[k];
            place[k] = next;
            next += here;
        }
        for (size_t i = 0; i < count; i++)
            to[place[from[i] >> shift & (PLACES - 1)]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

typedef struct place_job {
    cell_load *load;
    const uint64_t *order;
} place_job;

static void place_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const place_job *job = context;
    const gaussians *g = &job->load->sorted;
    float *const fields[GAUSSIANS_FIELD_COUNT] = {
#define X(name, pad, meaning) g->name,
        GAUSSIANS_FIELDS(X)
#undef X
    };
    for (size_t i = begin; i < end; i++) {
        const float *row = job->load->rows + (size_t)(uint32_t)job->order[i] * CELL_LOAD_FLOATS;
        for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
            fields[k][i] = row[k];
    }
}

/* Whether there are so many rows that it is not worth reading them to see which are visible. */
static bool is_far_over_budget(const cell_drawer *d, const cell_part *part)
{
    size_t rows = 0;
    for (size_t i = 0; i < d->visible_count; i++) {
        const cell_chunk *c = &d->store->chunks[d->visible[i]];
        rows += c->count > 0 && chunk_reaches_into(d, c, part) ? c->count : 0;
    }
    return (double)rows * CELL_BYTES_EACH > 4 * (double)d->budget;
}

gbt_status cell_load_part(cell_drawer *d, const cell_part *part, bool *fits, gbt_error *err)
{
    cell_load *load = &d->load;
    *fits = cell_is_chunk(d->store, part) || !is_far_over_budget(d, part);
    if (!*fits)
        return GBT_OK;
    GBT_TRY(reserve(d, err));
    load->count = 0;
    load->pairs = 0;
    for (size_t i = 0; i < d->visible_count && *fits; i++) {
        const cell_chunk *c = &d->store->chunks[d->visible[i]];
        if (c->count > 0 && chunk_reaches_into(d, c, part))
            GBT_TRY(load_chunk(d, c, part, fits, err));
    }
    if (!*fits)
        return GBT_OK;
    GBT_TRY(gaussians_resize(&load->sorted, load->count, err));
    place_job job = {load, sort_numbers(load->order[0], load->order[1], load->count)};
    parallel_blocks(load->count, UNPACK_BLOCK, place_rows, &job);
    gaussians_pad(&load->sorted);
    return GBT_OK;
}

void cell_load_free(cell_load *load)
{
    mem_free(load->rows);
    mem_free(load->order[0]);
    mem_free(load->order[1]);
    mem_free(load->raw);
    mem_free(load->visible);
    gaussian_cloud_free(&load->cloud);
    gaussians_free(&load->sorted);
    gaussians_free(&load->seen);
    gaussians_free(&load->wide);
    memset(load, 0, sizeof *load);
}
