/* anchor/adjust.c -- where the scene needs more anchors, and which ones it can do without.

   statistics --> candidates per level --> cells without an anchor --> new anchors --+
        |                                                                            +--> survivors, then new rows
        +--> judged and transparent --> pruned --------------------------------------+

   Everything is decided and allocated before the first row moves, so a failure leaves anchors and statistics as they were. */
#include "anchor/adjust.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "anchor/activations.h"
#include "anchor/rows.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"

enum { LEVEL_MAX = 8 /* streams per step of the random candidate drop */ };

/* ---- statistics -------------------------------------------------------------------------------------------------------------- */

gbt_status adjust_stats_resize(adjust_stats *s, size_t count, int offset_count, gbt_error *err)
{
    if (offset_count < 1 || offset_count > ANCHOR_MAX_OFFSETS || (s->count > 0 && offset_count != s->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT, "statistics: offset_count %d (wanted 1 to %d, constant)", offset_count, ANCHOR_MAX_OFFSETS);
    const size_t widths[ROWS_FIELDS] = {1, 1, (size_t)offset_count, (size_t)offset_count};
    float **const fields[ROWS_FIELDS] = {&s->use_accum, &s->visit_count, &s->grad_accum, &s->grad_count};
    if (offset_count != s->offset_count)
        s->capacity = 0; /* no rows are in use: arrays of another width must be made */
    GBT_TRY(rows_resize(fields, widths, &s->capacity, s->count, count, "statistics", err));
    s->count = count;
    s->offset_count = offset_count;
    return GBT_OK;
}

void adjust_stats_free(adjust_stats *s)
{
    mem_free(s->use_accum);
    mem_free(s->visit_count);
    mem_free(s->grad_accum);
    mem_free(s->grad_count);
    memset(s, 0, sizeof *s);
}

adjust_def adjust_def_default(void)
{
    return (adjust_def){.voxel_size = 0.0f, .level_count = 3, .init_factor = 16, .hierarchy_factor = 4, .grad_threshold = 2e-4f,
                        .min_use = 0.005f, .interval = 100.0f, .success_threshold = 0.8f, .shape_log_max = INFINITY,
                        .max_anchors = SIZE_MAX, .compat = false, .seed = 0, .step = 0, .grow = true, .prune = true};
}

/* ---- cells ------------------------------------------------------------------------------------------------------------------- */

typedef struct cell {
    int64_t at[3];
    float position[3], gradient; /* of the candidate with the largest gradient */
    size_t feature;   /* row of growth.feature */
    bool occupied;
} cell;

/* New anchors of all levels so far. */
typedef struct fresh {
    float position[3];
    float scale;
    float gradient;
    int level;
    int64_t at[3];
    size_t feature;
} fresh;

typedef struct growth {
    const anchors *a;
    const adjust_stats *stats;
    const adjust_def *def;
    fresh *added;
    size_t added_count, added_capacity;
    float *feature; /* [feature_count][32]: maxima over the parents of a cell's candidates */
    size_t feature_count, feature_capacity;
    cell *cells; /* of the current level */
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
    g->table = table, g->table_size = size;
    memset(g->table, 0, size * sizeof *g->table);
    for (size_t i = 0; i < g->cell_count; i++)
        g->table[find_slot(g, g->cells[i].at)] = (uint32_t)(i + 1);
    return GBT_OK;
}

static gbt_status add_candidate(growth *g, const int64_t at[3], const float position[3], size_t parent, float gradient, gbt_error *err)
{
    if ((g->cell_count + 1) * 2 > g->table_size)
        GBT_TRY(grow_table(g, err));
    const float *feature = g->a->feature + parent * ANCHOR_FEATURE_DIM;
    const size_t slot = find_slot(g, at);
    if (g->table[slot] != 0) {
        cell *known = &g->cells[g->table[slot] - 1];
        float *best = g->feature + known->feature * ANCHOR_FEATURE_DIM;
        if (gradient > known->gradient) {
            known->gradient = gradient;
            memcpy(known->position, position, sizeof known->position);
        }
        for (int i = 0; i < ANCHOR_FEATURE_DIM; i++)
            best[i] = fmaxf(best[i], feature[i]);
        return GBT_OK;
    }
    void *cells = g->cells, *features = g->feature;
    GBT_TRY(mem_reserve(&cells, &g->cell_capacity, g->cell_count, g->cell_count + 1, sizeof *g->cells, "growth", err));
    g->cells = cells;
    GBT_TRY(mem_reserve(&features, &g->feature_capacity, g->feature_count, g->feature_count + 1, ANCHOR_FEATURE_DIM * sizeof(float),
                        "growth", err));
    g->feature = features;
    memcpy(g->feature + g->feature_count * ANCHOR_FEATURE_DIM, feature, ANCHOR_FEATURE_DIM * sizeof(float));
    g->cells[g->cell_count] = (cell){.at = {at[0], at[1], at[2]}, .position = {position[0], position[1], position[2]}, .gradient = gradient,
                                     .feature = g->feature_count};
    g->feature_count++;
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
    const fresh *x = a, *y = b;
    return x->level != y->level ? x->level - y->level : compare_cells(x->at, y->at);
}

static int by_gradient(const void *a, const void *b)
{
    const fresh *x = a, *y = b;
    if (x->gradient > y->gradient || x->gradient < y->gradient)
        return x->gradient > y->gradient ? -1 : 1;
    return by_level_and_cell(a, b);
}

/* ---- growing ----------------------------------------------------------------------------------------------------------------- */

static bool well_sampled(const adjust_def *def, float grad_count)
{
    return grad_count > def->interval * def->success_threshold * 0.5f;
}

static float level_cell_size(const adjust_def *def, int level)
{
    double divisor = 1;
    for (int i = 0; i < level; i++)
        divisor *= def->hierarchy_factor;
    const double factor = def->init_factor / divisor;
    return def->voxel_size * (float)(def->compat ? floor(factor) : factor); /* the reference divides integers: 4 / 16 is 0 */
}

/* Mean over the views that saw the Gaussian; -1 when they were too few. */
static float mean_gradient(const growth *g, size_t slot)
{
    const float count = g->stats->grad_count[slot];
    return well_sampled(g->def, count) ? g->stats->grad_accum[slot] / count : -1;
}

static float level_threshold(const adjust_def *def, int level)
{
    float threshold = def->grad_threshold;
    for (int i = 0; i < level; i++) /* integer division in the reference */
        threshold *= def->compat ? (float)(def->hierarchy_factor / 2) : (float)def->hierarchy_factor / 2.0f;
    return threshold;
}

/* Not lost to the random drop. */
static bool is_drawn(const adjust_def *def, int level, uint64_t slot)
{
    return rng_uniform(def->seed, def->step * LEVEL_MAX + (uint64_t)level, slot) > ldexpf(1.0f, -(level + 1));
}

static gbt_status collect_gaussians(growth *g, int level, float size, gbt_error *err)
{
    const anchors *a = g->a;
    const size_t offsets = (size_t)a->offset_count;
    const float threshold = level_threshold(g->def, level);
    for (size_t slot = 0; slot < a->count * offsets; slot++) {
        const float gradient = mean_gradient(g, slot);
        if (!(gradient >= threshold) || !is_drawn(g->def, level, slot))
            continue;
        const size_t i = slot / offsets;
        float mean[3];
        int64_t at[3];
        for (size_t c = 0; c < 3; c++)
            mean[c] = a->position[i * 3 + c] + a->offset[slot * 3 + c] * activation_exp(a->scale_log[i * 6 + c]);
        if (cell_of(mean, size, at))
            GBT_TRY(add_candidate(g, at, mean, i, gradient, err));
    }
    return GBT_OK;
}

/* Asked for as at the finest level. */
static gbt_status collect_places(growth *g, float size, gbt_error *err)
{
    const adjust_def *def = g->def;
    const size_t offsets = (size_t)g->a->offset_count;
    const float threshold = level_threshold(def, def->level_count - 1);
    for (size_t p = 0; p < def->place_count; p++) {
        const size_t i = def->place_anchor[p];
        float gradient = -1;
        for (size_t k = 0; k < offsets; k++)
            gradient = fmaxf(gradient, mean_gradient(g, i * offsets + k));
        int64_t at[3];
        if (gradient >= threshold && cell_of(def->place + p * 3, size, at))
            GBT_TRY(add_candidate(g, at, def->place + p * 3, i, gradient, err));
    }
    return GBT_OK;
}

/* The level after the last is that of places: they stand closer than v where there is much to see, so their cells are finer. */
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
    for (size_t i = 0; i < g->added_count; i++)
        mark_occupied(g, g->added[i].position, size);
    qsort(g->cells, g->cell_count, sizeof *g->cells, by_cell);
    for (size_t i = 0; i < g->cell_count; i++) {
        const cell *c = &g->cells[i];
        if (c->occupied)
            continue;
        void *added = g->added;
        GBT_TRY(mem_reserve(&added, &g->added_capacity, g->added_count, g->added_count + 1, sizeof *g->added, "growth", err));
        g->added = added;
        fresh *f = &g->added[g->added_count++];
        *f = (fresh){.scale = at_places ? level_cell_size(g->def, level - 1) : size, .gradient = c->gradient, .level = level,
                     .at = {c->at[0], c->at[1], c->at[2]}, .feature = c->feature};
        for (int k = 0; k < 3; k++) /* there is surface; the middle of a cell is where the cell is */
            f->position[k] = g->def->compat ? (float)c->at[k] * size : c->position[k];
    }
    return GBT_OK;
}

static gbt_status grow(growth *g, gbt_error *err)
{
    const int levels = g->def->level_count + (g->def->place_count > 0);
    for (int level = 0; level < levels; level++) {
        if (g->def->compat && level > 0 && g->added_count == 0)
            break;
        GBT_TRY(grow_level(g, level, err));
    }
    return GBT_OK;
}

/* ---- all together ------------------------------------------------------------------------------------------------------------ */

static bool judged(const adjust_def *def, float visit_count)
{
    return visit_count > def->interval * def->success_threshold;
}

static bool is_pruned(const adjust_stats *stats, const adjust_def *def, size_t i)
{
    return def->prune && judged(def, stats->visit_count[i]) && stats->use_accum[i] < def->min_use * stats->visit_count[i];
}

static gbt_status check_arguments(const anchors *a, const adjust_stats *stats, const adjust_def *def, gbt_error *err)
{
    if (stats->count != a->count || (a->count > 0 && stats->offset_count != a->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT, "adjust: statistics of %zu anchors with %d offsets (wanted %zu, %d)", stats->count,
                         stats->offset_count, a->count, a->offset_count);
    if (a->count > UINT32_MAX / ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_NO_MEMORY, "adjust: %zu anchors (wanted at most %u)", a->count,
                         (unsigned)(UINT32_MAX / ANCHOR_MAX_OFFSETS));
    if (def->level_count < 0 || def->level_count > LEVEL_MAX || def->init_factor < 1 || def->hierarchy_factor < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "adjust: %d levels, factors %d and %d (wanted 0 to %d, and both at least 1)",
                         def->level_count, def->init_factor, def->hierarchy_factor, LEVEL_MAX);
    for (size_t p = 0; p < def->place_count; p++)
        if (def->place_anchor[p] >= a->count)
            return base_fail(err, GBT_ERR_ARGUMENT, "adjust: place %zu is anchor %u's (wanted below %zu)", p,
                             (unsigned)def->place_anchor[p], a->count);
    if (!(def->grad_threshold >= 0.0f) || !(def->interval >= 0.0f) || !(def->success_threshold >= 0.0f) || isnan(def->shape_log_max))
        return base_fail(err, GBT_ERR_ARGUMENT, "adjust: threshold %g, interval %g, success %g (wanted all >= 0)",
                         (double)def->grad_threshold, (double)def->interval, (double)def->success_threshold);
    return GBT_OK;
}

/* Survivors move up in their order; their statistics are reset where they were used. */
static size_t compact(anchors *a, adjust_stats *s, const adjust_def *def, const bool *pruned, int64_t *source)
{
    const size_t offsets = (size_t)a->offset_count, before = a->count;
    size_t to = 0;
    for (size_t i = 0; i < before; i++) {
        if (pruned[i])
            continue;
        source[to] = (int64_t)i;
        memmove(a->position + to * 3, a->position + i * 3, 3 * sizeof(float));
        memmove(a->feature + to * ANCHOR_FEATURE_DIM, a->feature + i * ANCHOR_FEATURE_DIM, ANCHOR_FEATURE_DIM * sizeof(float));
        memmove(a->offset + to * offsets * 3, a->offset + i * offsets * 3, offsets * 3 * sizeof(float));
        memmove(a->scale_log + to * 6, a->scale_log + i * 6, 6 * sizeof(float));
        const bool used = def->prune && judged(def, s->visit_count[i]);
        s->use_accum[to] = used ? 0.0f : s->use_accum[i];
        s->visit_count[to] = used ? 0.0f : s->visit_count[i];
        for (size_t k = 0; k < offsets; k++) {
            const bool sampled = def->grow && well_sampled(def, s->grad_count[i * offsets + k]);
            s->grad_accum[to * offsets + k] = sampled ? 0.0f : s->grad_accum[i * offsets + k];
            s->grad_count[to * offsets + k] = sampled ? 0.0f : s->grad_count[i * offsets + k];
        }
        to++;
    }
    return to;
}

/* Marks what goes by the rule; returns how many stay. */
static size_t judge(const anchors *a, const adjust_stats *stats, const adjust_def *def, bool *pruned, size_t *most_opaque)
{
    size_t survivors = 0;
    *most_opaque = 0;
    for (size_t i = 0; i < a->count; i++) {
        pruned[i] = is_pruned(stats, def, i);
        survivors += !pruned[i];
        if (stats->use_accum[i] * stats->visit_count[*most_opaque] > stats->use_accum[*most_opaque] * stats->visit_count[i])
            *most_opaque = i;
    }
    return survivors;
}

/* The cap counts the room that pruning makes; it never removes an anchor by itself. */
static void keep_largest(growth *g, size_t room)
{
    if (g->added_count <= room)
        return;
    qsort(g->added, g->added_count, sizeof *g->added, by_gradient);
    g->added_count = room;
    qsort(g->added, g->added_count, sizeof *g->added, by_level_and_cell);
}

/* Rows are zero but for what is set here. */
static void append(anchors *a, const growth *g, size_t first, int64_t *source)
{
    for (size_t i = 0; i < g->added_count; i++) {
        const fresh *f = &g->added[i];
        const size_t row = first + i;
        source[row] = -1;
        memcpy(a->position + row * 3, f->position, sizeof f->position);
        memcpy(a->feature + row * ANCHOR_FEATURE_DIM, g->feature + f->feature * ANCHOR_FEATURE_DIM, ANCHOR_FEATURE_DIM * sizeof(float));
        for (size_t c = 0; c < 6; c++)
            a->scale_log[row * 6 + c] = (float)log((double)f->scale);
    }
}

/* With what was decided: the room is made first, then nothing can fail. */
static gbt_status apply(anchors *a, adjust_stats *stats, const adjust_def *def, const growth *g, const bool *pruned, size_t survivors,
                        adjust_result *out, gbt_error *err)
{
    const size_t before = a->count, after = survivors + g->added_count, widest = after > before ? after : before;
    int64_t *source = mem_alloc(after, sizeof *source, "adjust", err);
    gbt_status status = source == NULL ? GBT_ERR_NO_MEMORY : anchors_resize(a, widest, err);
    if (status == GBT_OK)
        status = adjust_stats_resize(stats, widest, a->offset_count, err);
    a->count = before;
    if (status != GBT_OK) {
        mem_free(source);
        return status;
    }
    a->count = stats->count = compact(a, stats, def, pruned, source);
    (void)anchors_resize(a, after, NULL);
    (void)adjust_stats_resize(stats, after, a->offset_count, NULL);
    append(a, g, survivors, source);
    for (size_t i = 0; i < after; i++)
        for (size_t c = 3; c < 6; c++)
            a->scale_log[i * 6 + c] = fminf(a->scale_log[i * 6 + c], def->shape_log_max);
    *out = (adjust_result){.grown = g->added_count, .pruned = before - survivors, .count = after, .source = source};
    return GBT_OK;
}

gbt_status anchors_adjust(anchors *a, adjust_stats *stats, const adjust_def *def, adjust_result *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    GBT_TRY(check_arguments(a, stats, def, err));
    growth g = {.a = a, .stats = stats, .def = def};
    bool *pruned = mem_calloc(a->count, sizeof *pruned, "adjust", err);
    gbt_status status = pruned == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK && def->grow)
        status = grow(&g, err);
    if (status == GBT_OK) {
        size_t most_opaque, survivors = judge(a, stats, def, pruned, &most_opaque);
        keep_largest(&g, def->max_anchors > survivors ? def->max_anchors - survivors : 0);
        const bool keep_last = survivors + g.added_count == 0 && a->count > 0;
        if (keep_last)
            pruned[most_opaque] = false, survivors = 1;
        status = apply(a, stats, def, &g, pruned, survivors, out, err);
        out->kept_last = keep_last && status == GBT_OK;
    }
    mem_free(pruned);
    mem_free(g.added);
    mem_free(g.feature);
    mem_free(g.cells);
    mem_free(g.table);
    return status;
}
