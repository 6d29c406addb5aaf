/* SPDX-License-Identifier: Apache-2.0 */
/* cells/draw.h -- pictures of Gaussians that do not fit in memory, cell by cell.

   Cells are parts of space, nodes of the store's tree, small enough for the memory allowed. Each cuts every
   ray to an interval; a hit belongs to the cell whose interval holds its t_c. From the point where all rays
   start the tree has one order front to back, and the cells of it blend one behind the other, in that order.
 */
#ifndef GBT_CELLS_DRAW_H
#define GBT_CELLS_DRAW_H

#include "cells/store.h"
#include "frame/visible.h"
#include "trace/footprint.h"
#include "trace/trace.h"

/** The Gaussians of one cell that the view may see, while they are gathered. */
typedef struct cell_load {
    float *rows; /* [capacity][CELL_LOAD_FLOATS], as they come */
    size_t count, capacity;
    double pairs;       /* with tiles, about */
    uint64_t *order[2]; /* [capacity] number in the .ply << 32 | row */
    gaussians sorted;   /* by that number */
    /* of the rows that are read together */
    float *raw;
    gaussian_cloud cloud;
    uint32_t *visible;
    size_t visible_count, visible_capacity;
    gaussians seen, wide;
} cell_load;

/** Which of the cells are drawn: of `count` runs of them, front to back, the one of this index; {0}: all. */
typedef struct cell_share {
    int index, count;
} cell_share;

/** All that pictures by cells need, from view to view. Start from {0}; end with cell_drawer_free(). */
typedef struct cell_drawer {
    const cell_store *store;
    size_t cell_bytes;  /* set before drawing: of one cell at most; 0, the default: as `memory` allows */
    cell_share share;   /* set before drawing; a share has no background */
    const float *enter; /* set before drawing: [pixels] transmittance that rays have in front of the share, 0:
                           not drawn; NULL, the default: all have 1 */
    size_t first, end;  /* of the chunks, front to back: those of the share */
    size_t memory;      /* bytes that this process may take */
    size_t budget;      /* of them, for one cell */
    float variance;     /* of a pixel, px^2; 0: thin rays */
    trace_settings settings;
    ray_image rays;              /* `near`, `far` and `through` are those of the cell being drawn */
    unsigned char *over, *ended; /* [rays] 1: transmittance_min ended the ray; so it did in this cell */
    float *left;                 /* [rays] transmittance behind this cell */
    image part;                  /* of this cell */
    view_bounds bounds;
    visible_reach reach;
    footprint_view view;
    uint32_t *visible; /* [visible_count] chunks in view */
    size_t visible_count, visible_capacity;
    trace_scene scene;
    cell_load load;
    size_t drawn_cells; /* of the last picture */
} cell_drawer;

/**
 * Draw a shot whose rays start at one point.
 *
 * @param settings [in]  as for trace_build()
 * @param variance [in]  of a pixel (trace/footprint.h); 0: rays are thin
 * @param memory   [in]  bytes that the process may take in all
 * @param out      [in,out] resized to the shot
 * @return GBT_OK; GBT_ERR_ARGUMENT: rays that start at different points (an aperture, a rolling shutter, an
 *         orthographic camera); GBT_ERR_NO_MEMORY: `memory` is too little, and the text says how much is
 * wanted; GBT_ERR_IO Threads: uses all; same bits for every thread count. The picture is that of all
 * Gaussians in memory, but for the rounding of the products of transmittances.
 */
gbt_status cell_draw(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                     const trace_settings *settings, float variance, size_t memory, image *out,
                     gbt_error *err);

/**
 * As cell_draw(), by all processes of the cluster together: each draws a share of the cells, which has about
 * as many Gaussians in view as any other, and all get the picture. As cell_draw() in a process that is alone.
 *
 * A share is first drawn as if nothing were in front of it; rays that end in it by what the others have left
 * are drawn in it once more. So the picture is that of cell_draw() but for the rounding of transmittances.
 * Same bits for every number of threads, not of processes.
 */
gbt_status cell_draw_together(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                              const trace_settings *settings, float variance, size_t memory, image *out,
                              gbt_error *err);

void cell_drawer_free(cell_drawer *d);

/** Bytes of memory that all of a .ply takes: while it is read, or while pictures of it are drawn. */
size_t cell_memory_whole(size_t count, uint64_t file_bytes);

#endif
