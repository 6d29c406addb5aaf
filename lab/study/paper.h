/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper.h -- what the study "paper" trains, what came out, and how it is written down.

   scenes x variants x seeds --> figures
        --> tables, changes from one variant to another (ours beside the paper's) --> md, json, svg */
#ifndef GBT_STUDY_PAPER_H
#define GBT_STUDY_PAPER_H

#include "lab/lab.h"
#include "study/grid.h"
#include "study/runs_stat.h"

enum {
    PAPER_TABLES = 4,
    PAPER_DEPTH_MAX = 18 /* where nothing else is said */,
    PAPER_ALL = STUDY_SCENES_MAX /* in place of a scene: the mean over all */
};

/* ---- what is trained ---- */

typedef enum paper_variant_id {
    PAPER_VOXEL,
    PAPER_GBSP, /* the whole method: GBAI + GBSP */
    PAPER_GBAI,
    PAPER_VOXEL_SCALED,
    PAPER_GBAI_SCALED,
    PAPER_VOXEL_SIXTH,
    PAPER_GBSP_SIXTH,
    PAPER_VOXEL_THIRD,
    PAPER_GBSP_THIRD,
    PAPER_DEPTH_10,
    PAPER_DEPTH_12,
    PAPER_DEPTH_14,
    PAPER_DEPTH_16,
    PAPER_VARIANTS
} paper_variant_id;

typedef struct paper_variant {
    const char *name; /* of its folder, in data */
    const char *says; /* in tables */
    gbt_init_kind init;
    gbt_scale_prior scale_prior;
    bool scaled;       /* first scales times the scene's constant */
    double grow_until; /* part of the run */
    int max_depth;
} paper_variant;

extern const paper_variant paper_variants[PAPER_VARIANTS];

/** The variants of table 1 to 4, in its order; their number. */
size_t paper_table_variants(int table, const paper_variant_id **out);

typedef struct paper_scene {
    int tree_depth;        /* of the balls without a limit: larger limits change nothing */
    double scale_constant; /* the first scales of GBSP over those from spacing alone, of the same balls:
                              geometric mean */
} paper_scene;

/** The constant and the depth, from the sparse points and v (0: the reference's); without points 0.625 and
    no limit to the depth. */
gbt_status paper_scene_look(const char *data, double voxel_size, paper_scene *out, gbt_error *err);

/** How many balls `points` points without ties give: every set of more than two is halved, down to
    `max_depth`. */
double paper_ball_count(double points, int max_depth);

typedef struct paper_study {
    lab_runs_def def;                 /* strings borrowed */
    bool has_table[PAPER_TABLES + 1]; /* by number */
    bool has_variant[PAPER_VARIANTS];
    paper_scene scenes[STUDY_SCENES_MAX];
    study_grid grid;
} paper_study;

static inline study_figures *paper_run(const paper_study *s, size_t place, paper_variant_id variant, int seed)
{
    return study_grid_at(&s->grid, place, (size_t)variant, seed);
}

/* ---- figures and changes ---- */

typedef enum paper_figure {
    PAPER_INITIAL,
    PAPER_FINAL,
    PAPER_STORAGE, /* the paper's accounting: 316 bytes per anchor and the networks, MiB */
    PAPER_MODEL,   /* model.gbt, MiB */
    PAPER_PSNR,
    PAPER_SSIM,
    PAPER_LPIPS,      /* as the paper's: of colours in [0, 1]; NaN without a network */
    PAPER_ARITHMETIC, /* of the networks for a view, 10^9 multiply-adds */
    PAPER_BLENDED,    /* hits that a ray blends */
    PAPER_FIGURES
} paper_figure;

typedef struct paper_figure_text {
    const char *name, *value_name,
        *change_name; /* as data; of a value and of a change in tables, with their units */
    int decimals;
    bool is_relative; /* changes are in per cent; else differences */
    int change_decimals;
} paper_figure_text;

extern const paper_figure_text paper_figure_texts[PAPER_FIGURES];

double paper_figure_of(const study_figures *run, paper_figure figure);

/** False for LPIPS without its network: it is in no table then. */
static inline bool paper_is_measured(const paper_study *s, paper_figure figure)
{
    return figure != PAPER_LPIPS || s->def.lpips != NULL;
}

/** Over the seeds of a variant on a scene. */
stat_sample paper_stat(const paper_study *s, size_t scene, paper_variant_id variant, paper_figure figure);

/**
 * Over the seeds: the change from `base` to `variant` at the same seed, per cent or a difference; of
 * PAPER_ALL the mean over the scenes.
 */
stat_sample paper_change(const paper_study *s, size_t scene, paper_variant_id variant, paper_variant_id base,
                         paper_figure figure);

/** A change that is looked at. */
typedef struct paper_claim {
    int table;
    const char *what;
    paper_variant_id variant, base;
    paper_figure figure;
} paper_claim;

extern const paper_claim paper_claims[];
extern const size_t paper_claim_count;

/** The same change in the paper's table: of the sums over its scenes, or the mean of differences; NaN when it
    has no such rows. */
double paper_published(const paper_claim *claim);

/** The smallest and the largest of it over the paper's scenes; false when it has no such rows. */
bool paper_published_range(const paper_claim *claim, double range[2]);

/* ---- out ---- */

/** What a change says beside the paper's: "agrees with the paper", ... */
const char *paper_verdict(const stat_sample *ours, const paper_claim *claim);

/** The same, of its numbers; `range`: from the smallest to the largest of the paper's scenes. `published` is
    NaN without one. */
const char *paper_verdict_of(const stat_sample *ours, double published, const double range[2]);

void paper_tables(const void *study, text *out); /* Markdown */
void paper_charts(const void *study, text *out); /* SVG */

/** How it is written down. */
extern const study_output paper_output;

#endif
