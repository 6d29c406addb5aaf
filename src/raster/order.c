/* SPDX-License-Identifier: Apache-2.0 */
/* raster/order.c -- the lists of the tiles: a radix sort of the splats by depth, then a counting sort into
   tiles.

     depths --> radix sort (3 passes of 11 bits, stable) --> blocks of splats in that order
     each block --> tiles reached, a histogram over the tiles
     histograms --> where each block begins in the list of each tile --> lists

   Counting sort is stable, so every list keeps the order of depth. Blocks depend on counts alone: the same
   lists for any number of threads. */
#include "raster/order.h"

#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum {
    RADIX_BITS = 11,
    RADIX = 1 << RADIX_BITS,
    RADIX_PASSES = 3,
    SORT_BLOCKS = 16,
    PAIR_BLOCKS = 64,
    BLOCK_LEAST = 2048,
    TILE_GRAIN = 256,
    TILE_ENTRIES = 1 << 24
};

/* Elements per block, so that there are at most `blocks` blocks. */
static size_t grain_of(size_t count, size_t blocks)
{
    const size_t grain = (count + blocks - 1) / blocks;
    return grain > BLOCK_LEAST ? grain : BLOCK_LEAST;
}

/* ---- sort ---- */

typedef struct radix_job {
    const splat *splats;
    const size_t *key_first; /* of each block of Gaussians */
    const uint64_t *from;    /* depth << 32 | splat */
    uint64_t *to;
    uint32_t (*place)[RADIX];
    int shift;
} radix_job;

/* Maps the bits of a float so that unsigned integers are in the order of the numbers, negative ones too. */
static uint32_t ordered_bits(float a)
{
    uint32_t bits;
    memcpy(&bits, &a, sizeof bits);
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}

static void write_keys(size_t block, size_t begin, size_t end, void *context)
{
    (void)end;
    const radix_job *job = context;
    uint64_t *to = job->to + job->key_first[block];
    const size_t count = job->key_first[block + 1] - job->key_first[block];
    for (size_t i = 0; i < count; i++)
        to[i] = (uint64_t)ordered_bits(job->splats[begin + i].depth) << 32 | (begin + i);
}

static void count_digits(size_t block, size_t begin, size_t end, void *context)
{
    const radix_job *job = context;
    uint32_t *place = job->place[block];
    memset(place, 0, sizeof *job->place);
    for (size_t i = begin; i < end; i++)
        place[job->from[i] >> job->shift & (RADIX - 1)]++;
}

static void move_keys(size_t block, size_t begin, size_t end, void *context)
{
    const radix_job *job = context;
    uint32_t *place = job->place[block];
    for (size_t i = begin; i < end; i++)
        job->to[place[job->from[i] >> job->shift & (RADIX - 1)]++] = job->from[i];
}

/* Exclusive prefix sum, digit by digit and block by block within: counts per block and digit become the place
   of the first key of each. */
static void counts_to_places(uint32_t (*place)[RADIX], size_t blocks)
{
    uint32_t next[RADIX] = {0}, first = 0;
    for (size_t block = 0; block < blocks; block++)
        for (int digit = 0; digit < RADIX; digit++)
            next[digit] += place[block][digit];
    for (int digit = 0; digit < RADIX; digit++) {
        const uint32_t count = next[digit];
        next[digit] = first;
        first += count;
    }
    for (size_t block = 0; block < blocks; block++)
        for (int digit = 0; digit < RADIX; digit++) {
            const uint32_t count = place[block][digit];
            place[block][digit] = next[digit];
            next[digit] += count;
        }
}

/* Where the keys of each block of Gaussians begin. */
static gbt_status number_splats(tile_lists *lists, const size_t *drawn, size_t count, gbt_error *err)
{
    const size_t blocks = parallel_block_count(count, SPLAT_GRAIN);
    GBT_TRY(mem_reserve((void **)&lists->key_first, &lists->key_first_capacity, 0, blocks + 1,
                        sizeof *lists->key_first, "depth order", err));
    lists->splat_count = 0;
    for (size_t i = 0; i < blocks; i++) {
        lists->key_first[i] = lists->splat_count;
        lists->splat_count += drawn[i];
    }
    lists->key_first[blocks] = lists->splat_count;
    return GBT_OK;
}

static gbt_status sort_by_depth(tile_lists *lists, const splat *splats, size_t gaussian_count, gbt_error *err)
{
    const size_t count = lists->splat_count, grain = grain_of(count, SORT_BLOCKS);
    GBT_TRY(mem_reserve((void **)&lists->keys, &lists->key_capacity, 0, count, sizeof *lists->keys,
                        "depth order", err));
    GBT_TRY(mem_reserve((void **)&lists->spare, &lists->spare_capacity, 0, count, sizeof *lists->spare,
                        "depth order", err));
    GBT_TRY(mem_reserve((void **)&lists->histogram, &lists->histogram_capacity, 0,
                        (size_t)SORT_BLOCKS * RADIX, sizeof *lists->histogram, "depth order", err));
    radix_job job = {.splats = splats,
                     .key_first = lists->key_first,
                     .to = lists->keys,
                     .place = (uint32_t(*)[RADIX])lists->histogram};
    parallel_blocks(gaussian_count, SPLAT_GRAIN, write_keys, &job);
    for (int pass = 0; pass < RADIX_PASSES; pass++) {
        job.from = pass % 2 == 0 ? lists->keys : lists->spare;
        job.to = pass % 2 == 0 ? lists->spare : lists->keys;
        job.shift = 32 + pass * RADIX_BITS;
        parallel_blocks(count, grain, count_digits, &job);
        counts_to_places(job.place, parallel_block_count(count, grain));
        parallel_blocks(count, grain, move_keys, &job);
    }
    uint64_t *const sorted = lists->spare; /* the number of passes is odd */
    const size_t sorted_capacity = lists->spare_capacity;
    lists->spare = lists->keys;
    lists->spare_capacity = lists->key_capacity;
    lists->keys = sorted;
    lists->key_capacity = sorted_capacity;
    return GBT_OK;
}

/* ---- tiles ---- */

typedef struct pair_job {
    tile_lists *lists;
    const raster_kernel *kernel;
    const raster_view *view;
    const splat *splats;
    size_t tile_count, block_count;
    atomic_bool failed;
} pair_job;

static const splat *splat_at(const pair_job *job, size_t place)
{
    return &job->splats[(uint32_t)job->lists->keys[place]];
}

static void find_pairs(size_t block, size_t begin, size_t end, void *context)
{
    pair_job *job = context;
    pair_block *out = &job->lists->blocks[block];
    uint32_t *histogram = job->lists->histogram + block * job->tile_count;
    memset(histogram, 0, job->tile_count * sizeof *histogram);
    out->count = 0;
    for (size_t i = begin; i < end; i++) {
        const splat *s = splat_at(job, i);
        if (i + 4 < end)
            __builtin_prefetch(splat_at(job, i + 4));
        const size_t area = (size_t)(s->box[1] - s->box[0]) * (size_t)(s->box[3] - s->box[2]);
        if (mem_reserve((void **)&out->tiles, &out->capacity, out->count, out->count + area,
                        sizeof *out->tiles, "raster pairs", NULL) != GBT_OK) {
            atomic_store(&job->failed, true);
            return;
        }
        const size_t count = job->kernel->reach(job->view, s, out->tiles + out->count);
        for (size_t k = 0; k < count; k++)
            histogram[out->tiles[out->count + k]]++;
        job->lists->ranges[s - job->splats] =
            (pair_range){.place = (uint32_t)out->count, .count = (uint32_t)count};
        out->count += count;
    }
}

static void place_pairs(size_t block, size_t begin, size_t end, void *context)
{
    pair_job *job = context;
    const pair_block *from = &job->lists->blocks[block];
    uint32_t *place = job->lists->histogram + block * job->tile_count;
    for (size_t i = begin; i < end; i++) {
        const uint32_t number = (uint32_t)job->lists->keys[i];
        const pair_range *range = &job->lists->ranges[number];
        const uint32_t *tiles = from->tiles + range->place;
        for (uint32_t k = 0; k < range->count; k++)
            job->lists->entries[place[tiles[k]]++] = (tile_entry){number, range->first + k};
    }
}

/* Counts all pairs of each of the tiles [begin, end), into first[tile + 1]. */
static void count_tiles(size_t range, size_t begin, size_t end, void *context)
{
    (void)range;
    const pair_job *job = context;
    size_t *total = job->lists->first + 1;
    for (size_t tile = begin; tile < end; tile++)
        total[tile] = 0;
    for (size_t block = 0; block < job->block_count; block++)
        for (size_t tile = begin; tile < end; tile++)
            total[tile] += job->lists->histogram[block * job->tile_count + tile];
}

/* For tiles [begin, end): counts per block become places in the list of the tile. */
static void place_blocks(size_t range, size_t begin, size_t end, void *context)
{
    (void)range;
    const pair_job *job = context;
    uint32_t next[TILE_GRAIN];
    for (size_t tile = begin; tile < end; tile++)
        next[tile - begin] = (uint32_t)job->lists->first[tile];
    for (size_t block = 0; block < job->block_count; block++)
        for (size_t tile = begin; tile < end; tile++) {
            uint32_t *place = &job->lists->histogram[block * job->tile_count + tile];
            const uint32_t count = *place;
            *place = next[tile - begin];
            next[tile - begin] += count;
        }
}

/* Counts per block and tile become places in the entries of all tiles. */
static gbt_status place_all(pair_job *job, gbt_error *err)
{
    tile_lists *lists = job->lists;
    size_t *first = lists->first;
    uint64_t total = 0;
    for (size_t block = 0; block < job->block_count; block++)
        total += lists->blocks[block].count;
    if (total > UINT32_MAX)
        return base_fail(err, GBT_ERR_NO_MEMORY, "raster: %llu pairs of Gaussian and tile (limit 2^32)",
                         (unsigned long long)total);
    parallel_blocks(job->tile_count, TILE_GRAIN, count_tiles, job);
    first[0] = 0;
    for (size_t tile = 0; tile < job->tile_count; tile++) {
        if (first[tile + 1] > TILE_ENTRIES)
            return base_fail(err, GBT_ERR_NO_MEMORY, "raster: %zu Gaussians in one tile (limit 2^24)",
                             first[tile + 1]);
        first[tile + 1] += first[tile];
    }
    parallel_blocks(job->tile_count, TILE_GRAIN, place_blocks, job);
    lists->pair_count = (size_t)total;
    return GBT_OK;
}

static void number_pairs(tile_lists *lists, size_t count)
{
    uint32_t next = 0;
    for (size_t block = 0, begin = 0; begin < count; block++, begin += SPLAT_GRAIN) {
        const size_t end = begin + lists->key_first[block + 1] - lists->key_first[block];
        for (size_t i = begin; i < end; i++) {
            lists->ranges[i].first = next;
            next += lists->ranges[i].count;
        }
    }
}

static gbt_status reserve_blocks(tile_lists *lists, size_t count, gbt_error *err)
{
    const size_t old = lists->block_capacity;
    if (count <= old)
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&lists->blocks, &lists->block_capacity, old, count, sizeof *lists->blocks,
                        "raster blocks", err));
    memset(lists->blocks + old, 0, (lists->block_capacity - old) * sizeof *lists->blocks);
    return GBT_OK;
}

gbt_status tile_lists_make(tile_lists *lists, const raster_kernel *kernel, const raster_view *view,
                           const splat *splats, const size_t *drawn, size_t count, gbt_error *err)
{
    GBT_TRY(number_splats(lists, drawn, count, err));
    GBT_TRY(sort_by_depth(lists, splats, count, err));
    const size_t grain = grain_of(lists->splat_count, PAIR_BLOCKS);
    pair_job job = {.lists = lists, .kernel = kernel, .view = view, .splats = splats};
    job.tile_count = (size_t)view->tiles_across * (size_t)view->tiles_down;
    job.block_count = parallel_block_count(lists->splat_count, grain);
    atomic_init(&job.failed, false);
    GBT_TRY(reserve_blocks(lists, job.block_count, err));
    GBT_TRY(mem_reserve((void **)&lists->histogram, &lists->histogram_capacity, 0,
                        job.block_count * job.tile_count, sizeof *lists->histogram, "raster tiles", err));
    GBT_TRY(mem_reserve((void **)&lists->first, &lists->first_capacity, 0, job.tile_count + 1,
                        sizeof *lists->first, "raster tiles", err));
    GBT_TRY(mem_reserve((void **)&lists->ranges, &lists->range_capacity, 0, count, sizeof *lists->ranges,
                        "raster pairs", err));
    parallel_blocks(lists->splat_count, grain, find_pairs, &job);
    if (atomic_load(&job.failed))
        return base_fail(err, GBT_ERR_NO_MEMORY,
                         "raster: no memory for the pairs of %zu Gaussians and %zu tiles", lists->splat_count,
                         job.tile_count);
    GBT_TRY(place_all(&job, err));
    number_pairs(lists, count);
    GBT_TRY(mem_reserve((void **)&lists->entries, &lists->entry_capacity, 0, lists->pair_count,
                        sizeof *lists->entries, "raster pairs", err));
    parallel_blocks(lists->splat_count, grain, place_pairs, &job);
    return GBT_OK;
}

void tile_lists_free(tile_lists *lists)
{
    for (size_t i = 0; i < lists->block_capacity; i++)
        mem_free(lists->blocks[i].tiles);
    void *const owned[] = {lists->entries, lists->first, lists->ranges, lists->key_first,
                           lists->keys,    lists->spare, lists->blocks, lists->histogram};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        mem_free(owned[i]);
    memset(lists, 0, sizeof *lists);
}
