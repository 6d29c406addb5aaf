/* SPDX-License-Identifier: Apache-2.0 */
/* growth/pruning.c -- anchors whose mean importance is too small are pruned. */
#include "growth/pruning.h"

static bool is_pruned(const growth_stats *stats, const growth_def *def, size_t i)
{
    return def->prune && growth_is_judged(def, stats->visit_count[i]) &&
           stats->importance_accum[i] < def->importance_min * stats->visit_count[i];
}

size_t growth_mark_pruned(const growth_stats *stats, const growth_def *def, bool *pruned,
                          size_t *most_important)
{
    const float *importance = stats->importance_accum, *visits = stats->visit_count;
    size_t survivors = 0, most = 0;
    for (size_t i = 0; i < stats->count; i++) {
        pruned[i] = is_pruned(stats, def, i);
        survivors += !pruned[i];
        if (importance[i] * visits[most] > importance[most] * visits[i])
            most = i;
    }
    *most_important = most;
    return survivors;
}
