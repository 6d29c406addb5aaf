/* SPDX-License-Identifier: Apache-2.0 */
/* cells/view.h -- what the files of this room share: a view, a part of space, and how one is loaded. */
#ifndef GBT_CELLS_VIEW_H
#define GBT_CELLS_VIEW_H

#include "cells/draw.h"

enum { CELL_DEPTH_MOST = 16, CELL_LOAD_FLOATS = GAUSSIANS_FIELD_COUNT };

/** A node of the store's tree: a box, and the cuts that lead to it. */
typedef struct cell_part {
    size_t node;
    float low[3], high[3]; /* may be infinite */
    int depth;
    struct cell_way {
        int axis;
        float at;
        bool below; /* it is the child below the cut */
    } way[CELL_DEPTH_MOST];
} cell_part;

cell_part cell_whole(void);
cell_part cell_child(const cell_store *store, const cell_part *of, bool below);
static inline bool cell_is_chunk(const cell_store *store, const cell_part *part)
{
    return part->node >= store->chunk_count - 1;
}

/** Rays, bounds, visible chunks and budgets of a shot; all rays whole. */
gbt_status cell_view_start(cell_drawer *d, const ray_shot *shot, gbt_error *err);

/** Set the interval of every ray to what is in `part`. @return how many rays still see something there */
size_t cell_view_cut(cell_drawer *d, const cell_part *part);

/**
 * Load what the view may see of `part`.
 *
 * @param fits [out] false: it is more than the budget, and nothing is loaded
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_NO_MEMORY
 */
gbt_status cell_load_part(cell_drawer *d, const cell_part *part, bool *fits, gbt_error *err);

void cell_load_free(cell_load *load);

#endif
