/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/new_anchors.h -- where growing would put anchors, and what they begin with; nothing of the model
   changes here. */
#ifndef GBT_ANCHOR_NEW_ANCHORS_H
#define GBT_ANCHOR_NEW_ANCHORS_H

#include "anchor/adjust.h"

typedef struct new_anchor {
    float position[3];
    float scale;    /* of all three axes */
    float gradient; /* of the candidate that it stands at */
    int level;
    int64_t at[3];  /* its cell in the grid of the level */
    size_t feature; /* row of new_anchors.feature */
} new_anchor;

/** By level, then cell (x, y, z). Start from {0}; free with new_anchors_free() after success or failure. */
typedef struct new_anchors {
    new_anchor *rows;
    size_t count, capacity;
    float *feature; /* [feature_count][ANCHOR_FEATURE_DIM]: maxima over the parents of a cell's candidates;
                       cells that hold an anchor already have rows too */
    size_t feature_count, feature_capacity;
} new_anchors;

/** Was the Gaussian seen in enough views for its mean gradient to say something? */
static inline bool adjust_well_sampled(const adjust_def *def, float grad_count)
{
    return grad_count > def->interval * def->success_threshold * 0.5f;
}

/**
 * The growing of anchors_adjust(), whose rules stand there; the cap is not applied.
 *
 * @param stats [in] rows match `a`
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Deterministic. Cost: O(N K) and one hash set per level.
 */
gbt_status new_anchors_find(const anchors *a, const adjust_stats *stats, const adjust_def *def,
                            new_anchors *out, gbt_error *err);

/** At most `room` stay: those with the largest gradients, ties by level, then cell. */
void new_anchors_keep_largest(new_anchors *n, size_t room);

void new_anchors_free(new_anchors *n);

#endif
