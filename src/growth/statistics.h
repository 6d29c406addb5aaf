/* SPDX-License-Identifier: Apache-2.0 */
/* growth/statistics.h -- per-anchor and per-Gaussian statistics, gathered over steps, on which growth and
   pruning are based. */
#ifndef GBT_GROWTH_STATISTICS_H
#define GBT_GROWTH_STATISTICS_H

#include "anchor/rows.h"
#include "frame/frame.h"

/** The arrays, listed once: X(name, name in checkpoints, per_offset, meaning). */
#define GROWTH_STAT_LIST(X)                                                                                  \
    X(importance_accum, "use_accum", false, "sum over views of the anchor's importance")                     \
    X(visit_count, "visit_count", false, "views in which the anchor was visible")                            \
    X(shown_count, "shown_count", false, "views that its importance is the mean over")                       \
    X(grad_accum, "grad_accum", true, "sum of screen-space gradient norms")                                  \
    X(grad_count, "grad_count", true, "views in which the Gaussian was seen")

enum {
#define X(name, label, per_offset, meaning) GROWTH_STAT_##name,
    GROWTH_STAT_LIST(X)
#undef X
        GROWTH_STATS
};
extern const row_field growth_stat_fields[GROWTH_STATS];

/** Statistics since the last round, with one row per anchor. Start from {0}. */
typedef struct growth_stats {
    size_t count, capacity;
    int offset_count;
    union { /* owned arrays, [count] or [count][K]: by name, or in order */
        struct {
#define X(name, label, per_offset, meaning) float *name;
            GROWTH_STAT_LIST(X)
#undef X
        };
        float *field[GROWTH_STATS];
    };
} growth_stats;

/** Resize: the first min(old, new) rows are kept, new rows are zero. offset_count must not change while there
    are rows. On failure nothing changes. */
gbt_status growth_stats_resize(growth_stats *s, size_t count, int offset_count, gbt_error *err);
void growth_stats_free(growth_stats *s);

/** How an anchor's importance is measured. */
typedef enum growth_importance {
    GROWTH_BY_SHARE,  /* share of the image that its Gaussians cover: mean over rays of T alpha, averaged over
                         the views that show the anchor. Views in which it is occluded say nothing about its
                         importance and are left out */
    GROWTH_BY_OPACITY /* sum of the decoded opacities of its Gaussians, over all views in which it is visible,
                         as in the reference */
} growth_importance;

/** The views in which a Gaussian counts as seen. */
typedef enum growth_counting {
    GROWTH_COUNT_BLENDED, /* a ray, or a splat's pixel, blended it: any lens */
    GROWTH_COUNT_IN_CONE  /* it touches the view cone of a centred pinhole, occluded or not, as in the
                             reference */
} growth_counting;

/** Add the statistics of the last render of anchors and its adjoint (frame_backward_gaussians()). `t_near` is
    the near plane of the cone of GROWTH_COUNT_IN_CONE. `s` has a row for each anchor, or only for each
    visible one, in their order. Threads: uses all; same bits for every number. */
void growth_stats_gather(growth_stats *s, const frame *f, growth_importance importance,
                         growth_counting counting, float t_near);

/** Mean gradient of the Gaussian `slot` (anchor * K + offset) over the views that saw it; 0 when none did. */
static inline float growth_mean_gradient(const growth_stats *s, size_t slot)
{
    return s->grad_count[slot] > 0 ? s->grad_accum[slot] / s->grad_count[slot] : 0;
}

#endif
