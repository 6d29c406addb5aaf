/* SPDX-License-Identifier: Apache-2.0 */
/* cells/view.h -- what the files of this folder share: a view, a part of space, and how it is loaded. */
#ifndef GBT_CELLS_VIEW_H
#define GBT_CELLS_VIEW_H

#include "cells/draw.h"

enum { CELL_DEPTH_MOST = 16, CELL_LOAD_FLOATS = GAUSSIANS_FIELD_COUNT };

/* Bytes for each Gaussian of a cell: rows as read and as sorted, records, those of the view; and for each
   tile that it reaches into. */
enum { CELL_BYTES_EACH = 340, CELL_BYTES_PAIR = 20 };

/** A node of the store's tree: a box, and the cuts that lead to it from the root. */
typedef struct cell_part {
    size_t node;
    float low[3], high[3]; /* may be infinite */
    int depth;
    struct cell_half_space {
        int axis;
        float at;
        bool below; /* the part lies below this cut */
    } half_space[CELL_DEPTH_MOST];
} cell_part;

cell_part cell_whole(void);
/** The child that rays from the eye meet first (k = 0) or second (k = 1). */
cell_part cell_child_from_eye(const cell_drawer *d, const cell_part *of, int k);
static inline bool cell_is_chunk(const cell_store *store, const cell_part *part)
{
    return part->node >= store->chunk_count - 1;
}

/** Finds rays, bounds, visible chunks and the budget of a shot; every ray has its whole length. */
gbt_status cell_view_start(cell_drawer *d, const ray_shot *shot, gbt_error *err);

/** Finds the run of chunks that is the drawer's share of this view. */
gbt_status cell_share_find(cell_drawer *d, gbt_error *err);

/** Floats per pixel of a layer, the picture of one share: colour, and the transmittance behind it, negative
    where the ray has ended. */
enum { CELL_LAYER_FLOATS = 4 };

/** Turns what has just been drawn, without a background, into a layer of [pixels][CELL_LAYER_FLOATS]. */
void cell_layer_make(const cell_drawer *d, const image *drawn, float *layer);

/**
 * Blend layers, the first one in front; each was drawn as if nothing were in front of it.
 *
 * @param sum   [out] [pixels][CELL_LAYER_FLOATS] colour, and the transmittance behind it
 * @param share_T_front [out] [count][pixels] > 0: the ray ends in this layer, which is not in `sum`. Draw
 *                    the layer again for rays that enter it with this transmittance
 *                    (cell_drawer.share_T_front), then call cell_layers_add()
 */
void cell_layers_blend(const float *const layers[], int count, size_t pixels, float transmittance_min,
                       float *sum, float *share_T_front);
void cell_layers_add(const float *const again[], int count, size_t pixels, const float *share_T_front,
                     float *sum);

/** Restrict every ray to its interval in `part`. @return how many rays have one */
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
