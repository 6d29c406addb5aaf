/* SPDX-License-Identifier: Apache-2.0 */
/* cells/draw.h -- pictures of Gaussians that do not fit in memory, cell by cell.

   Cells are parts of space, nodes of the store's tree, small enough for the memory allowed. Each restricts
   every ray to an interval; a hit belongs to the cell whose interval holds its t_c. Seen from the point where
   all rays start, the cells have one order from front to back, and are blended in that order. */
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
    double pairs;       /* estimate of their pairs with tiles */
    uint64_t *order[2]; /* [capacity] number in the .ply << 32 | row */
    gaussians sorted;   /* by that number */
    /* working space for the rows that are read together */
    float *raw;
    gaussian_cloud cloud;
    uint32_t *visible;
    size_t visible_count, visible_capacity;
    gaussians seen, wide;
} cell_load;

/** Which cells are drawn: the run of this index when the cells, front to back, are cut into `count` runs;
    {0}: all. */
typedef struct cell_share {
    int index, count;
} cell_share;

/** All that cell_draw() needs, from view to view. Start from {0}; end with cell_drawer_free(). */
typedef struct cell_drawer {
    const cell_store *store;
    size_t cell_bytes; /* set before drawing: most bytes of one cell; 0, the default: as `memory` allows */
    cell_share share;  /* set before drawing; a share has no background */
    const float *share_T_front; /* set before drawing: [pixels] transmittance that rays have in front of the
                           share, 0: not drawn; NULL, the default: all have 1 */
    size_t first, end;          /* the chunks of the share, in their order front to back */
    size_t memory;              /* bytes that this process may take */
    size_t budget;              /* of these, for one cell */
    float variance;             /* of a pixel, px^2; 0: thin rays */
    trace_settings settings;
    ray_image rays;                        /* `near`, `far` and `T_front` are those of the cell being drawn */
    unsigned char *stopped, *stopped_here; /* [rays] 1: transmittance_min has ended the ray; in this cell */
    float *T_behind;                       /* [rays] transmittance behind this cell */
    image part;                            /* of this cell */
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
 *         wanted; GBT_ERR_IO
 * Threads: uses all; same bits for every thread count.
 *
 * The picture is the one of all Gaussians in memory, but for the rounding of products of transmittances.
 */
gbt_status cell_draw(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                     const trace_settings *settings, float variance, size_t memory, image *out,
                     gbt_error *err);

/**
 * cell_draw() by all processes of the cluster together: each draws a share of the cells, with about as many
 * Gaussians in view as any other share, and all get the picture. A single process does what cell_draw() does.
 *
 * A share is first drawn as if nothing were in front of it. Rays that end in it because of what the shares in
 * front have left of them are drawn in it once more. So the picture is that of cell_draw() but for the
 * rounding of transmittances. Same bits for every number of threads, but not of processes.
 */
gbt_status cell_draw_together(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                              const trace_settings *settings, float variance, size_t memory, image *out,
                              gbt_error *err);

void cell_drawer_free(cell_drawer *d);

/** Bytes of memory that a whole .ply takes: the larger of what reading it and what drawing it needs. */
size_t cell_memory_whole(size_t count, uint64_t file_bytes);

#endif
