/* SPDX-License-Identifier: Apache-2.0 */
/* raster/order.h -- splats in the order of their depths, and the lists of the tiles. */
#ifndef GBT_RASTER_ORDER_H
#define GBT_RASTER_ORDER_H

#include "raster/kernel.h"

/* The numbers of the pairs of a splat. They are counted in the order of the splats, so that
   raster_gradients() reads records one after the other. */
typedef struct pair_range {
    uint32_t first, count;
    uint32_t place; /* internal: where its tiles begin in their block */
} pair_range;

/* Tiles that a block of splats reaches, one after the other. */
typedef struct pair_block {
    uint32_t *tiles;
    size_t count, capacity;
} pair_block;

/** The splats of every tile, front to back by (depth of the centre, index). Start from {0}; memory is kept
    from view to view. */
typedef struct tile_lists {
    tile_entry *entries; /* [pair_count], tile by tile */
    size_t pair_count;
    size_t *first;      /* [tiles + 1] of each tile in `entries` */
    pair_range *ranges; /* [splats] */
    size_t splat_count;
    /* internal */
    size_t *key_first;
    uint64_t *keys, *spare;
    pair_block *blocks;
    uint32_t *histogram;
    size_t entry_capacity, first_capacity, range_capacity, key_first_capacity, key_capacity, spare_capacity,
        block_capacity, histogram_capacity;
} tile_lists;

/**
 * Make the lists of the splats of `count` Gaussians.
 *
 * @param splats [in] in the order of their ids: those of block i from i * SPLAT_GRAIN on
 * @param drawn  [in] how many there are in each block
 * @return GBT_OK, GBT_ERR_NO_MEMORY (2^32 pairs, 2^24 splats in one tile, too)
 * Threads: uses all; same lists for every thread count.
 */
gbt_status tile_lists_make(tile_lists *lists, const raster_kernel *kernel, const raster_view *view,
                           const splat *splats, const size_t *drawn, size_t count, gbt_error *err);

void tile_lists_free(tile_lists *lists); /* back to {0} */

#endif
