/* SPDX-License-Identifier: Apache-2.0 */
/* growth/pruning.h -- decide which anchors a round removes. */
#ifndef GBT_GROWTH_PRUNING_H
#define GBT_GROWTH_PRUNING_H

#include "growth/growth.h"

/** Was the anchor in view often enough for its importance to be reliable? */
static inline bool growth_is_judged(const growth_def *def, float visit_count)
{
    return visit_count > def->interval * GROWTH_VIEW_SHARE;
}

/**
 * Mark the anchors to be pruned.
 *
 * @param pruned         [out] [stats->count]
 * @param most_important [out] the anchor with the largest mean importance; 0 when there are none
 * @return number of anchors that stay
 */
size_t growth_mark_pruned(const growth_stats *stats, const growth_def *def, bool *pruned,
                          size_t *most_important);

#endif
