/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/evaluate.h -- render a trained scene and score it against held-out photos. */
#ifndef GBTRACE_EVALUATE_H
#define GBTRACE_EVALUATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_evaluate_def {
    const char *data;      /* data set folder; NULL: the one the model was trained on. Default NULL */
    const char *json;      /* also write the scores here; NULL: nowhere else. Default NULL */
    gbt_renderer renderer; /* one that can train, or GBT_RENDERER_AS_TRAINED, the default */
    double downscale;      /* divisor of the photos' sizes, [1, 64]; 0: as in training. Default 0 */
    bool report;           /* also write RUN/report.html. Default true */
    gbt_preset preset;     /* default GBT_PRESET_AS_TRAINED */
    bool tensorboard;      /* also write RUN/events.out.tfevents.1.eval: scores, and up to eight renders with
                              their photos. Default false */
    const char *lpips;     /* .safetensors file of a network for LPIPS (docs/metrics.md); NULL: no such score.
                              Default NULL */
    bool after_training; /* `run` was trained just now: do not repeat the warnings about its data set. Default
                            false */
    uint32_t cookie_;    /* set by gbt_evaluate_def_default() */
} gbt_evaluate_def;

gbt_evaluate_def gbt_evaluate_def_default(void);

/**
 * Score the held-out views of a run: PSNR, SSIM and FLIP on 8-bit images, per view and mean. A run trained
 * with `exposure` is scored on the right half of each photo, after applying a 3 x 4 colour matrix fitted to
 * its left half; metrics.json says so in "scored".
 *
 * Renders are written to RUN/renders/test/NAME.png, the photos they are compared with to
 * RUN/renders/test/NAME.photo.png, the scores to RUN/metrics.json; RUN/report.html shows all of them. Without
 * held-out views the scores are null ("n/a"), never NaN.
 *
 * With other settings than the run's own (another renderer, size, preset or data set, unless the run's own
 * data set is gone) nothing in RUN changes: the scores go to stderr, and to the file `json` when it is given
 * (GBT_ERR_ARGUMENT when that is RUN/metrics.json).
 *
 * SIGINT and SIGTERM stop before the next view with GBT_ERR_INTERRUPTED; scores and report then stay as they
 * were.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED
 *
 * Threads: any, with distinct runs; a signal stops all calls that catch it (gbt_train()).
 */
gbt_status gbt_evaluate(const char *run, const gbt_evaluate_def *def, gbt_error *err);

/**
 * Make RUN/report.html again from RUN/metrics.json, log.csv and renders/test: nothing is scored, one view is
 * rendered. The charts (SVG) of RUN, RUN/studies and `studies` go in too. Without the model or its data set,
 * maps and pictures of the scene are left out, with a warning.
 *
 * @param studies [in] [study_count] folders that gbtrace study wrote, or SVG files; NULL with 0
 * @return GBT_OK, GBT_ERR_IO (no metrics.json, no such study), GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct runs.
 */
gbt_status gbt_report(const char *run, const char *const *studies, size_t study_count, gbt_error *err);

/** Scores of one image against another. */
typedef struct gbt_comparison {
    int width, height;
    double psnr;          /* dB, at most 100 */
    double ssim;          /* as in all scores of this library: every pixel counts, windows are padded with 0
                             beyond the border */
    double ssim_interior; /* over the windows that lie entirely inside the image; NaN below 11 x 11 pixels */
    double flip;          /* at 67.02 pixels per degree */
    double lpips;         /* of colours scaled to [-1, 1], as the network was trained; NaN without a
                             network */
    double lpips_01;      /* of colours left in [0, 1], as the published scores of 3DGS use it; NaN without a
                             network */
} gbt_comparison;

/**
 * Compare two image files of equal size (PNG, JPEG, EXR; alpha is ignored), rounded to 8 bit; `reference` is
 * the original.
 *
 * @param network [in] .safetensors file of a network for LPIPS (docs/metrics.md); NULL: no such score
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes differ, or too small for the network), GBT_ERR_IO, GBT_ERR_FORMAT
 *         (also for a value that is not finite), GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct `out`.
 */
gbt_status gbt_compare_images(const char *path, const char *reference, const char *network,
                              gbt_comparison *out, gbt_error *err);

/**
 * gbt_compare_images() for images in memory, [height][width][3], also rounded to 8 bit; without LPIPS.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT (no pixels, or a value that is not finite), GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct `out`.
 */
gbt_status gbt_compare_pictures(const float *picture, const float *reference, int width, int height,
                                gbt_comparison *out, gbt_error *err);

typedef struct gbt_render_def {
    const char *data;          /* data set whose cameras are used; NULL: the one that the model names. Default
                                  NULL */
    gbt_split split;           /* default GBT_SPLIT_TEST */
    gbt_renderer renderer;     /* default GBT_RENDERER_AS_TRAINED */
    gbt_picture_format format; /* default GBT_PICTURE_PNG */
    double downscale;          /* divisor of the photos' sizes, [1, 64]; 0: as in training. Default 0 */
    const char *camera;        /* camera file (docs/cameras.md): render this camera instead of the views; the
                                  data set is not needed. Default NULL */
    const char *outputs; /* also write these, as float EXR (docs/formats.md): "depth,normal". They are traced,
                            from the Gaussians without the inserted meshes; refused with any other renderer,
                            also when a run trained with splats implies it. Default NULL */
    gbt_preset preset;   /* default GBT_PRESET_AS_TRAINED */
    const char *insert;  /* meshes to insert into the scene (docs/inserting.md); traced only. Default NULL */
    const char *path;    /* a film instead of views (docs/video.md): "orbit", "interpolate", or the name of a
                            path file. Default NULL */
    int frames; /* of the film, [0, 100000]; 0: 240 for an orbit, 15 per training camera (at most 900) for an
                   interpolation, and as many as a path file has. Default 0 */
    double fps; /* frames per second, [0, 1000], in a .gif at most 50; 0: what a path file says, else
                   30. Default 0 */
    int width, height;   /* of the film, both 0 or in [1, 65500]; the shorter side has the photos' field of
                            view. Default 0: the size of the photos, rounded to even numbers */
    const char *look_at; /* path "orbit": its centre, "X,Y,Z" in the data set's coordinates. NULL: what the
                            photos' cameras look at. Default NULL */
    double orbit_radius; /* path "orbit": distance from the vertical axis through that point, (0, 1e9], scene
                            units; NaN: that of the photos' cameras. Default NaN */
    double orbit_height; /* path "orbit": height above that point, scene units; NaN: that of the photos'
                            cameras. Default NaN */
    /** Bytes that the program may take (docs/memory.md): a larger .ply of plain Gaussians is traced cell by
        cell, without outputs and meshes. 0, the default: no limit. */
    size_t memory;
    uint32_t cookie_; /* set by gbt_render_def_default() */
} gbt_render_def;

gbt_render_def gbt_render_def_default(void);

/**
 * Render the views of a split into the folder `out`, made when it is missing, one file per view (not over the
 * scored pictures of a run with exposures, RUN/renders/test: GBT_ERR_ARGUMENT); or what a camera file says,
 * as one file of its name; or a path, as frame_00001.png and so on, or as one film when `out` ends in .mp4,
 * .webm or .gif (by the program ffmpeg, which must be there).
 *
 * Camera models are traced as they are. `data`, `split` and `downscale` are about views: with a camera file
 * or a path file `split` is not used, and the others are refused. A film has its name when it is whole, not
 * before. SIGCHLD must not be ignored while it is made: how ffmpeg ends is not known then.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct `out`.
 */
gbt_status gbt_render(const char *run, const char *out, const gbt_render_def *def, gbt_error *err);

GBT_API_END
#endif
