/* SPDX-License-Identifier: Apache-2.0 */
/* growth/growth.h -- one round of growing and pruning anchors (Lu 2024, "Anchor Points Refinement";
   docs/training.md), and its settings. */
#ifndef GBT_GROWTH_GROWTH_H
#define GBT_GROWTH_GROWTH_H

#include "anchor/anchors.h"
#include "growth/statistics.h"

enum { GROWTH_MAX_LEVELS = 8 };

/** Fraction of the views between rounds (growth_def.interval) that makes statistics reliable. */
#define GROWTH_VIEW_SHARE 0.8f

/** Points on known surface, as candidates in addition to the Gaussians. All borrowed. */
typedef struct growth_points {
    size_t count;
    const float *position;  /* [count][3], finite */
    const uint32_t *anchor; /* [count]: row of the nearest anchor, whose Gaussians' gradients decide about the
                               point */
    bool as_start;          /* true: the threshold of the first level, Gaussians count regardless of how many
                               views saw them, and new anchors have the size `scale`; false: threshold and
                               size of the last level, and only Gaussians that enough views saw count */
    const float *scale;     /* [count] > 0, if as_start: initial scale of an anchor there */
} growth_points;

typedef struct growth_def {
    float voxel_size;      /* v: cells are v * init_factor / hierarchy^level */
    int level_count;       /* [0, GROWTH_MAX_LEVELS], default 3 */
    int init_factor;       /* default 16 */
    int hierarchy_factor;  /* default 4 */
    float grad_threshold;  /* tau >= 0, default 2e-4; level j uses tau * (hierarchy/2)^j */
    float importance_min;  /* anchors whose mean importance over the views that show them is lower are pruned.
                              Default 0.005, for importance by opacity */
    float interval;        /* I: number of views whose statistics a round uses, default 100. A Gaussian counts
                              when grad_count > I * GROWTH_VIEW_SHARE * 0.5; an anchor is judged when
                              visit_count > I * GROWTH_VIEW_SHARE. Statistics that were used are reset to 0 */
    float shape_log_max;   /* scale_log[3..5] are clamped to this in every round. Default infinity */
    size_t max_anchors;    /* hard cap on the number of anchors after the round. Pruning makes room first; the
                              cap itself prunes nothing. When it is reached, the cells with the largest
                              gradients over all levels win, with ties ordered by level, then cell. Default
                              SIZE_MAX */
    bool integer_division; /* init_factor / hierarchy^level and hierarchy/2 are integer divisions, so 4 / 16
                              is 0. Default false, as are the next two */
    bool coarse_level_gates; /* finer levels are searched only after a coarser level has added an anchor */
    bool at_cell_center;     /* new anchors are placed at the centre of their cell */
    uint64_t seed;           /* seed of the random drop of candidates: level j keeps a share of 1 -
                                0.5^(j+1) */
    uint64_t step;
    bool grow;                                                       /* true by default */
    bool (*may_stand)(const void *context, const float position[3]); /* whether a Gaussian candidate may get
                                                                        an anchor at this position; called
                                                                        from several threads. Default
                                                                        growth_anywhere() */
    const void *may_stand_context;                                   /* borrowed */
    growth_points points;                                            /* default none */
} growth_def;
growth_def growth_def_default(void);

/** A growth_def.may_stand that always returns true. */
bool growth_anywhere(const void *context, const float position[3]);

/** Counts of a round, and the old row of every surviving anchor. */
typedef struct growth_result {
    size_t grown, pruned;
    bool kept_last;   /* the rule would have pruned all anchors, so the most important one was kept */
    size_t count;     /* number of anchors after the round */
    size_t survivors; /* the first `survivors` rows are old; the others are new, and their Adam moments start
                         at 0 */
    size_t *source;   /* [survivors]: row before the round; owned, mem_free() */
} growth_result;

/**
 * Grow, then prune, as in Scaffold-GS; anchors and statistics are changed in place.
 *
 * Candidates are the means of Gaussians, then, in cells finer by one more level, the known points, each with
 * the largest gradient of its anchor's Gaussians. A new anchor stands at the cell's candidate with the
 * largest gradient (the first of equals), or at the cell's centre. Its log-scales are log(cell size), at
 * points log(scale); its offsets are 0; its feature is the elementwise maximum over the parents of the cell's
 * candidates. A Gaussian candidate makes no anchor where may_stand() forbids it; points are exempt. Cell
 * coordinates are 64-bit; a level whose cell size is not > 0 is skipped. The last anchor is never pruned (the
 * most important stays). Survivors keep their order; new anchors follow by level, then cell (x, y, z).
 *
 * @param stats [in, out] rows must match `a`
 * @param out   [out] zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY; after a failure anchors and statistics are unchanged
 * Deterministic. Cost: O(N K) and one hash set per level.
 */
gbt_status growth_round(anchors *a, growth_stats *stats, const growth_def *def, growth_result *out,
                        gbt_error *err);

#endif
