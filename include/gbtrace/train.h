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

/** What text, range and default a field has: gbt_train_setting_at(). 0 stands for a choice of the program
   only where it can be no value of its own: init_count, voxel_size, offsets, iterations, budget_seconds,
   downscale, scale_factor. */
typedef struct gbt_train_def {
    gbt_init_kind init;
    double init_count; /* anchors per point of GBT_INIT_ADAPTIVE and _RANDOM, at least one; 0: half as many as
                          the paper's balls */
    gbt_scale_prior scale_prior;
    int max_depth;    /* D_max of the balls */
    float voxel_size; /* v, scene units; 0: the median spacing of the points */
    int offsets;      /* K, Gaussians per anchor; 0: 2, or 10 with compat */
    gbt_distance_input distance;
    uint64_t iterations;   /* length of the run, with what was done before `resume`; 0: the budget decides */
    double budget_seconds; /* wall time for training, with what was spent before `resume`; used when
                              iterations is 0 and pace is NULL. 0: 600, or with `resume` as long as the run
                              was to be */
    int views;             /* photos that a step looks at, a power of two up to 64; results depend on it */
    const char *pace;      /* "n1,...,n20", or the list in train.json: iterations in each twentieth of the
                              schedule, as a budget run records them; NULL: as the budget allows */
    double downscale; /* of the cameras' width and height; 0: to the size of the photos if they are smaller,
                         then to 1,600 pixels if the median photo is wider, but for compat */
    gbt_renderer renderer; /* what the photos are compared with; one that trains */
    double footprint; /* rays are as wide as pixels: variance of a pixel, px^2; 0: thin rays. 0 with compat,
                         splats are dilated then */
    double near; /* nothing is seen nearer to a camera than this part of the depth at which its photo's first
                    sparse points are: of all training photos the least but for one in twenty, and at least
                    2 % of the median distance of anchors, which is what counts where points have no tracks.
                    A photo whose points are nearer than that has its own. 0 with compat */
    int step_pixels; /* about how many pixels of its photo a step looks at: every n-th across and down, n
                        being the rounded square root of the photo's pixels / step_pixels, from others each
                        time; 0: all. 0 with compat */
    const char *eval_split; /* held-out photos: "auto" (as the data set says, else every=8), "every=N",
                               "every=N:K" (photos K, K + N, ... of the sorted list; K is 0 without), "none",
                               "list=FILE". "validate=N:K," before it, for choosing constants: these are not
                               even read, and every N-th of the training photos is held out in their place */
    gbt_alpha alpha;        /* black and white are also the background */
    gbt_background background;
    uint64_t seed;
    size_t memory; /* bytes that the program may take, docs/memory.md; the result does not depend on it. 0,
                      the default: no limit */
    uint64_t max_anchors;      /* growth stops there */
    bool grow;                 /* grow and prune anchors */
    double threshold_factor;   /* of the thresholds of densification and of pruning. Not with compat */
    double final_prune_factor; /* of the threshold of pruning, once more, in the last tenth of growing, when
                                  no anchors are made any more; 1: as before. Not with compat */
    bool compat;               /* every quirk of the reference method (docs/compat.md) */
    bool exposure; /* learn a colour matrix per photo; held-out photos are then scored on their right half,
                      with a matrix fitted to the left */
    bool find_exposure;  /* turn `exposure` on where the photos' exposures differ by a standard deviation of
                            more than 0.1 stops, or 0.25 where points have no tracks. Not with compat */
    bool refine_poses;   /* learn the poses of the training photos, too, from where the data set has them;
                            held-out photos are then scored from the poses at which the scene fits them
                            best */
    double splats_until; /* splats stand for rays until this part of the run. Pinhole photos,
                            GBT_RENDERER_TRACE, not with compat */
    double grow_until;   /* anchors grow and are pruned until this part of the run */
    double scale_factor; /* of the anchors' first scales; 0: 2 with the balls' scale prior, 0.7 with spacing,
                            1 with compat */
    double learning_rate_factor; /* of all learning rates */
    double save_every_seconds;   /* wall time between checkpoints; 0: only at the end */
    uint64_t stop_at_step;       /* stop, as a signal would, after this step; 0: never */
    bool tensorboard;            /* also write `run`/events.out.tfevents.0.train: scalars of log.csv */
    bool resume;    /* go on from the run's last checkpoint, with its settings. Other `iterations`, or another
                       budget, give the run another length: schedules go on where a run of that length would
                       be. A budget beside a pace does so only where the run has no pace */
    bool overwrite; /* train anew in a folder that holds a run, which is lost once the data have been read */
    bool lossless; /* nothing but a setting of the run: gbt_compress() with `unless_lossless` leaves its model
                      as it is. With `resume`, true makes it so from now on */
    double eval_at_seconds[GBT_TRAIN_MAX_EVALS]; /* held-out PSNR after so many seconds of training; the clock
                                                    stops meanwhile. With `resume`, where the last one that
                                                    has passed has no score, after the first step */
    int eval_at_count;                           /* [0, GBT_TRAIN_MAX_EVALS]; times rise */
    const char *command;                         /* the command line, for the report. Default "" */
    uint32_t cookie_;                            /* set by gbt_train_def_default() */
} gbt_train_def;

gbt_train_def gbt_train_def_default(void);

/**
 * Train on the data set in `data`, write everything into the folder `run`.
 *
 * `run` gets model.gbt, log.csv, config, data_places, train.json and checkpoints/. What happens meanwhile
 * goes where gbtrace/progress.h says. The model is a large one without scores: gbt_compress() makes it small,
 * gbt_evaluate() makes scores, renders and the report. SIGINT and SIGTERM stop after the current step: a
 * checkpoint is saved and GBT_ERR_INTERRUPTED is returned; a signal more than a second later goes to who
 * handled it before, which mostly ends the process. The same seed and length give the same model.gbt, bit for
 * bit, for any number of threads, interrupted and resumed or not.
 *
 * After gbt_cluster_open() all its processes call this together: they share the `views` of each step, the
 * first one writes the files and has the clock, and the model has the same bytes for any number of processes.
 * `data`, and with `resume` `run`, must be there for all of them.
 *
 * A step whose loss or gradient is not finite changes nothing but a count; ten in a row end the run with
 * GBT_ERR_FORMAT and one line that names the photo or the parameter. It is saved then, and when a photo can
 * no longer be read. Pixels of a float photo that are not finite count in no loss.
 *
 * With `resume`, `data` may be NULL: the run knows its data. Without, that is GBT_ERR_ARGUMENT. Settings
 * that differ from the run's own are warned of and not taken. A run that has taken all its steps takes none;
 * a length that it has passed is GBT_ERR_ARGUMENT, other data than the run's GBT_ERR_FORMAT.
 *
 * A folder that holds model.gbt or a checkpoint is refused with GBT_ERR_ARGUMENT before anything is written,
 * unless `resume` or `overwrite` is set. With `overwrite` the files of the older run are removed when the new
 * one has read its data; a failure before leaves them.
 *
 * @return GBT_OK, or what failed; nothing already in `run` is damaged by a failure
 *
 * Threads: one training at a time, beside other calls; a signal stops all calls that catch it.
 */
gbt_status gbt_train(const char *data, const char *run, const gbt_train_def *def, gbt_error *err);

/**
 * gbt_train() with its settings as text, for other languages and for scripts.
 *
 * @param settings [in] lines "key = value" with the keys of RUN/config; what is not named is as in
 *                      gbt_train_def_default()
 * @return as gbt_train(); GBT_ERR_FORMAT ("settings:LINE: ...") for a line that says nothing
 * Threads: as gbt_train().
 */
gbt_status gbt_train_with(const char *data, const char *run, const char *settings, gbt_error *err);

/**
 * Keep every gbt_train() out of the folder `run`, as each keeps the others out: for what follows a training.
 * Until gbt_release_run(), or the end of the process. Where a file system knows no locks it does nothing.
 *
 * @param hold [out] for gbt_release_run(); unchanged after a failure
 * @return GBT_OK, or GBT_ERR_IO: somebody else has it, or it is no folder
 * Threads: any. With several processes (gbtrace/cluster.h) all call it, and the first one holds the folder.
 */
gbt_status gbt_hold_run(const char *run, int *hold, gbt_error *err);
void gbt_release_run(int hold);

/* ---- the settings as a table, for programs that read them from people ---- */

typedef enum gbt_setting_kind {
    GBT_SETTING_FLAG,    /* bool */
    GBT_SETTING_INT,     /* int */
    GBT_SETTING_UINT64,  /* uint64_t */
    GBT_SETTING_BYTES,   /* size_t */
    GBT_SETTING_FLOAT,   /* float */
    GBT_SETTING_DOUBLE,  /* double */
    GBT_SETTING_SECONDS, /* double */
    GBT_SETTING_CHOICE,  /* an enum, by the names in `choices` */
    GBT_SETTING_TEXT     /* const char * */
} gbt_setting_kind;

typedef struct gbt_train_setting {
    const char *name;   /* in RUN/config and gbt_train_with() */
    const char *option; /* of the program gbtrace, without dashes; NULL: as `name` */
    const char *field;  /* of gbt_train_def */
    size_t offset;      /* of that field, bytes */
    gbt_setting_kind kind;
    double min, max;     /* numbers: inclusive; both 0: any */
    bool or_zero;        /* numbers: 0 is taken too */
    double number;       /* the default, but of GBT_SETTING_TEXT */
    const char *text;    /* the default of GBT_SETTING_TEXT; NULL: none */
    const char *choices; /* GBT_SETTING_CHOICE: "a|b|c", in the order of the enum. GBT_SETTING_TEXT: some of
                            the values */
    const char *unit;    /* what stands for a value in a list: "N", "TIME"; NULL for flags and choices */
    const char *help;    /* one line; of a flag whose default is true: what false does */
    const char *aliases; /* names that other programs have, with blanks between; NULL: none */
    bool saved;          /* in RUN/config: it decides the result */
    bool if_changed; /* in RUN/config only where it is not the default: a run without it has the bytes that it
                        had before there was such a setting, and older versions read it */
    bool rare;       /* few people need it */
} gbt_train_setting;

/** How many settings there are. */
size_t gbt_train_setting_count(void);

/** One of them, static; `index` is below the count. */
const gbt_train_setting *gbt_train_setting_at(size_t index);

/** Threads for everything that follows, 1 to 1024; others are brought into that range. Without this call: the
   processors of this process, at most its control group's quota. */
void gbt_set_threads(int threads);

/**
 * Memory that the process shall take for everything that follows, bytes; 0: no limit. Large arrays are then
 * in files without a name in `folder` (docs/memory.md), which must be on a disk. Results do not depend on it.
 * What cannot be let go of may still take more. gbt_train() with gbt_train_def.memory does this for its own
 * time; a limit set before ends with it.
 *
 * @return GBT_OK, or GBT_ERR_IO when no file can be made there
 */
gbt_status gbt_set_memory(size_t bytes, const char *folder, gbt_error *err);

/** The most memory that the process has taken since its program started, bytes; 0 where nobody says.
    Threads: any. */
size_t gbt_peak_memory(void);

/**
 * For the start of a program: `end` is called, on any thread, when an allocation fails inside a library
 * that leaves no way back (OpenImageIO, oneTBB, jansson). It must end the process. Without this such a
 * failure becomes GBT_ERR_NO_MEMORY where the library lets it; where it does not, the process ends by
 * SIGABRT or waits forever, and JSON may be taken for no JSON or be written without some of its fields.
 */
void gbt_when_out_of_memory(void (*end)(void));

GBT_API_END
#endif
