/* SPDX-License-Identifier: Apache-2.0 */
/* lab/lab.h -- what measures and does not make: benchmarks, studies, stability, the gradient check. For the
   program; not installed. */
#ifndef GBT_LAB_H
#define GBT_LAB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"

typedef struct lab_bench_def {
    const char *model;  /* plain Gaussians, or a run; required */
    const char *camera; /* camera file (docs/cameras.md; of an aperture the first sample); required for plain
                           Gaussians, else the first held-out view */
    int repeats;        /* timed passes after one warm-up; the median is reported. Default 5 */
    bool check; /* compare with the double reference on every 8th pixel in both directions. Default false */
    const char *json; /* where to write the figures; NULL: nowhere */
    float alpha_min;  /* smallest response that counts, in [1e-30, 1); 0 or NaN: that of the run, 1/255 for a
                         .ply */
    float alpha_max;  /* alpha is cut here, in [alpha_min, 1); 0 or NaN: that of the run, 0.99 for a .ply */
    float t_min; /* stop before transmittance falls below this, in [1e-30, 1); 0 or NaN: that of the run, 1e-4
                    for a .ply */
    gbt_preset preset;  /* the three numbers above win over it. Default GBT_PRESET_AS_TRAINED */
    const char *kernel; /* "list" (default, and NULL), "packet", "tree", "single", "embree", or "splats" of
                           the same; or some of them, as "list,tree": measured in turn and compared with the
                           first */
} lab_bench_def;

lab_bench_def lab_bench_def_default(void);

/**
 * Time build, forward and adjoint; figures as text to `out` and as JSON. Times of one core per ray are
 * process CPU time / rays.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status lab_bench_trace(const lab_bench_def *def, FILE *out, gbt_error *err);

typedef struct lab_study_def {
    const char *const *models; /* plain Gaussians, or runs; their names are the last two parts of their
                                  paths, and differ */
    size_t model_count;        /* 1 to 16 */
    const char *camera; /* camera file of all plain Gaussians; NULL: the camera.json beside each. Runs: their
                           first held-out view. Default NULL */
    int repeats;        /* timed passes of each setting after one warm-up; the median counts. Default 3 */
} lab_study_def;

lab_study_def lab_study_def_default(void);

/**
 * Speed against accuracy: core-microseconds per ray and the error to the picture without any cut-off, for
 * every setting that trades one for the other (docs/accuracy.md).
 *
 * Writes speed.json, speed.md and speed.svg (the chart) into the folder `folder`, and the table as Markdown
 * to `out`.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 * Cost: about a minute per model of 10,000 Gaussians and 512 x 512 rays.
 */
gbt_status lab_study_speed(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err);

/**
 * Tracer against rasterizer: how far each is from its double reference and they from each other, and the
 * causes, one change at a time: order, projection, dilation, cut-offs (docs/crosscheck.md).
 *
 * `def` as for lab_study_speed(), without repeats; of a run up to four held-out views, spread over all. A
 * camera with a lens is replaced by its pinhole. Writes crosscheck.json, .md, .svg (chart) and one PNG
 * of pictures per view into `folder`, the tables to `out`. A row beyond its limit is no failure: it is told
 * in the table.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT (rays given in place of a camera too), GBT_ERR_IO, GBT_ERR_FORMAT,
 *         GBT_ERR_NO_MEMORY
 * Cost: about ten seconds per view of 10,000 Gaussians and 512 x 512 pixels.
 */
gbt_status lab_study_crosscheck(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err);

/**
 * Size against picture: what trained models lose on their held-out views when their files are made small
 * (gbtrace/compress.h).
 *
 * `def->models`: 1 to 6 runs whose data sets are there; the rest of `def` is not used. Each is coded at a
 * ladder of qualities and without loss, read back and scored by its own renderer at its own size. Writes
 * rate.json, .md and .svg (chart) into `folder`, the tables to `out`. A row beyond its limit is no
 * failure: it is told in the table.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 * Cost: gbt_compress() and eleven renders of the held-out views per model.
 */
gbt_status lab_study_rate(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err);

typedef struct lab_stability_def {
    const char *only; /* cases, as "A1,A9"; NULL: all. Default NULL */
    bool quick;       /* smaller sizes where a scene file gives them. Default false */
} lab_stability_def;

lab_stability_def lab_stability_def_default(void);

/**
 * Stability: scenes on which renderers are known to fail, each measured against a limit, beside the
 * rasterizer (docs/stability.md).
 *
 * Writes stability.json, stability.md, stability.svg (charts) and pictures into the folder `folder`, and the
 * table to `out`. A row beyond its limit is no failure: it is told in the table.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT (an unknown case), GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 * Threads: one study at a time (it switches instruction sets and Embree's memory limit and back). Cost: about
 * a minute of two cores.
 */
gbt_status lab_study_stability(const lab_stability_def *def, const char *folder, FILE *out, gbt_error *err);

/**
 * Compare analytic gradients with the double adjoint and with differences, on a trained run: tracer, decode
 * and the whole chain.
 *
 * Prints one row for each renderer and class of parameters: relative L2 error and limit. GBT_ERR_INTERNAL
 * when a limit is broken or too many rays are left out, GBT_ERR_FORMAT when every photo is masked whole.
 */
gbt_status lab_check_grad(const char *run, FILE *out, gbt_error *err);

/* ---- studies that train: from real runs on the user's own scenes ---- */

/* These studies train each variant with each seed into FOLDER/runs/SCENE/VARIANT/seed-S, where a scene is
   called as its folder. A run that is there, whole and of the same settings, is taken as it is; any other is
   made again. Models and scores stay, checkpoints do not. A row beyond its limit is no failure: it is told in
   the table. SIGINT and SIGTERM end the study after the current step with GBT_ERR_INTERRUPTED; the same call
   goes on with the run that was interrupted, from its start. */

typedef struct lab_runs_def {
    const char *const *data; /* data set folders, the last parts of their paths distinct */
    size_t data_count;       /* 1 to 16 */
    double downscale;        /* photos are divided by this, [1, 64]. Default 1 */
    int seeds;               /* runs of each variant, seeds 0, 1, ...; [1, 10]. Default 0: 3, of "time" 1 */
    const char *eval_split;  /* gbt_train_def.eval_split of the runs. Default NULL: "every=8" of "paper", else
                                "auto" */
    uint64_t iterations;   /* "paper" and "anchors": of every run, at least 20. Default 0: 3000 and 1000; the
                              paper's is 30000 */
    double budget_seconds; /* "time": of a run, (0, 1e6]. Default 84 */
    double voxel_size;     /* "paper": v, scene units, [0, 1e9]. Default 0: the reference's, of the points */
    gbt_renderer renderer; /* "paper": that trains. Default GBT_RENDERER_RASTER, as the paper */
    const char *tables;    /* "paper": which, as "1,3". Default "1,2,3,4" */
    const char *lpips; /* "paper": .safetensors file of a network for LPIPS (docs/metrics.md); NULL: no such
                          column. Default NULL */
} lab_runs_def;

lab_runs_def lab_runs_def_default(void);

/**
 * The paper's four tables by its own protocol (`compat`): voxels against balls, what each part of the method
 * does (with a constant in place of the scale prior as control), growth stopped early, and the depth of the
 * balls (docs/paper.md).
 *
 * Writes paper.md, .json and .svg into `folder`, and the tables as Markdown to `out`.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED
 * Cost: up to 13 runs per scene and seed; a few gigabytes for models.
 */
gbt_status lab_study_paper(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err);

/**
 * Held-out PSNR against seconds: the default settings against the faithful protocol (with splats, so cameras
 * are pinholes), which is given five budgets, and what each choice of the default is worth, one left out at a
 * time.
 *
 * Writes time.md, .json and .svg into `folder`, and the tables as Markdown to `out`.
 *
 * @return as lab_study_paper()
 * Cost: about fifteen budgets per scene and seed. Nothing else should run meanwhile.
 */
gbt_status lab_study_time(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err);

/**
 * What a scene needs: the default settings with anchors that start at voxels, at the paper's balls, at
 * adaptive balls and at as many random points, and with more or less asked of an anchor; anchors, bytes and
 * hits per ray against held-out PSNR, all after the same number of steps.
 *
 * Writes anchors.md and .json into `folder`, and the tables as Markdown to `out`.
 *
 * @return as lab_study_paper()
 * Cost: eight runs per scene and seed. What else runs meanwhile changes nothing but the time.
 */
gbt_status lab_study_anchors(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err);

#endif
