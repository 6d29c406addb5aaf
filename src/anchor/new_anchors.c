/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/new_anchors.c -- candidates of a level, gathered in the cells of a hash set; cells that hold no
   anchor yet get one. */
#include "anchor/new_anchors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "anchor/activations.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"

typedef struct cell {
    int64_t at[3];
    float position[3], scale, gradient; /* of the candidate with the largest gradient */
    size_t feature;                     /* row of new_anchors.feature */
    bool occupied;
} cell;

typedef struct growth {
    const anchors *a;
    const adjust_stats *stats;
    const adjust_def *def;
    new_anchors *out; /* of all levels so far */
    cell *cells;      /* of the current level */
    size_t cell_count, cell_capacity;
    uint32_t *table; /* hash -> cell + 1, 0 is empty; its size is a power of two, at least twice cell_count */
    size_t table_size, table_capacity;
} growth;

/* False where the cell has no 64-bit address, or the position is not finite. */
static bool cell_of(const float position[3], float size, int64_t at[3])
{
    for (int c = 0; c < 3; c++) {
        const float index = rintf(position[c] / size);
        if (!(fabsf(index) < 0x1p62f))
            return false;
        at[c] = (int64_t)index;
    }
    return true;
}

static size_t cell_hash(const int64_t at[3])
{
    uint64_t h = 0;
    for (int c = 0; c < 3; c++) {
        h ^= (uint64_t)at[c];
        h *= 0x9E3779B97F4A7C15u;
        h ^= h >> 29;
    }
    return (size_t)h;
}

static bool same_cell(const int64_t a[3], const int64_t b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Slot of the table that holds the cell, or the empty one where it belongs. */
static size_t find_slot(const growth *g, const int64_t at[3])
{
    size_t slot = cell_hash(at) & (g->table_size - 1);
    while (g->table[slot] != 0 && !same_cell(g->cells[g->table[slot] - 1].at, at))
        slot = (slot + 1) & (g->table_size - 1);
    return slot;
}

static gbt_status grow_table(growth *g, gbt_error *err)
{
    const size_t size = g->table_size < 1024 ? 1024 : g->table_size * 2;
    void *table = g->table;
    GBT_TRY(mem_reserve(&table, &g->table_capacity, 0, size, sizeof *g->table, "growth", err));
    g->table = table;
    g->table_size = size;
    memset(g->table, 0, size * sizeof *g->table);
    for (size_t i = 0; i < g->cell_count; i++)
        g->table[find_slot(g, g->cells[i].at)] = (uint32_t)(i + 1);
    return GBT_OK;
}

typedef struct candidate {
    float position[3], scale, gradient;
    size_t parent; /* row of the anchors */
} candidate;

/* A cell keeps the place of its steepest candidate and the maxima of all parents' features. */
static void merge_candidate(cell *known, float *best, const candidate *c, const float *feature)
{
    if (c->gradient > known->gradient) {
        known->gradient = c->gradient;
        known->scale = c->scale;
        memcpy(known->position, c->position, sizeof known->position);
    }
    for (int i = 0; i < ANCHOR_FEATURE_DIM; i++)
        best[i] = fmaxf(best[i], feature[i]);
}

/* Into its cell of the level; what has no cell is left out. */
static gbt_status add_candidate(growth *g, float size, const candidate *c, gbt_error *err)
{
    int64_t at[3];
    if (!cell_of(c->position, size, at))
        return GBT_OK;
    new_anchors *n = g->out;
    if ((g->cell_count + 1) * 2 > g->table_size)
        GBT_TRY(grow_table(g, err));
    const float *feature = g->a->feature + c->parent * ANCHOR_FEATURE_DIM;
    const size_t slot = find_slot(g, at);
    if (g->table[slot] != 0) {
        cell *known = &g->cells[g->table[slot] - 1];
        merge_candidate(known, n->feature + known->feature * ANCHOR_FEATURE_DIM, c, feature);
        return GBT_OK;
    }
    void *cells = g->cells, *features = n->feature;
    GBT_TRY(mem_reserve(&cells, &g->cell_capacity, g->cell_count, g->cell_count + 1, sizeof *g->cells,
                        "growth", err));
    g->cells = cells;
    GBT_TRY(mem_reserve(&features, &n->feature_capacity, n->feature_count, n->feature_count + 1,
                        ANCHOR_FEATURE_DIM * sizeof(float), "growth", err));
    n->feature = features;
    memcpy(n->feature + n->feature_count * ANCHOR_FEATURE_DIM, feature, ANCHOR_FEATURE_DIM * sizeof(float));
    g->cells[g->cell_count] = (cell){.at = {at[0], at[1], at[2]},
                                     .position = {c->position[0], c->position[1], c->position[2]},
                                     .scale = c->scale,
                                     .gradient = c->gradient,
                                     .feature = n->feature_count++};
    g->table[slot] = (uint32_t)++g->cell_count;
    return GBT_OK;
}

static void mark_occupied(growth *g, const float position[3], float size)
{
    int64_t at[3];
    if (!cell_of(position, size, at))
        return;
    const size_t slot = find_slot(g, at);
    if (g->table[slot] != 0)
        g->cells[g->table[slot] - 1].occupied = true;
}

static int compare_cells(const int64_t a[3], const int64_t b[3])
{
    for (int c = 0; c < 3; c++)
        if (a[c] != b[c])
            return a[c] < b[c] ? -1 : 1;
    return 0;
}

static int by_cell(const void *a, const void *b)
{
    return compare_cells(((const cell *)a)->at, ((const cell *)b)->at);
}

static int by_level_and_cell(const void *a, const void *b)
{
    const new_anchor *x = a, *y = b;
    return x->level != y->level ? x->level - y->level : compare_cells(x->at, y->at);
}

static int by_gradient(const void *a, const void *b)
{
    const new_anchor *x = a, *y = b;
    if (x->gradient > y->gradient || x->gradient < y->gradient)
        return x->gradient > y->gradient ? -1 : 1;
    return by_level_and_cell(a, b);
}

static float level_cell_size(const adjust_def *def, int level)
{
    double divisor = 1;
    for (int i = 0; i < level; i++)
        divisor *= def->hierarchy_factor;
    const double factor = def->init_factor / divisor;
    return def->voxel_size * (float)(def->integer_division ? floor(factor) : factor);
}

/* Mean over the views that saw the Gaussian; 0 when none did. */
static float mean_gradient(const adjust_stats *stats, size_t slot)
{
    return stats->grad_count[slot] > 0 ? stats->grad_accum[slot] / stats->grad_count[slot] : 0;
}

static float level_threshold(const adjust_def *def, int level)
{
    float threshold = def->grad_threshold;
    for (int i = 0; i < level; i++)
        threshold *=
            def->integer_division ? (float)(def->hierarchy_factor / 2) : (float)def->hierarchy_factor / 2.0f;
    return threshold;
}

/* Not lost to the random drop. */
static bool is_drawn(const adjust_def *def, int level, uint64_t slot)
{
    return rng_uniform(def->seed, def->step * ADJUST_MAX_LEVELS + (uint64_t)level, slot) >
           ldexpf(1.0f, -(level + 1));
}

static gbt_status collect_gaussians(growth *g, int level, float size, gbt_error *err)
{
    const anchors *a = g->a;
    const size_t offsets = (size_t)a->offset_count;
    const float threshold = level_threshold(g->def, level);
    for (size_t slot = 0; slot < a->count * offsets; slot++) {
        const float gradient = mean_gradient(g->stats, slot);
        if (!adjust_well_sampled(g->def, g->stats->grad_count[slot]) || !(gradient >= threshold) ||
            !is_drawn(g->def, level, slot))
            continue;
        const size_t i = slot / offsets;
        candidate mean = {.scale = size, .gradient = gradient, .parent = i};
        for (size_t c = 0; c < 3; c++)
            mean.position[c] =
                a->position[i * 3 + c] + a->offset[slot * 3 + c] * activation_exp(a->scale_log[i * 6 + c]);
        GBT_TRY(add_candidate(g, size, &mean, err));
    }
    return GBT_OK;
}

/* Mean of the Gaussian of the anchor that asks for most; of those that enough views saw, or of all. Below 0
   when there is none. */
static float steepest_gradient(const growth *g, size_t anchor, bool well_sampled)
{
    const size_t offsets = (size_t)g->a->offset_count;
    float steepest = -1;
    for (size_t slot = anchor * offsets; slot < (anchor + 1) * offsets; slot++)
        if (!well_sampled || adjust_well_sampled(g->def, g->stats->grad_count[slot]))
            steepest = fmaxf(steepest, mean_gradient(g->stats, slot));
    return steepest;
}

/* Known surface is worth more than what Gaussians guess: where it makes good for a start, the coarsest
   level's threshold will do. */
static gbt_status collect_places(growth *g, float size, gbt_error *err)
{
    const adjust_def *def = g->def;
    const bool as_start = def->place_scale != NULL;
    const int finest = def->level_count - 1;
    const float threshold = level_threshold(def, as_start ? 0 : finest),
                finest_size = level_cell_size(def, finest);
    for (size_t p = 0; p < def->place_count; p++) {
        const size_t parent = def->place_anchor[p];
        candidate known = {.scale = as_start ? def->place_scale[p] : finest_size,
                           .parent = parent,
                           .gradient = steepest_gradient(g, parent, !as_start)};
        memcpy(known.position, def->place + 3 * p, sizeof known.position);
        if (known.gradient >= threshold)
            GBT_TRY(add_candidate(g, size, &known, err));
    }
    return GBT_OK;
}

/* Unless it may not stand there. */
static gbt_status add_new_anchor(growth *g, const cell *c, int level, float size, gbt_error *err)
{
    const adjust_def *def = g->def;
    float position[3];
    for (int k = 0; k < 3; k++) /* there is surface; the middle of a cell is where the cell is */
        position[k] = def->at_cell_center ? (float)c->at[k] * size : c->position[k];
    if (level < def->level_count && def->may_stand != NULL &&
        !def->may_stand(def->may_stand_context, position))
        return GBT_OK;
    new_anchors *n = g->out;
    void *rows = n->rows;
    GBT_TRY(mem_reserve(&rows, &n->capacity, n->count, n->count + 1, sizeof *n->rows, "growth", err));
    n->rows = rows;
    new_anchor *f = &n->rows[n->count++];
    *f = (new_anchor){.position = {position[0], position[1], position[2]},
                      .scale = c->scale,
                      .gradient = c->gradient,
                      .level = level,
                      .at = {c->at[0], c->at[1], c->at[2]},
                      .feature = c->feature};
    return GBT_OK;
}

/* The level after the last is that of places: they stand closer than v where there is much to see, so their
   cells are finer. */
static gbt_status grow_level(growth *g, int level, gbt_error *err)
{
    const float size = level_cell_size(g->def, level);
    const bool at_places = level == g->def->level_count;
    if (!(size > 0.0f && size < HUGE_VALF))
        return GBT_OK;
    g->cell_count = 0;
    if (g->table_size > 0)
        memset(g->table, 0, g->table_size * sizeof *g->table);
    GBT_TRY(at_places ? collect_places(g, size, err) : collect_gaussians(g, level, size, err));
    if (g->cell_count == 0)
        return GBT_OK;
    for (size_t i = 0; i < g->a->count; i++)
        mark_occupied(g, g->a->position + i * 3, size);
    for (size_t i = 0; i < g->out->count; i++)
        mark_occupied(g, g->out->rows[i].position, size);
    qsort(g->cells, g->cell_count, sizeof *g->cells, by_cell);
    for (size_t i = 0; i < g->cell_count; i++)
        if (!g->cells[i].occupied)
            GBT_TRY(add_new_anchor(g, &g->cells[i], level, size, err));
    return GBT_OK;
}

gbt_status new_anchors_find(const anchors *a, const adjust_stats *stats, const adjust_def *def,
                            new_anchors *out, gbt_error *err)
{
    growth g = {.a = a, .stats = stats, .def = def, .out = out};
    const int levels = def->level_count + (def->place_count > 0);
    gbt_status status = GBT_OK;
    for (int level = 0; level < levels && status == GBT_OK; level++) {
        if (def->coarse_level_gates && level > 0 && out->count == 0)
            break;
        status = grow_level(&g, level, err);
    }
    mem_free(g.cells);
    mem_free(g.table);
    return status;
}

void new_anchors_keep_largest(new_anchors *n, size_t room)
{
    if (n->count <= room)
        return;
    qsort(n->rows, n->count, sizeof *n->rows, by_gradient);
    n->count = room;
    qsort(n->rows, n->count, sizeof *n->rows, by_level_and_cell);
}

void new_anchors_free(new_anchors *n)
{
    mem_free(n->rows);
    mem_free(n->feature);
    memset(n, 0, sizeof *n);
}
