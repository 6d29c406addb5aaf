/* SPDX-License-Identifier: Apache-2.0 */
/* growth/pruning.c -- mark the anchors whose mean importance is too small. */
#include "growth/pruning.h"

#include <math.h>

/* At least 1, so that an anchor that no view shows has importance 0. */
static float shown_count(const growth_stats *stats, size_t i) { return fmaxf(stats->shown_count[i], 1); }

static bool is_pruned(const growth_stats *stats, const growth_def *def, size_t i)
{
    return growth_is_judged(def, stats->visit_count[i]) &&
           stats->importance_accum[i] < def->importance_min * shown_count(stats, i);
}

size_t growth_mark_pruned(const growth_stats *stats, const growth_def *def, bool *pruned,
                          size_t *most_important)
{
    const float *importance = stats->importance_accum;
    size_t survivors = 0, most = 0;
    for (size_t i = 0; i < stats->count; i++) {
        pruned[i] = is_pruned(stats, def, i);
        survivors += !pruned[i];
        if (importance[i] * shown_count(stats, most) > importance[most] * shown_count(stats, i))
            most = i;
    }
    *most_important = most;
    return survivors;
}
