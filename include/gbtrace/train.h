/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/train.h -- train a neural Gaussian scene from posed photos. */
#ifndef GBTRACE_TRAIN_H
#define GBTRACE_TRAIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

enum { GBT_TRAIN_MAX_EVALS = 16 };

typedef struct gbt_train_def {
    const char *init;  /* "gb" (the paper's granular balls, default), "adaptive" (balls where the scene needs
                          them), "voxel",  "random" points */
    double init_count; /* anchors per point of adaptive and random, [0, 1], at least one; 0: half as many as
                          the paper's balls. Default 0 */
    const char *scale_prior; /* "gb" (default) or "nn"; only the balls of "gb" have a choice, the others use
                                "nn" */
    int max_depth;           /* D_max of the balls, [0, 64]. Default 18 */
    float voxel_size;        /* v, scene units; 0: the median spacing of the points. Default 0 */
    int offsets;             /* K, Gaussians per anchor, [1, 16]; 0: 2, or 10 with compat. Default 0 */
    const char *distance;    /* distance input of the networks: "auto" (default), "on", "off" */
    uint64_t iterations;     /* length of the run, with what was done before `resume`; 0: the budget decides.
                                Default 0 */
    double budget_seconds;   /* wall time for training, with what was spent before `resume`; used when
                                iterations is 0. 0: 600, or with `resume` as long as the run was to be.
                                Default
                                0 */
    const char *pace; /* "n1,...,n20": iterations in each twentieth of the schedule, as a budget run records
                         them. Default NULL */
    double downscale; /* photos are divided by this, >= 1. Default 1 */
    const char *renderer; /* what the photos are compared with: "trace" (default), "raster" (EWA splats;
                             pinhole photos), or "per-ray" */
    double footprint;     /* rays are as wide as pixels: variance of a pixel, px^2, [0, 4]; 0: thin rays.
                             Default 0.1; 0 with compat, splats are dilated then */
    double near; /* nothing is seen nearer to a camera than this part of the depth at which its photo's first
                    sparse points are, of all training photos the least, [0, 1]; 0, or where points have no
                    tracks: 2 % of the median distance of anchors. Default 0.5; 0 with compat */
    int start_level; /* first steps look at 1 pixel in 4^start_level, at random places; all come last. [0, 4].
                        Default 2; 0 with compat */
    const char *eval_split; /* "auto" (default: as the data set says, else every=8), "every=8", "none",
                               "list=FILE" */
    const char *alpha; /* the transparent part of photos: "black", "white", "mask" (it counts neither in the
                          loss nor in the scores); "auto" (default): white for Blender's synthetic scenes,
                          else black. Black and white are also the background then */
    uint64_t seed;     /* Default 0 */
    size_t hit_bytes_max; /* memory for the hits of a view that are kept for the adjoint; tiles beyond are
                             traced again, to the same bits. 0: no limit. Default 0 */
    size_t max_anchors;   /* growth stops there. Default 2,000,000 */
    bool grow;            /* grow and prune anchors. Default true */
    double thrift; /* anchors must bring so many times as much to be made and to be kept, [0.1, 10]. Not with
                      compat. Default
                      1 */
    double last_thrift; /* and so many times that to be kept in the last tenth of growing, when none are made
                           any more, [1, 100]; 1: as before. Not with compat. Default 4 */
    bool compat;        /* every quirk of the reference method (docs/training.md). Default false */
    bool exposure; /* learn a colour matrix per photo, for photos whose exposure differs; held-out photos are
                      then scored on their right half, with a matrix fitted to the left. Default false */
    double splats_until; /* splats stand for rays until this part of the run, [0, 1]: their steps are quicker.
                            Pinhole photos, the renderer "trace", not with compat. Default 0.7 */
    double grow_until;   /* anchors grow and are pruned until this fraction of the run, [0, 1]. Default 0.5 */
    double scale_factor; /* of the anchors' first scales, [0.01, 100]; 0: 2 with the balls' scale prior, 0.7
                            with spacing, 1 with compat. Default 0 */
    double learning_rate_factor; /* of all learning rates, [1e-3, 1e3]. Default 1 */
    double save_every_seconds;   /* wall time between checkpoints; 0: only at the end. Default 120 */
    uint64_t save_at_step;       /* one extra checkpoint right after this step; 0: none. Default 0 */
    uint64_t stop_at_step;       /* stop, as a signal would, after this step; 0: never. Default 0 */
    bool tensorboard; /* also write `run`/events.out.tfevents.0.train: scalars of log.csv. Default false */
    bool resume;    /* go on from the run's last checkpoint, with its settings. Other `iterations`, or another
                       budget, give the run another length: schedules go on where a run of that length would
                       be. Default false */
    bool overwrite; /* train anew in a folder that holds a run, which is lost. Default false */
    double eval_at_seconds[GBT_TRAIN_MAX_EVALS]; /* held-out PSNR after so many seconds of training; the clock
                                                    stops meanwhile */
    int eval_at_count;
    const char *command; /* the command line, for the report. Default "" */
    uint32_t cookie_;    /* set by gbt_train_def_default() */
} gbt_train_def;

gbt_train_def gbt_train_def_default(void);

/**
 * Train on the data set in `data`, write everything into the folder `run`.
 *
 * `run` gets model.gbt, log.csv, config, data_places, train.json and checkpoints/. What happens meanwhile
 * goes where gbtrace/progress.h says. SIGINT and SIGTERM stop after the current step: a checkpoint is saved
 * and GBT_ERR_INTERRUPTED is returned. The same seed and length give the same model.gbt, bit for bit, for any
 * number of threads, interrupted and resumed or not.
 *
 * A step whose loss or gradient is not finite changes nothing but a count; ten in a row end the run with
 * GBT_ERR_FORMAT and one line that names the photo or the parameter. Pixels of a float photo that are not
 * finite count in no loss.
 *
 * With `resume`, `data` may be NULL: the run knows its data. Settings that differ from the run's own are
 * warned of and not taken. A run that has taken all its steps takes none; a length that it has passed is
 * GBT_ERR_ARGUMENT, other data than the run's GBT_ERR_FORMAT.
 *
 * A folder that holds model.gbt or a checkpoint is refused with GBT_ERR_ARGUMENT before anything is written,
 * unless `resume` or `overwrite` is set.
 *
 * @return GBT_OK, or what failed; nothing already in `run` is damaged by a failure
 */
gbt_status gbt_train(const char *data, const char *run, const gbt_train_def *def, gbt_error *err);

/**
 * gbt_train() with its settings as text, for other languages and for scripts.
 *
 * @param settings [in] lines "key = value" with the keys of RUN/config; what is not named is as in
 *                      gbt_train_def_default()
 * @return as gbt_train(); GBT_ERR_FORMAT ("settings:LINE: ...") for a line that says nothing
 */
gbt_status gbt_train_with(const char *data, const char *run, const char *settings, gbt_error *err);

/** Threads for everything that follows, >= 1. Without this call: the processors of this process, at most its
    control group's quota. */
void gbt_set_threads(int threads);

GBT_API_END
#endif
