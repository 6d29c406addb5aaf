/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/adjust.h -- growing and pruning anchors (Scaffold-GS; docs/training.md). */
#ifndef GBT_ANCHOR_ADJUST_H
#define GBT_ANCHOR_ADJUST_H

#include "anchor/anchors.h"

enum { ADJUST_MAX_LEVELS = 8 };

/** What is gathered of every anchor and Gaussian, listed once: X(name, per_offset, meaning). */
#define ADJUST_STAT_LIST(X)                                                                                  \
    X(use_accum, false,                                                                                      \
      "sum over views of its importance: opacities, or shares of the picture (mean T alpha)")                \
    X(visit_count, false, "views in which the anchor was visible")                                           \
    X(grad_accum, true, "sum of screen-space gradient norms")                                                \
    X(grad_count, true, "views in which the Gaussian was geometrically visible")

enum {
#define X(name, per_offset, meaning) ADJUST_STAT_##name,
    ADJUST_STAT_LIST(X)
#undef X
        ADJUST_STATS
};
extern const row_field adjust_stat_fields[ADJUST_STATS];

/** Gathered every step between two adjusts. Row counts follow the anchors. Start from {0}. */
typedef struct adjust_stats {
    size_t count, capacity;
    int offset_count;
    union { /* owned arrays, [count] or [count][K]: by name, or in order */
        struct {
#define X(name, per_offset, meaning) float *name;
            ADJUST_STAT_LIST(X)
#undef X
        };
        float *field[ADJUST_STATS];
    };
} adjust_stats;

/** Keeps the first min(old, new) rows; new rows are zero. offset_count is fixed while there are rows. On
    failure nothing changes. */
gbt_status adjust_stats_resize(adjust_stats *s, size_t count, int offset_count, gbt_error *err);
void adjust_stats_free(adjust_stats *s);

typedef struct adjust_def {
    float voxel_size;     /* v: cells are v * init_factor / hierarchy^level */
    int level_count;      /* [0, ADJUST_MAX_LEVELS], default 3 */
    int init_factor;      /* default 16 */
    int hierarchy_factor; /* default 4 */
    float grad_threshold; /* tau >= 0, default 2e-4; level j uses tau * (hierarchy/2)^j */
    float min_use;        /* anchors with less in the mean over their views are pruned, in units of use_accum.
                             Default 0.005, an opacity */
    float interval;       /* I: steps between adjusts, default 100 */
    float success_threshold; /* default 0.8: a Gaussian counts when grad_count > interval * success * 0.5; an
                                anchor is judged when visit_count > interval * success. What was judged starts
                                again from 0 */
    float shape_log_max;     /* scale_log[3..5] are clamped to this at every adjust. Default infinity */
    size_t max_anchors;    /* hard cap on the rows after the adjust; pruning makes room first, the cap prunes
                              nothing. When it bites, the cells with the largest gradient of all levels win,
                              ties by level, then cell. Default SIZE_MAX */
    bool integer_division; /* init_factor / hierarchy^level and hierarchy/2 are divided as integers: 4 / 16 is
                              0. Default false, as the next two */
    bool coarse_level_gates; /* a level that adds nothing ends the search */
    bool at_cell_center;     /* new anchors stand in the middle of their cell */
    uint64_t seed;           /* of the random candidate drop: level j keeps 1 - 0.5^(j+1) of the
                                candidates */
    uint64_t step;
    bool grow, prune;                                                /* both true by default */
    bool (*may_stand)(const void *context, const float position[3]); /* where Gaussians may have an anchor;
                                                                        NULL, the default: anywhere */
    const void *may_stand_context;                                   /* borrowed */
    size_t place_count; /* places where surface is known to be, besides where Gaussians are; default 0 */
    const float *place; /* [place_count][3], finite; borrowed, as the next two */
    const float *place_scale;     /* [place_count] > 0: first scale of an anchor there; or NULL */
    const uint32_t *place_anchor; /* [place_count]: row of the anchor that speaks for the place, the nearest
                                   */
} adjust_def;
adjust_def adjust_def_default(void);

/** What happened, and where every surviving or new row came from. */
typedef struct adjust_result {
    size_t grown, pruned;
    bool kept_last;  /* all would have gone: the most opaque was kept against the rule */
    size_t count;    /* rows after */
    int64_t *source; /* [count]: row before, or -1 for a new anchor (its Adam moments start at 0); owned,
                        mem_free() */
} adjust_result;

/**
 * Grow, then prune, as Scaffold-GS does; anchors and statistics are changed in place.
 *
 * Candidates are the means of Gaussians; then, in cells finer by one more level, the known places, each with
 * the largest gradient of its anchor's Gaussians. Places with a scale are asked for as at the first level,
 * however few views saw those Gaussians; without, as Gaussians at the last level, and are as large. New
 * anchor: position = the cell's candidate with the largest gradient, the first of equals; or the
 * cell's centre. Log-scales log(cell), at places log(place_scale), offsets 0, feature =
 * elementwise maximum over the parents of the cell's candidates. Where one may not stand none is made, unless
 * that is a place. Cells use 64-bit keys; a level whose cell is not > 0 is skipped. Never prunes the last
 * anchor (the most opaque stays). Survivors keep their order; new anchors follow by level, then cell (x, y,
 * z).
 *
 * @param stats [in, out] rows must match `a`
 * @param out   [out] zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY: then anchors and statistics are as they were
 * Deterministic. Cost: O(N K) and one hash set per level.
 */
gbt_status anchors_adjust(anchors *a, adjust_stats *stats, const adjust_def *def, adjust_result *out,
                          gbt_error *err);

#endif
