/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/adjust.c -- where the scene needs more anchors, and which ones it can do without.

   statistics --> new anchors (new_anchors.c) ----+
        |                                         +--> survivors, then new rows
        +--> judged and transparent --> pruned ---+

   Everything is decided and allocated before the first row moves, so a failure leaves anchors and statistics
   as they were. */
#include "anchor/adjust.h"

#include <math.h>
#include <string.h>

#include "anchor/new_anchors.h"
#include "anchor/rows.h"
#include "base/fail.h"
#include "base/memory.h"

/* ---- statistics ---- */

const row_field adjust_stat_fields[ADJUST_STATS] = {
#define X(name, per_offset, meaning) {#name, #name, 1, per_offset},
    ADJUST_STAT_LIST(X)
#undef X
};

gbt_status adjust_stats_resize(adjust_stats *s, size_t count, int offset_count, gbt_error *err)
{
    if (offset_count < 1 || offset_count > ANCHOR_MAX_OFFSETS ||
        (s->count > 0 && offset_count != s->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT, "statistics: offset_count %d (wanted 1 to %d, constant)",
                         offset_count, ANCHOR_MAX_OFFSETS);
    if (offset_count != s->offset_count)
        s->capacity = 0; /* no rows are in use: arrays of another width must be made */
    GBT_TRY(rows_resize(s->field, adjust_stat_fields, ADJUST_STATS, offset_count, &s->capacity, s->count,
                        count, "statistics", err));
    s->count = count;
    s->offset_count = offset_count;
    return GBT_OK;
}

void adjust_stats_free(adjust_stats *s)
{
    for (int f = 0; f < ADJUST_STATS; f++)
        mem_free(s->field[f]);
    memset(s, 0, sizeof *s);
}

adjust_def adjust_def_default(void)
{
    return (adjust_def){.voxel_size = 0.0f,
                        .level_count = 3,
                        .init_factor = 16,
                        .hierarchy_factor = 4,
                        .grad_threshold = 2e-4f,
                        .min_use = 0.005f,
                        .interval = 100.0f,
                        .success_threshold = 0.8f,
                        .shape_log_max = INFINITY,
                        .max_anchors = SIZE_MAX,
                        .seed = 0,
                        .step = 0,
                        .grow = true,
                        .prune = true};
}

/* ---- adjusting ---- */

static bool judged(const adjust_def *def, float visit_count)
{
    return visit_count > def->interval * def->success_threshold;
}

static bool is_pruned(const adjust_stats *stats, const adjust_def *def, size_t i)
{
    return def->prune && judged(def, stats->visit_count[i]) &&
           stats->use_accum[i] < def->min_use * stats->visit_count[i];
}

static gbt_status check_arguments(const anchors *a, const adjust_stats *stats, const adjust_def *def,
                                  gbt_error *err)
{
    if (stats->count != a->count || (a->count > 0 && stats->offset_count != a->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "adjust: statistics of %zu anchors with %d offsets (wanted %zu, %d)", stats->count,
                         stats->offset_count, a->count, a->offset_count);
    if (a->count > UINT32_MAX / ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_NO_MEMORY, "adjust: %zu anchors (wanted at most %u)", a->count,
                         (unsigned)(UINT32_MAX / ANCHOR_MAX_OFFSETS));
    if (def->level_count < 0 || def->level_count > ADJUST_MAX_LEVELS || def->init_factor < 1 ||
        def->hierarchy_factor < 1)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "adjust: %d levels, factors %d and %d (wanted 0 to %d, and both at least 1)",
                         def->level_count, def->init_factor, def->hierarchy_factor, ADJUST_MAX_LEVELS);
    for (size_t p = 0; p < def->place_count; p++)
        if (def->place_anchor[p] >= a->count)
            return base_fail(err, GBT_ERR_ARGUMENT, "adjust: place %zu is anchor %u's (wanted below %zu)", p,
                             (unsigned)def->place_anchor[p], a->count);
    if (!(def->grad_threshold >= 0.0f) || !(def->interval >= 0.0f) || !(def->success_threshold >= 0.0f) ||
        isnan(def->shape_log_max))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "adjust: threshold %g, interval %g, success %g (wanted all >= 0)",
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
        rows_move(a->field, anchor_fields, ANCHOR_FIELDS, a->offset_count, to, a->field, i);
        const bool used = def->prune && judged(def, s->visit_count[i]);
        s->use_accum[to] = used ? 0.0f : s->use_accum[i];
        s->visit_count[to] = used ? 0.0f : s->visit_count[i];
        for (size_t k = 0; k < offsets; k++) {
            const bool sampled = def->grow && adjust_well_sampled(def, s->grad_count[i * offsets + k]);
            s->grad_accum[to * offsets + k] = sampled ? 0.0f : s->grad_accum[i * offsets + k];
            s->grad_count[to * offsets + k] = sampled ? 0.0f : s->grad_count[i * offsets + k];
        }
        to++;
    }
    return to;
}

/* Marks what goes by the rule; returns how many stay. */
static size_t judge(const anchors *a, const adjust_stats *stats, const adjust_def *def, bool *pruned,
                    size_t *most_opaque)
{
    size_t survivors = 0;
    *most_opaque = 0;
    for (size_t i = 0; i < a->count; i++) {
        pruned[i] = is_pruned(stats, def, i);
        survivors += !pruned[i];
        if (stats->use_accum[i] * stats->visit_count[*most_opaque] >
            stats->use_accum[*most_opaque] * stats->visit_count[i])
            *most_opaque = i;
    }
    return survivors;
}

/* Rows are zero but for what is set here. */
static void append(anchors *a, const new_anchors *n, size_t first, int64_t *source)
{
    for (size_t i = 0; i < n->count; i++) {
        const new_anchor *f = &n->rows[i];
        const size_t row = first + i;
        source[row] = -1;
        memcpy(a->position + row * 3, f->position, sizeof f->position);
        memcpy(a->feature + row * ANCHOR_FEATURE_DIM, n->feature + f->feature * ANCHOR_FEATURE_DIM,
               ANCHOR_FEATURE_DIM * sizeof(float));
        for (size_t c = 0; c < 6; c++)
            a->scale_log[row * 6 + c] = (float)log((double)f->scale);
    }
}

/* With what was decided: the room is made first, then nothing can fail. */
static gbt_status apply(anchors *a, adjust_stats *stats, const adjust_def *def, const new_anchors *n,
                        const bool *pruned, size_t survivors, adjust_result *out, gbt_error *err)
{
    const size_t before = a->count, after = survivors + n->count, widest = after > before ? after : before;
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
    append(a, n, survivors, source);
    for (size_t i = 0; i < after; i++)
        for (size_t c = 3; c < 6; c++)
            a->scale_log[i * 6 + c] = fminf(a->scale_log[i * 6 + c], def->shape_log_max);
    *out = (adjust_result){.grown = n->count, .pruned = before - survivors, .count = after, .source = source};
    return GBT_OK;
}

gbt_status anchors_adjust(anchors *a, adjust_stats *stats, const adjust_def *def, adjust_result *out,
                          gbt_error *err)
{
    memset(out, 0, sizeof *out);
    GBT_TRY(check_arguments(a, stats, def, err));
    new_anchors added = {0};
    bool *pruned = mem_calloc(a->count, sizeof *pruned, "adjust", err);
    gbt_status status = pruned == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK && def->grow)
        status = new_anchors_find(a, stats, def, &added, err);
    if (status == GBT_OK) {
        size_t most_opaque, survivors = judge(a, stats, def, pruned, &most_opaque);
        /* The cap counts the room that pruning makes; it never removes an anchor by itself. */
        new_anchors_keep_largest(&added, def->max_anchors > survivors ? def->max_anchors - survivors : 0);
        const bool keep_last = survivors + added.count == 0 && a->count > 0;
        if (keep_last) {
            pruned[most_opaque] = false;
            survivors = 1;
        }
        status = apply(a, stats, def, &added, pruned, survivors, out, err);
        out->kept_last = keep_last && status == GBT_OK;
    }
    mem_free(pruned);
    new_anchors_free(&added);
    return status;
}
