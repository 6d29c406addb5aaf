/* gbtrace/study.h -- studies that train: the paper's tables, held-out quality against time and against anchors, from real runs on the
   user's own scenes. */
#ifndef GBTRACE_STUDY_H
#define GBTRACE_STUDY_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

/* These studies train each variant with each seed into FOLDER/runs/SCENE/VARIANT/seed-S, where a scene is called as its folder. A run that
   is there, whole and of the same settings, is taken as it is; any other is made again. Models and scores stay, checkpoints do not. A row
   beyond its limit is no failure: it is told in the table. SIGINT and SIGTERM end the study after the current step with
   GBT_ERR_INTERRUPTED; the same call goes on with the run that was interrupted, from its start. */

typedef struct gbt_paper_def {
    const char *const *data; /* data set folders, the last parts of their paths distinct */
    size_t data_count;       /* 1 to 16 */
    uint64_t iterations;     /* of every run, at least 20. Default 3000; the paper's is 30000 */
    double downscale;        /* photos are divided by this, [1, 64]. Default 1 */
    int seeds;               /* runs of each variant, seeds 0, 1, ...; [1, 10]. Default 3 */
    const char *renderer;    /* "raster" (default, as the paper), "trace" or "per-ray" */
    const char *tables;      /* which, as "1,3". Default "1,2,3,4" */
    const char *lpips;       /* .safetensors file of a network for LPIPS (docs/metrics.md); NULL: no such column. Default NULL */
} gbt_paper_def;

gbt_paper_def gbt_paper_def_default(void);

/**
 * The paper's four tables by its own protocol (`compat`): voxels against balls, what each part of the method does (with a constant in place
 * of the scale prior as control), growth stopped early, and the depth of the balls (docs/paper.md).
 *
 * Writes paper.md, .csv (every run), .json and .svg into `folder`, and the tables as Markdown to `out`.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED
 * Cost: up to 13 runs per scene and seed; a few gigabytes for models.
 */
gbt_status gbt_study_paper(const gbt_paper_def *def, const char *folder, FILE *out, gbt_error *err);

typedef struct gbt_time_def {
    const char *const *data; /* as above */
    size_t data_count;       /* 1 to 16 */
    double budget_seconds;   /* of a run, (0, 1e6]. Default 84 */
    double downscale;        /* photos are divided by this, [1, 64]. Default 1 */
    int seeds;               /* [1, 10]. Default 1 */
} gbt_time_def;

gbt_time_def gbt_time_def_default(void);

/**
 * Held-out PSNR against seconds: the default settings against the faithful protocol, which is given five budgets, and what each choice of
 * the default is worth, one left out at a time.
 *
 * Writes time.md, .csv (every mark of every run), .json and .svg into `folder`, and the tables as Markdown to `out`.
 *
 * @return as gbt_study_paper()
 * Cost: about fifteen budgets per scene and seed. Nothing else should run meanwhile.
 */
gbt_status gbt_study_time(const gbt_time_def *def, const char *folder, FILE *out, gbt_error *err);

typedef struct gbt_anchors_def {
    const char *const *data; /* as above */
    size_t data_count;       /* 1 to 16 */
    uint64_t iterations;     /* of every run, at least 20. Default 1000 */
    double downscale;        /* photos are divided by this, [1, 64]. Default 1 */
    int seeds;               /* runs of each variant, [1, 10]. Default 3 */
} gbt_anchors_def;

gbt_anchors_def gbt_anchors_def_default(void);

/**
 * What a scene needs: the default settings with anchors that start at voxels, at the paper's balls, at adaptive balls and at as many random
 * points, and with more or less asked of an anchor; anchors, bytes and hits per ray against held-out PSNR, all after the same number of
 * steps.
 *
 * Writes anchors.md, .csv (every run), .json and .svg into `folder`, and the tables as Markdown to `out`.
 *
 * @return as gbt_study_paper()
 * Cost: seven runs per scene and seed. What else runs meanwhile changes nothing but the time.
 */
gbt_status gbt_study_anchors(const gbt_anchors_def *def, const char *folder, FILE *out, gbt_error *err);

GBT_API_END
#endif
