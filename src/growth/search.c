/* SPDX-License-Identifier: Apache-2.0 */
/* growth/search.c -- find free cells with candidates: a grid stored as a hash table of cells. */
#include "growth/search.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { MARK_BLOCK = 2048 /* anchors */, ASK_BLOCK = 64 /* cells */ };

bool growth_anywhere(const void *context, const float position[3])
{
    (void)context;
    (void)position;
    return true;
}

typedef struct cell {
    int64_t at[3];
    float position[3], scale, gradient; /* of the candidate with the largest gradient */
    size_t feature;                     /* row of new_anchors.feature */
    atomic_bool occupied;               /* an anchor is in the cell, or may not be placed there */
} cell;

/* Cell coordinates of a position; false when they exceed 64 bits or the position is not finite. */
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

/* Slot of the cell in the hash table, or the empty slot where it would be inserted. */
static size_t find_slot(const growth_search *s, const int64_t at[3])
{
    size_t slot = cell_hash(at) & (s->table_size - 1);
    while (s->table[slot] != 0 && !same_cell(s->cells[s->table[slot] - 1].at, at))
        slot = (slot + 1) & (s->table_size - 1);
    return slot;
}

static gbt_status grow_table(growth_search *s, gbt_error *err)
{
    const size_t size = s->table_size < 1024 ? 1024 : s->table_size * 2;
    void *table = s->table;
    GBT_TRY(mem_reserve(&table, &s->table_capacity, 0, size, sizeof *s->table, "growth", err));
    s->table = table;
    s->table_size = size;
    memset(s->table, 0, size * sizeof *s->table);
    for (size_t i = 0; i < s->cell_count; i++)
        s->table[find_slot(s, s->cells[i].at)] = (uint32_t)(i + 1);
    return GBT_OK;
}

/* Add a candidate to its cell, which keeps the position of the candidate with the largest gradient and the
   maximum of all parents' features. */
static void merge_candidate(cell *known, float *best, const growth_candidate *c, const float *feature)
{
    if (c->gradient > known->gradient) {
        known->gradient = c->gradient;
        known->scale = c->scale;
        memcpy(known->position, c->position, sizeof known->position);
    }
    for (int i = 0; i < ANCHOR_FEATURE_DIM; i++)
        best[i] = fmaxf(best[i], feature[i]);
}

gbt_status growth_search_add(growth_search *s, const growth_candidate *c, gbt_error *err)
{
    int64_t at[3];
    if (!cell_of(c->position, s->size, at))
        return GBT_OK;
    new_anchors *n = s->out;
    if ((s->cell_count + 1) * 2 > s->table_size)
        GBT_TRY(grow_table(s, err));
    const float *feature = s->a->feature + c->parent * ANCHOR_FEATURE_DIM;
    const size_t slot = find_slot(s, at);
    if (s->table[slot] != 0) {
        cell *known = &s->cells[s->table[slot] - 1];
        merge_candidate(known, n->feature + known->feature * ANCHOR_FEATURE_DIM, c, feature);
        return GBT_OK;
    }
    void *cells = s->cells, *features = n->feature;
    GBT_TRY(mem_reserve(&cells, &s->cell_capacity, s->cell_count, s->cell_count + 1, sizeof *s->cells,
                        "growth", err));
    s->cells = cells;
    GBT_TRY(mem_reserve(&features, &n->feature_capacity, n->feature_count, n->feature_count + 1,
                        ANCHOR_FEATURE_DIM * sizeof(float), "growth", err));
    n->feature = features;
    memcpy(n->feature + n->feature_count * ANCHOR_FEATURE_DIM, feature, ANCHOR_FEATURE_DIM * sizeof(float));
    s->cells[s->cell_count] = (cell){.at = {at[0], at[1], at[2]},
                                     .position = {c->position[0], c->position[1], c->position[2]},
                                     .scale = c->scale,
                                     .gradient = c->gradient,
                                     .feature = n->feature_count++};
    s->table[slot] = (uint32_t)++s->cell_count;
    return GBT_OK;
}

static void mark_occupied(const growth_search *s, const float position[3])
{
    int64_t at[3];
    if (!cell_of(position, s->size, at))
        return;
    const size_t slot = find_slot(s, at);
    if (s->table[slot] != 0)
        atomic_store_explicit(&s->cells[s->table[slot] - 1].occupied, true, memory_order_relaxed);
}

static void mark_anchors(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const growth_search *s = context;
    for (size_t i = begin; i < end; i++)
        mark_occupied(s, s->a->position + i * 3);
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

float growth_cell_size(const growth_def *def, int level)
{
    double divisor = 1;
    for (int i = 0; i < level; i++)
        divisor *= def->hierarchy_factor;
    const double factor = def->init_factor / divisor;
    return def->voxel_size * (float)(def->integer_division ? floor(factor) : factor);
}

float growth_level_threshold(const growth_def *def, int level)
{
    float threshold = def->grad_threshold;
    for (int i = 0; i < level; i++)
        threshold *=
            def->integer_division ? (float)(def->hierarchy_factor / 2) : (float)def->hierarchy_factor / 2.0f;
    return threshold;
}

static gbt_status add_new_anchor(growth_search *s, const cell *c, const float position[3], gbt_error *err)
{
    new_anchors *n = s->out;
    void *rows = n->rows;
    GBT_TRY(mem_reserve(&rows, &n->capacity, n->count, n->count + 1, sizeof *n->rows, "growth", err));
    n->rows = rows;
    new_anchor *f = &n->rows[n->count++];
    *f = (new_anchor){.position = {position[0], position[1], position[2]},
                      .scale = c->scale,
                      .gradient = c->gradient,
                      .level = s->level,
                      .at = {c->at[0], c->at[1], c->at[2]},
                      .feature = c->feature};
    return GBT_OK;
}

bool growth_search_begin(growth_search *s, int level)
{
    s->level = level;
    s->size = growth_cell_size(s->def, level);
    if (s->def->coarse_level_gates && level > 0 && s->out->count == 0)
        return false;
    if (!(s->size > 0.0f && s->size < HUGE_VALF))
        return false;
    s->cell_count = 0;
    if (s->table_size > 0)
        memset(s->table, 0, s->table_size * sizeof *s->table);
    return true;
}

/* Position of a cell's new anchor: that of its candidate, which is near surface, or with at_cell_center the
   cell's centre. */
static void place_in(const growth_search *s, const cell *c, float position[3])
{
    for (int k = 0; k < 3; k++)
        position[k] = s->def->at_cell_center ? (float)c->at[k] * s->size : c->position[k];
}

typedef struct stand_job {
    const growth_search *s;
    bool (*may_stand)(const void *context, const float position[3]);
    const void *context;
} stand_job;

static void ask_places(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const stand_job *job = context;
    for (size_t i = begin; i < end; i++) {
        float position[3];
        place_in(job->s, &job->s->cells[i], position);
        job->s->cells[i].occupied = !job->may_stand(job->context, position);
    }
}

/* Move the free cells to the front; afterwards the hash table is invalid. */
static void drop_occupied(growth_search *s)
{
    size_t left = 0;
    for (size_t i = 0; i < s->cell_count; i++)
        if (!s->cells[i].occupied)
            s->cells[left++] = s->cells[i];
    s->cell_count = left;
}

gbt_status growth_search_end(growth_search *s,
                             bool (*may_stand)(const void *context, const float position[3]),
                             const void *context, gbt_error *err)
{
    if (s->cell_count == 0)
        return GBT_OK;
    stand_job job = {s, may_stand, context};
    parallel_blocks(s->a->count, MARK_BLOCK, mark_anchors, s);
    for (size_t i = 0; i < s->out->count; i++)
        mark_occupied(s, s->out->rows[i].position);
    drop_occupied(s);
    parallel_blocks(s->cell_count, ASK_BLOCK, ask_places, &job);
    drop_occupied(s);
    if (s->cell_count > 0)
        qsort(s->cells, s->cell_count, sizeof *s->cells, by_cell);
    for (size_t i = 0; i < s->cell_count; i++) {
        float position[3];
        place_in(s, &s->cells[i], position);
        GBT_TRY(add_new_anchor(s, &s->cells[i], position, err));
    }
    return GBT_OK;
}

void growth_search_free(growth_search *s)
{
    mem_free(s->cells);
    mem_free(s->table);
    *s = (growth_search){0};
}

/* ---- the new anchors ---- */

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
