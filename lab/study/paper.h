/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper.h -- the study "paper": the paper's tables from our runs, and the changes between its variants
   compared with the paper's.
     scenes x variants x seeds --> figures
          --> tables, changes from one variant to another (ours and the paper's) --> md, json, svg */
#ifndef GBT_STUDY_PAPER_H
#define GBT_STUDY_PAPER_H

#include "lab/lab.h"
#include "study/grid.h"
#include "study/runs_stat.h"

enum {
    PAPER_TABLES = 4,
    PAPER_DEPTH_MAX = 18 /* unless the variant says otherwise */,
    PAPER_ALL = STUDY_SCENES_MAX /* instead of a scene: the mean over all */
};

/* ---- variants ---- */

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
    const char *name; /* name of its folder and in the JSON */
    const char *says; /* its name in tables */
    gbt_init_kind init;
    gbt_scale_prior scale_prior;
    bool scaled;       /* multiply the initial scales by the scene's constant */
    double grow_until; /* fraction of the run after which growth ends */
    int max_depth;
} paper_variant;

extern const paper_variant paper_variants[PAPER_VARIANTS];

/** The variants in one of the tables 1 to 4, in the order of its rows. Returns their number. */
size_t paper_table_variants(int table, const paper_variant_id **out);

typedef struct paper_scene {
    int tree_depth;        /* depth of the balls without a limit, so that larger limits change nothing */
    double scale_constant; /* initial scales of GBSP divided by those from spacing alone, for the same balls:
                              geometric mean */
} paper_scene;

/** Find the constant and the depth of a scene, from its sparse points and the voxel size v (0: by the
    reference's rule). Without points: 0.625, and no limit of the depth. */
gbt_status paper_scene_look(const char *data, double voxel_size, paper_scene *out, gbt_error *err);

/** The number of balls made from `points` points without ties: sets of more than two points are halved, down
    to `max_depth`. */
double paper_ball_count(double points, int max_depth);

typedef struct paper_study {
    lab_runs_def def;                 /* strings borrowed */
    bool has_table[PAPER_TABLES + 1]; /* indexed by table number */
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
    PAPER_STORAGE, /* by the paper's accounting: 316 bytes per anchor, and the networks, MiB */
    PAPER_MODEL,   /* size of model.gbt, MiB */
    PAPER_PSNR,
    PAPER_SSIM,
    PAPER_LPIPS,      /* as in the paper: of colours in [0, 1]; NaN without a network */
    PAPER_ARITHMETIC, /* network evaluations for a view, 10^9 multiply-adds */
    PAPER_BLENDED,    /* Gaussians blended per ray */
    PAPER_FIGURES
} paper_figure;

typedef struct paper_figure_text {
    const char *name, *value_name,
        *change_name; /* key in JSON; headings for a value and for a change, with units */
    int decimals;
    bool is_relative; /* changes are percentages; else differences */
    int change_decimals;
} paper_figure_text;

extern const paper_figure_text paper_figure_texts[PAPER_FIGURES];

double paper_figure_of(const study_figures *run, paper_figure figure);

/** False for LPIPS without its network: then no table has it. */
static inline bool paper_is_measured(const paper_study *s, paper_figure figure)
{
    return figure != PAPER_LPIPS || s->def.lpips != NULL;
}

/** Statistics over the seeds of one variant on one scene. */
stat_sample paper_stat(const paper_study *s, size_t scene, paper_variant_id variant, paper_figure figure);

/**
 * Statistics over the seeds of the change from `base` to `variant` at the same seed, as a percentage or a
 * difference. For PAPER_ALL, of the mean over the scenes.
 */
stat_sample paper_change(const paper_study *s, size_t scene, paper_variant_id variant, paper_variant_id base,
                         paper_figure figure);

/** A change that is compared with the paper's. */
typedef struct paper_claim {
    int table;
    const char *what;
    paper_variant_id variant, base;
    paper_figure figure;
} paper_claim;

extern const paper_claim paper_claims[];
extern const size_t paper_claim_count;

/** The same change in the paper's table: of the sums over its scenes, or the mean of the differences; NaN if
    the table lacks these rows. */
double paper_published(const paper_claim *claim);

/** The smallest and the largest such change over the paper's scenes; false if the table lacks these rows. */
bool paper_published_range(const paper_claim *claim, double range[2]);

/* ---- output ---- */

/** How our change compares with the paper's, in words: "agrees with the paper", ... */
const char *paper_verdict(const stat_sample *ours, const paper_claim *claim);

/** The same from numbers. `published` is NaN if there is none; `range` is that of paper_published_range(). */
const char *paper_verdict_of(const stat_sample *ours, double published, const double range[2]);

void paper_tables(const void *study, text *out); /* Markdown */
void paper_charts(const void *study, text *out); /* SVG */

/** The files that the study writes. */
extern const study_output paper_output;

#endif
