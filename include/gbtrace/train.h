/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/train.h -- train a neural Gaussian scene from posed photos. */
#ifndef GBTRACE_TRAIN_H
#define GBTRACE_TRAIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

enum { GBT_TRAIN_MAX_EVALS = 16 };

/** Settings of a training run. gbt_train_setting_at() has the range, the default and a help text of each
    field but the last four. 0 means that the program chooses the value only for the fields where 0 cannot be
    a value itself: init_count, voxel_size, offsets, iterations, budget_seconds, downscale, scale_factor. */
typedef struct gbt_train_def {
    gbt_init_kind init;
    double init_count; /* anchors per point of GBT_INIT_ADAPTIVE and _RANDOM; at least one anchor is made; 0:
                          half as many anchors as the paper's balls */
    gbt_scale_prior scale_prior;
    int max_depth;    /* D_max of the balls */
    float voxel_size; /* v, scene units; 0: the median spacing of the points */
    int offsets;      /* K, Gaussians per anchor; 0: 2, or 10 with compat */
    gbt_distance_input distance;
    uint64_t iterations;   /* total length of the run, including the iterations before `resume`; 0: the budget
                              decides */
    double budget_seconds; /* wall time for training, including the time before `resume`; used when iterations
                              is 0 and pace is NULL. 0: 600, or with `resume` the run's own length */
    int views;             /* photos per step, a power of two up to 64; results depend on it */
    const char *pace;      /* iterations in each twentieth of the schedule, "n1,...,n20", or the list in
                              train.json that a run with a budget records; NULL: as the budget allows */
    double downscale; /* divisor of the cameras' width and height; 0: to the size of the photos if they are
                         smaller, then, without compat, to a width of 1,600 pixels if the median photo is
                         wider */
    gbt_renderer renderer; /* renders the images that are compared with the photos; one that can train */
    double footprint; /* variance of the pixel footprint (rays as wide as pixels), px^2; 0: thin rays. 0 with
                         compat, where splats are dilated instead */
    double near; /* near distance, as a fraction of the depth of the nearest sparse points: nothing closer to
                    a camera is rendered. The depth is the least over the training photos, leaving out one in
                    twenty; a photo whose points are nearer uses its own. The near distance is at least 2 % of
                    the median distance between cameras and anchors, which is used alone when points have no
                    tracks. 0 with compat */
    int step_pixels; /* approximate number of pixels per photo and step: every n-th across and down, from
                        another first pixel in each step, with n the rounded square root of the photo's pixels
                        / step_pixels; 0: all. 0 with compat */
    const char *eval_split; /* held-out photos: "auto" (as the data set says, else every=8), "every=N",
                               "every=N:K" (photos K, K + N, ... of the sorted list; K defaults to 0), "none",
                               "list=FILE". With the prefix "validate=N:K,", for tuning constants, these
                               photos are not even read, and every N-th of the training photos is held out
                               instead */
    gbt_alpha alpha;        /* black and white also set the background */
    gbt_background background;
    uint64_t seed;
    size_t memory; /* bytes that the process may use (docs/memory.md); results do not depend on it. 0, the
                      default: no limit */
    uint64_t max_anchors;      /* upper limit of growth */
    bool grow;                 /* whether anchors grow and are pruned */
    double threshold_factor;   /* multiplies the thresholds of growth and of pruning. Not with compat */
    double final_prune_factor; /* multiplies the pruning threshold again in the last rounds, which only prune
                                  (docs/training.md); 1: no change. Not with compat */
    bool compat;               /* follow the reference method in every detail (docs/compat.md) */
    bool exposure; /* learn a colour matrix per photo; held-out photos are then scored on their right half,
                      with a matrix fitted to the left */
    bool find_exposure;  /* turn `exposure` on when the standard deviation of the photos' exposures is more
                            than 0.1 stops, or 0.25 when points have no tracks. Not with compat */
    bool refine_poses;   /* also learn the poses of the training photos, starting from those of the data set;
                            held-out photos are then scored from the poses at which the scene fits them
                            best */
    double splats_until; /* part of the run, from its start, that renders splats instead of rays. For pinhole
                            photos and GBT_RENDERER_TRACE; not with compat */
    double grow_until;   /* part of the run at which growth and pruning end */
    double scale_factor; /* multiplies the initial scales of anchors; 0: 2 with GBT_SCALE_PRIOR_GB, 0.7 with
                            spacing, 1 with compat */
    double learning_rate_factor; /* multiplies all learning rates */
    double save_every_seconds;   /* wall time between checkpoints; 0: only at the end */
    uint64_t stop_at_step;       /* stop after this step, as on a signal; 0: never */
    bool tensorboard;            /* also write `run`/events.out.tfevents.0.train: the scalars of log.csv */
    bool resume;    /* continue from the run's last checkpoint with its settings. Different `iterations`, or a
                       different budget, change the length of the run: schedules continue as in a run of that
                       length at the same step. When both a pace and a budget are given, the budget does so
                       only if the run has no pace */
    bool overwrite; /* train from the start in a folder that holds a run; the old run is deleted once the data
                       have been read */
    bool lossless;  /* does not change training: it marks the run, so that gbt_compress() with
                       `after_training` leaves its model as it is. With `resume`, true sets the mark from now
                       on */
    double eval_at_seconds[GBT_TRAIN_MAX_EVALS]; /* compute held-out PSNR after these times, in seconds of
                                                    training; the clock stops meanwhile. With `resume`, the
                                                    last time that has passed without a score is caught up
                                                    after the first step */
    int eval_at_count;                           /* [0, GBT_TRAIN_MAX_EVALS]; times ascend, from 0 on */
    const char *command;                         /* the command line, for the report. Default "" */
    uint32_t cookie_;                            /* set by gbt_train_def_default() */
} gbt_train_def;

gbt_train_def gbt_train_def_default(void);

/**
 * Train on the data set in `data`, and write all files of the run into the folder `run`.
 *
 * `run` gets model.gbt, log.csv, config, data_places, train.json and checkpoints/. Progress and messages go
 * to the listener of gbtrace/progress.h. The model is uncompressed and has no scores: gbt_compress() makes it
 * small, gbt_evaluate() makes scores, renders and the report. SIGINT and SIGTERM stop after the current step:
 * a checkpoint is saved and GBT_ERR_INTERRUPTED is returned. A signal more than a second later goes to the
 * previous handler, which usually ends the process. The same seed and length give the same model.gbt, bit for
 * bit, for any number of threads, interrupted and resumed or not.
 *
 * After gbt_cluster_open() all processes call this together: they share the `views` of each step, the first
 * one writes the files and measures time, and the model has the same bytes for any number of processes. All
 * of them must be able to read `data`, and with `resume` also `run`.
 *
 * A step whose loss or gradient is not finite is counted and otherwise skipped; ten in a row end the run with
 * GBT_ERR_FORMAT and one line that names the photo or the parameter. The run is saved in this case, and also
 * when a photo can no longer be read. Non-finite pixels of a float photo are excluded from the loss.
 *
 * With `resume`, `data` may be NULL, because the run records its data set; otherwise NULL is
 * GBT_ERR_ARGUMENT. Settings that differ from the run's own cause a warning and are ignored. A run that has
 * taken all its steps takes no more. A length that the run has already passed is GBT_ERR_ARGUMENT; data other
 * than the run's are GBT_ERR_FORMAT.
 *
 * A folder that holds model.gbt or a checkpoint is refused with GBT_ERR_ARGUMENT before anything is written,
 * unless `resume` or `overwrite` is set. With `overwrite` the files of the old run are removed once the new
 * one has read its data; a failure before that leaves them.
 *
 * @return GBT_OK, or what failed; nothing already in `run` is damaged by a failure
 *
 * Threads: one training at a time; other calls may run beside it; a signal stops all calls that catch it.
 */
gbt_status gbt_train(const char *data, const char *run, const gbt_train_def *def, gbt_error *err);

/**
 * gbt_train() with its settings as text, for other languages and for scripts.
 *
 * @param settings [in] lines "key = value" with the keys of RUN/config, "" for none; keys that are missing
 *                      have the values of gbt_train_def_default()
 * @return as gbt_train(); GBT_ERR_FORMAT ("settings:LINE: ...") for a line that is not a valid setting
 * Threads: as gbt_train().
 */
gbt_status gbt_train_with(const char *data, const char *run, const char *settings, gbt_error *err);

/**
 * Lock the folder `run` against every gbt_train(), with the lock that gbt_train() itself takes: for work that
 * follows a training. The lock holds until gbt_release_run() or the end of the process. On a file system
 * without locks it does nothing.
 *
 * @param hold [out] for gbt_release_run(); unchanged after a failure
 * @return GBT_OK, or GBT_ERR_IO when another holder has the lock or `run` is not a folder
 * Threads: any. With several processes (gbtrace/cluster.h) all call it, and the first one holds the lock.
 */
gbt_status gbt_hold_run(const char *run, int *hold, gbt_error *err);
void gbt_release_run(int hold);

/* ---- the settings as a table, for programs that parse them from user input ---- */

typedef enum gbt_setting_kind {
    GBT_SETTING_FLAG,    /* bool */
    GBT_SETTING_INT,     /* int */
    GBT_SETTING_UINT64,  /* uint64_t */
    GBT_SETTING_BYTES,   /* size_t */
    GBT_SETTING_FLOAT,   /* float */
    GBT_SETTING_DOUBLE,  /* double */
    GBT_SETTING_SECONDS, /* double */
    GBT_SETTING_CHOICE,  /* an enum, written by its names in `choices` */
    GBT_SETTING_TEXT     /* const char * */
} gbt_setting_kind;

typedef struct gbt_train_setting {
    const char *name;   /* in RUN/config and gbt_train_with() */
    const char *option; /* option of the program gbtrace, without dashes; NULL: the same as `name` */
    const char *field;  /* field of gbt_train_def */
    size_t offset;      /* offset of that field, bytes */
    gbt_setting_kind kind;
    double min, max;     /* for numbers: inclusive range; both 0: any */
    bool or_zero;        /* for numbers: 0 is also accepted, although outside the range */
    double number;       /* the default of all kinds but GBT_SETTING_TEXT */
    const char *text;    /* the default of GBT_SETTING_TEXT; NULL: none */
    const char *choices; /* GBT_SETTING_CHOICE: "a|b|c", in the order of the enum. GBT_SETTING_TEXT: some of
                            the possible values */
    const char *unit;    /* placeholder of the value in help texts: "N", "TIME"; NULL for flags and choices */
    const char *help;    /* one line; for a flag whose default is true: what false does */
    const char *aliases; /* names of the same setting in other programs, separated by blanks; NULL: none */
    bool saved;          /* stored in RUN/config, because it affects the result */
    bool if_changed; /* stored in RUN/config only if it is not the default: then the file of a run that does
                        not use the setting is the same as before the setting existed, and older versions can
                        read it */
    bool rare;       /* rarely needed */
} gbt_train_setting;

/** Number of settings. */
size_t gbt_train_setting_count(void);

/** Setting `index`, below the count; static. */
const gbt_train_setting *gbt_train_setting_at(size_t index);

/** Number of threads for all later calls, clamped to [1, 1024]. Default: the processors available to this
    process, at most its control group's quota. Threads: not while another call runs. */
void gbt_set_threads(int threads);

/**
 * Limit the memory of the process for all later calls, bytes; 0: no limit. Large arrays are then kept in
 * unnamed files in `folder` (docs/memory.md), which must be on a disk. Results do not depend on it. Memory
 * that cannot be moved to files may still exceed the limit. gbt_train() with gbt_train_def.memory sets such a
 * limit while it runs; a limit set before is gone afterwards.
 *
 * @param folder [in] not used when `bytes` is 0
 * @return GBT_OK, or GBT_ERR_IO when no file can be created there
 * Threads: not while another call runs.
 */
gbt_status gbt_set_memory(size_t bytes, const char *folder, gbt_error *err);

/** Peak memory of the process since its program started, bytes; 0 when the system does not report it.
    Threads: any. */
size_t gbt_peak_memory(void);

/**
 * Set a handler at the start of a program: `end` is called, on any thread, when an allocation or the start of
 * a thread fails inside a library that cannot recover (OpenImageIO, oneTBB, jansson). It must end the
 * process. Without a handler such a failure becomes GBT_ERR_NO_MEMORY if the library allows it; otherwise the
 * process ends with SIGABRT or waits forever, or JSON is written with fields missing.
 */
void gbt_when_out_of_memory(void (*end)(void));

GBT_API_END
#endif
