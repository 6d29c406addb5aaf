/* SPDX-License-Identifier: Apache-2.0 */
/* growth/round.c -- one growth round: add anchors where gradients are large, remove those of low importance.

   statistics --> candidates (from_*.c) --> cells (search.c) --> new anchors ---+
        |                                                                       +--> survivors, then new rows
        +--> judged and unimportant (pruning.c) --> pruned ---------------------+

   Everything is decided and allocated before the first row moves, so a failure leaves anchors and statistics
   as they were. */
#include "growth/growth.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "growth/pruning.h"
#include "growth/sources.h"

enum { ROW_BLOCK = 1024 };

growth_def growth_def_default(void)
{
    return (growth_def){.voxel_size = 0.0f,
                        .level_count = 3,
                        .init_factor = 16,
                        .hierarchy_factor = 4,
                        .grad_threshold = 2e-4f,
                        .importance_min = 0.005f,
                        .interval = 100.0f,
                        .shape_log_max = INFINITY,
                        .max_anchors = SIZE_MAX,
                        .seed = 0,
                        .step = 0,
                        .grow = true,
                        .may_stand = growth_anywhere};
}

static gbt_status check_arguments(const anchors *a, const growth_stats *stats, const growth_def *def,
                                  gbt_error *err)
{
    if (stats->count != a->count || (a->count > 0 && stats->offset_count != a->offset_count))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "growth: statistics of %zu anchors with %d offsets (wanted %zu, %d)", stats->count,
                         stats->offset_count, a->count, a->offset_count);
    if (a->count > UINT32_MAX / ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_NO_MEMORY, "growth: %zu anchors (wanted at most %u)", a->count,
                         (unsigned)(UINT32_MAX / ANCHOR_MAX_OFFSETS));
    if (def->level_count < 0 || def->level_count > GROWTH_MAX_LEVELS || def->init_factor < 1 ||
        def->hierarchy_factor < 1)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "growth: %d levels, factors %d and %d (wanted 0 to %d, and both at least 1)",
                         def->level_count, def->init_factor, def->hierarchy_factor, GROWTH_MAX_LEVELS);
    for (size_t p = 0; p < def->points.count; p++)
        if (def->points.anchor[p] >= a->count)
            return base_fail(err, GBT_ERR_ARGUMENT, "growth: point %zu is anchor %u's (wanted below %zu)", p,
                             (unsigned)def->points.anchor[p], a->count);
    if (!(def->grad_threshold >= 0.0f) || !(def->interval >= 0.0f) || isnan(def->shape_log_max))
        return base_fail(err, GBT_ERR_ARGUMENT, "growth: threshold %g, interval %g (wanted both >= 0)",
                         (double)def->grad_threshold, (double)def->interval);
    return GBT_OK;
}

typedef struct round_job {
    anchors *a;
    growth_stats *stats;
    const growth_def *def;
} round_job;

/* Reset the statistics that this round has used. */
static void reset_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const round_job *job = context;
    growth_stats *s = job->stats;
    const size_t offsets = (size_t)s->offset_count;
    for (size_t i = begin; i < end; i++)
        if (growth_is_judged(job->def, s->visit_count[i]))
            s->importance_accum[i] = s->visit_count[i] = s->shown_count[i] = 0;
    for (size_t k = begin * offsets; k < end * offsets; k++)
        if (job->def->grow && growth_well_sampled(job->def, s->grad_count[k]))
            s->grad_accum[k] = s->grad_count[k] = 0;
}

static void cut_scales(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const round_job *job = context;
    for (size_t i = begin; i < end; i++)
        for (size_t c = 3; c < 6; c++)
            job->a->scale_log[i * 6 + c] = fminf(job->a->scale_log[i * 6 + c], job->def->shape_log_max);
}

/* Move surviving rows up, keeping their order. */
static void compact(const round_job *job, const bool *pruned, size_t *source)
{
    anchors *a = job->a;
    growth_stats *s = job->stats;
    size_t left = 0;
    for (size_t i = 0; i < a->count; i++)
        if (!pruned[i])
            source[left++] = i;
    rows_keep(a->field, anchor_fields, ANCHOR_FIELDS, a->offset_count, source, left);
    rows_keep(s->field, growth_stat_fields, GROWTH_STATS, s->offset_count, source, left);
    parallel_blocks(left, ROW_BLOCK, reset_block, (void *)job);
    a->count = s->count = left;
}

/* Write the new anchors; all other fields of their rows are already zero. */
static void append(anchors *a, const new_anchors *n, size_t first)
{
    for (size_t i = 0; i < n->count; i++) {
        const new_anchor *f = &n->rows[i];
        const size_t row = first + i;
        memcpy(a->position + row * 3, f->position, sizeof f->position);
        memcpy(a->feature + row * ANCHOR_FEATURE_DIM, n->feature + f->feature * ANCHOR_FEATURE_DIM,
               ANCHOR_FEATURE_DIM * sizeof(float));
        for (size_t c = 0; c < 6; c++)
            a->scale_log[row * 6 + c] = (float)log((double)f->scale);
    }
}

/* Apply the decisions: memory is reserved first, after that nothing can fail. */
static gbt_status apply(anchors *a, growth_stats *stats, const growth_def *def, const new_anchors *n,
                        const bool *pruned, size_t survivors, growth_result *out, gbt_error *err)
{
    const size_t before = a->count, after = survivors + n->count, widest = after > before ? after : before;
    size_t *source = mem_alloc(survivors, sizeof *source, "growth", err);
    gbt_status status = source == NULL ? GBT_ERR_NO_MEMORY : anchors_resize(a, widest, err);
    if (status == GBT_OK)
        status = growth_stats_resize(stats, widest, a->offset_count, err);
    a->count = before;
    if (status != GBT_OK) {
        mem_free(source);
        return status;
    }
    round_job job = {a, stats, def};
    compact(&job, pruned, source);
    (void)anchors_resize(a, after, NULL);
    (void)growth_stats_resize(stats, after, a->offset_count, NULL);
    append(a, n, survivors);
    parallel_blocks(after, ROW_BLOCK, cut_scales, &job);
    *out = (growth_result){.grown = n->count,
                           .pruned = before - survivors,
                           .count = after,
                           .survivors = survivors,
                           .source = source};
    return GBT_OK;
}

static gbt_status find_new_anchors(const anchors *a, const growth_stats *stats, const growth_def *def,
                                   new_anchors *out, gbt_error *err)
{
    static gbt_status (*const sources[])(growth_search *, gbt_error *) = {
#define X(source) source,
        GROWTH_SOURCES(X)
#undef X
    };
    growth_search search = {.a = a, .stats = stats, .def = def, .out = out};
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < sizeof sources / sizeof *sources && status == GBT_OK; i++)
        status = sources[i](&search, err);
    growth_search_free(&search);
    return status;
}

gbt_status growth_round(anchors *a, growth_stats *stats, const growth_def *def, growth_result *out,
                        gbt_error *err)
{
    memset(out, 0, sizeof *out);
    GBT_TRY(check_arguments(a, stats, def, err));
    new_anchors added = {0};
    bool *pruned = mem_calloc(a->count, sizeof *pruned, "growth", err);
    gbt_status status = pruned == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK && def->grow)
        status = find_new_anchors(a, stats, def, &added, err);
    if (status == GBT_OK) {
        size_t most_important, survivors = growth_mark_pruned(stats, def, pruned, &most_important);
        /* Anchors that pruning removes do not count towards the cap; the cap never removes an existing
           anchor. */
        new_anchors_keep_largest(&added, def->max_anchors > survivors ? def->max_anchors - survivors : 0);
        const bool keep_last = survivors + added.count == 0 && a->count > 0;
        if (keep_last) {
            pruned[most_important] = false;
            survivors = 1;
        }
        status = apply(a, stats, def, &added, pruned, survivors, out, err);
        out->kept_last = keep_last && status == GBT_OK;
    }
    mem_free(pruned);
    new_anchors_free(&added);
    return status;
}
