/* SPDX-License-Identifier: Apache-2.0 */
/* growth/search.h -- find positions and initial values of new anchors. The candidates of a level are
   collected in the cells of a grid; each cell without an anchor gets one. The model itself is not changed
   here. */
#ifndef GBT_GROWTH_SEARCH_H
#define GBT_GROWTH_SEARCH_H

#include "growth/growth.h"

typedef struct growth_candidate {
    float position[3];
    float scale;    /* initial scale, for all axes, of an anchor there */
    float gradient; /* the candidate with the largest one wins the cell */
    size_t parent;  /* row of the parent in the anchors */
} growth_candidate;

typedef struct new_anchor {
    float position[3];
    float scale;
    float gradient; /* of the cell's winning candidate */
    int level;
    int64_t at[3];  /* its cell in the grid of the level */
    size_t feature; /* row of new_anchors.feature */
} new_anchor;

/** By level, then cell (x, y, z). Start from {0}; free with new_anchors_free() after success or failure. */
typedef struct new_anchors {
    new_anchor *rows;
    size_t count, capacity;
    float *feature; /* [feature_count][ANCHOR_FEATURE_DIM]: per cell the maximum over the parents of its
                       candidates; occupied cells have rows, too */
    size_t feature_count, feature_capacity;
} new_anchors;

/** Keep at most `room` new anchors: those with the largest gradients, ties by level, then cell. */
void new_anchors_keep_largest(new_anchors *n, size_t room);
void new_anchors_free(new_anchors *n);

/** State of a search through the grids of all levels, coarse to fine. Start with a, stats, def and out set
    and the rest zero; free with growth_search_free(). */
typedef struct growth_search {
    const anchors *a;
    const growth_stats *stats; /* rows match `a` */
    const growth_def *def;
    new_anchors *out; /* the new anchors of all levels so far */
    int level;        /* the current one */
    float size;       /* cell size of that level */
    struct cell *cells;
    size_t cell_count, cell_capacity;
    uint32_t *table; /* hash -> cell + 1, 0 is empty; the size is a power of two, at least twice cell_count */
    size_t table_size, table_capacity;
} growth_search;

float growth_cell_size(const growth_def *def, int level);
float growth_level_threshold(const growth_def *def, int level);

/** Was the Gaussian seen in enough views for its mean gradient to be reliable? */
static inline bool growth_well_sampled(const growth_def *def, float grad_count)
{
    return grad_count > def->interval * GROWTH_VIEW_SHARE * 0.5f;
}

/** Start a level with an empty grid; false when the level has no grid or is not to be searched. */
bool growth_search_begin(growth_search *s, int level);

/** Add a candidate to its cell; candidates without a cell are dropped. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status growth_search_add(growth_search *s, const growth_candidate *c, gbt_error *err);

/** Finish a level: make an anchor for each cell that has candidates, has no anchor yet, and may have one.
    GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status growth_search_end(growth_search *s,
                             bool (*may_stand)(const void *context, const float position[3]),
                             const void *context, gbt_error *err);

void growth_search_free(growth_search *s);

#endif
