/* SPDX-License-Identifier: Apache-2.0 */
/* train/trainer.h -- the state of a training run and one step of it. */
#ifndef GBT_TRAIN_TRAINER_H
#define GBT_TRAIN_TRAINER_H

#include "anchor/anchors.h"
#include "data/scene.h"
#include "gbtrace/train.h"
#include "frame/frame.h"
#include "train/exposure.h"
#include "train/learnables.h"
#include "train/photos.h"
#include "train/poses.h"
#include "train/rules.h"
#include "train/schedule.h"
#include "train/sky_learning.h"
#include "train/step_view.h"

/** What the last step did. */
typedef struct step_report {
    double loss, l1, ssim, psnr;  /* means over its views with a valid pixel; NaN without any */
    int width, height;            /* of the first view */
    size_t gaussians, visible;    /* means over its views */
    uint64_t rays, hits, blended; /* of all views */
    frame_times times;            /* sums over its views; so are photo and compare */
    double views_at_once;         /* mean number of views that ran at the same time */
    stage_time photo, compare, optimizer, adjust, all;
    double wait_seconds, exchange_seconds; /* wait: until all processes had finished their views; exchange:
                                              for sending rows */
    uint64_t exchange_bytes;
    bool skipped; /* the loss or a gradient was not finite: no parameter changed */
} step_report;

struct trainer {
    gbt_train_def def; /* strings borrowed from the caller */
    train_rules rules;
    scene scene;
    photos photos;
    uint64_t photos_hash, masks_hash; /* checkpoint_hash_photos() */
    size_t *train_views;              /* indices into scene.views */
    size_t train_count, test_count;

    /* Trainable parameters; gradient and Adam moments have the same shapes. */
    anchors anchors;
    uint64_t *created; /* [anchors.count]: anchor_t when the anchor was made, ascending */
    decoder decoder;
    learnables gradient, moment1, moment2;
    growth_stats stats;
    exposures exposures; /* of the training photos, in the order of train_views; count 0 without --exposure */

    poses poses; /* likewise; count 0 without --refine-poses. The learned poses themselves are in `scene` */

    float voxel_size;
    double distance;                      /* median distance from training cameras to anchors */
    double extent, first_scale_max;       /* first_scale_max: cap of initial scales, because an isolated point
                                             would start as a floater */
    float scale_log_min, scale_log_limit; /* range of every log-scale: wider than any scene needs, but far
                                             from the limits of float */
    float *scale_log_max;                 /* [anchors.count]: upper limit of each anchor
                                             (train/scale_limit.h) */
    trace_settings settings;
    sky_moments sky; /* for the background in `settings`, if it varies with direction */
    size_t anchors_initial, points_used;
    char start_text[160]; /* text for logs: what the run starts from */

    pace pace;
    char pace_words[PACE_TEXT_SIZE]; /* def.pace in the form of files, if there is one */
    uint64_t step;                   /* steps done */
    double pixel_share;              /* of the training photos' pixels that a step uses, in the mean */
    float left_out;                  /* share of the anchors in view that this step leaves out at random:
                                        schedule_left_out() */
    uint64_t round_step;             /* steps done at the last round of growth */
    uint64_t anchor_t;               /* Adam steps of the per-anchor groups */
    uint64_t began;                  /* with rules.begins_at, the step at which the model began; 0: not yet */
    uint64_t skipped_steps, skipped_in_row;
    uint64_t empty_in_row, opacity_raises; /* steps in a row without a Gaussian although anchors were visible;
                                              number of times that opacities were raised for it */
    double seconds;                        /* training time so far, including before --resume */

    step_view *views; /* [view_count] the views of a step that this process renders; the first one's frame
                         also renders the held-out views */
    size_t view_count, first_view;         /* this process's range in the def.views views of the step */
    size_t slots[STEP_VIEWS_MAX];          /* photos of all views of the step: indices into train_views */
    view_outcome outcomes[STEP_VIEWS_MAX]; /* of all views of the step */
    row_list own_rows;                     /* the sum over the views of this process */
    row_list rows, received,
        owned;       /* with several processes: the sum over all views, and the buffers for it */
    uint32_t *order; /* order of the photos in the epoch */
    uint64_t order_epoch;
    bool order_ready;
};

/** Load the data and make the anchors. Start from {0}; free with trainer_free() after success or failure. */
gbt_status trainer_open(trainer *t, const char *data, const gbt_train_def *def, gbt_error *err);

/** Networks, features and Adam's state as trainer_open() made them. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status trainer_begin_again(trainer *t, gbt_error *err);

/**
 * One iteration: pick views, render, loss, adjoint, Adam, statistics, grow and prune. The pace must know
 * this step.
 *
 * The gradient is the mean over the views of the step (def.views), which are rendered with the same
 * parameters; gradient and statistics are summed in a binary tree over the views, so their bits do not depend
 * on which views run at the same time.
 *
 * A step with a view whose loss or gradient is not finite is skipped: parameters, moments and statistics
 * stay, the step is counted, and a warning names the photo or the first bad gradient. GBT_ERR_FORMAT after
 * ten such steps in a row.
 *
 * Gaussians below opacity 0 have no gradient, so a scene that has lost all Gaussians (or starts without any,
 * because the network weights are random) would stay empty. After five steps in a row with visible anchors
 * but no Gaussian, opacities are raised to 0.1. Until anchors grow (rules.raises_until), each step also
 * raises those of every offset whose mean is below 0.
 */
gbt_status trainer_step(trainer *t, step_report *out, gbt_error *err);

void trainer_free(trainer *t);

#endif
