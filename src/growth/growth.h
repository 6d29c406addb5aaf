/* SPDX-License-Identifier: Apache-2.0 */
/* growth/growth.h -- growing and pruning anchors (Lu 2024, "Anchor Points Refinement"; docs/training.md): the
   rules of a round, and the round. */
#ifndef GBT_GROWTH_GROWTH_H
#define GBT_GROWTH_GROWTH_H

#include "anchor/anchors.h"
#include "growth/statistics.h"

enum { GROWTH_MAX_LEVELS = 8 };

/** Part of the views between rounds (growth_def.interval). */
#define GROWTH_SUCCESS 0.8f

/** Points where surface is known to be, besides where Gaussians are. All borrowed. */
typedef struct growth_points {
    size_t count;
    const float *position;  /* [count][3], finite */
    const uint32_t *anchor; /* [count]: row of the anchor that speaks for the point, the nearest */
    bool as_start;      /* true: the threshold is that of the first level, Gaussians count however few views
                           saw them, a new anchor has the size `scale`; false: threshold and size are those of
                           the last level, and Gaussians count that enough views saw */
    const float *scale; /* [count] > 0, if as_start: first scale of an anchor there */
} growth_points;

typedef struct growth_def {
    float voxel_size;      /* v: cells are v * init_factor / hierarchy^level */
    int level_count;       /* [0, GROWTH_MAX_LEVELS], default 3 */
    int init_factor;       /* default 16 */
    int hierarchy_factor;  /* default 4 */
    float grad_threshold;  /* tau >= 0, default 2e-4; level j uses tau * (hierarchy/2)^j */
    float importance_min;  /* anchors with less in the mean over the views that show them are pruned. Default
                              0.005, an opacity */
    float interval;        /* I: views gathered for it, default 100: a Gaussian counts when grad_count > I *
                              GROWTH_SUCCESS * 0.5; an anchor is judged when visit_count > I * GROWTH_SUCCESS.
                              What was judged starts again from 0 */
    float shape_log_max;   /* scale_log[3..5] are cut to this in every round. Default infinity */
    size_t max_anchors;    /* hard cap on the rows after the round; pruning makes room first, the cap prunes
                              nothing. When it bites, the cells with the largest gradient of all levels win,
                              ties by level, then cell. Default SIZE_MAX */
    bool integer_division; /* init_factor / hierarchy^level and hierarchy/2 are divided as integers: 4 / 16 is
                              0. Default false, as the next two */
    bool coarse_level_gates; /* while no level has added an anchor, finer ones are not searched */
    bool at_cell_center;     /* new anchors stand in the middle of their cell */
    uint64_t seed;           /* of the random candidate drop: level j keeps 1 - 0.5^(j+1) of the candidates */
    uint64_t step;
    bool grow, prune;                                                /* both true by default */
    bool (*may_stand)(const void *context, const float position[3]); /* where Gaussians may have an anchor;
                                                                        asked by several threads. Default
                                                                        growth_anywhere() */
    const void *may_stand_context;                                   /* borrowed */
    growth_points points;                                            /* default none */
} growth_def;
growth_def growth_def_default(void);

/** True: a growth_def.may_stand. */
bool growth_anywhere(const void *context, const float position[3]);

/** What happened, and where every surviving row came from. */
typedef struct growth_result {
    size_t grown, pruned;
    bool kept_last;   /* all would have gone: the most important was kept against the rule */
    size_t count;     /* rows after */
    size_t survivors; /* the first of them; the others are new: their Adam moments start at 0 */
    size_t *source;   /* [survivors]: row before; owned, mem_free() */
} growth_result;

/**
 * Grow, then prune, as Scaffold-GS does; anchors and statistics are changed in place.
 *
 * Candidates are the means of Gaussians; then, in cells finer by one more level, the known points, each with
 * the largest gradient of its anchor's Gaussians. New anchor: position = the cell's candidate with the
 * largest gradient, the first of equals; or the cell's centre. Log-scales log(cell), at points log(scale),
 * offsets 0, feature = elementwise maximum over the parents of the cell's candidates. Where one may not stand
 * none is made, unless that is a point. Cells use 64-bit keys; a level whose cell is not > 0 is skipped.
 * Never prunes the last anchor (the most important stays). Survivors keep their order; new anchors follow by
 * level, then cell (x, y, z).
 *
 * @param stats [in, out] rows must match `a`
 * @param out   [out] zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY: then anchors and statistics are as they were
 * Deterministic. Cost: O(N K) and one hash set per level.
 */
gbt_status growth_round(anchors *a, growth_stats *stats, const growth_def *def, growth_result *out,
                        gbt_error *err);

#endif
