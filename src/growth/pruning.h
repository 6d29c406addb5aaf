/* SPDX-License-Identifier: Apache-2.0 */
/* growth/pruning.h -- which anchors the scene can do without. */
#ifndef GBT_GROWTH_PRUNING_H
#define GBT_GROWTH_PRUNING_H

#include "growth/growth.h"

/** Was the anchor visible in enough views for its importance to say something? */
static inline bool growth_is_judged(const growth_def *def, float visit_count)
{
    return visit_count > def->interval * GROWTH_SUCCESS;
}

/**
 * Mark what goes by the rule.
 *
 * @param pruned         [out] [stats->count]
 * @param most_important [out] the anchor with the largest mean importance; 0 when there are none
 * @return how many stay
 */
size_t growth_mark_pruned(const growth_stats *stats, const growth_def *def, bool *pruned,
                          size_t *most_important);

#endif
