/* train/trainer.h -- the state of a training run and one step of it. */
#ifndef GBT_TRAIN_TRAINER_H
#define GBT_TRAIN_TRAINER_H

#include "anchor/adjust.h"
#include "anchor/anchors.h"
#include "anchor/init.h"
#include "data/scene.h"
#include "gbtrace/train.h"
#include "image/metrics.h"
#include "train/frame.h"
#include "train/photos.h"
#include "train/schedule.h"

/** What the last step did. */
typedef struct step_report {
    double loss, l1, ssim, psnr;
    int width, height, level;
    size_t gaussians, visible;
    double photo_seconds, loss_seconds, optimizer_seconds, adjust_seconds, total_seconds; /* frame times are in trainer.frame */
    bool skipped;                                                                          /* the loss was not finite */
} step_report;

typedef struct trainer {
    gbt_train_def def; /* strings borrowed from the caller */
    scene scene;
    photos photos;
    size_t *train_views; /* indices into scene.views */
    size_t train_count, test_count;

    /* What learns, its gradient and its Adam moments: same shapes. */
    anchors anchors, gradient, moment1, moment2;
    decoder decoder;
    float *d_params, *params_m, *params_v;
    adjust_stats stats;

    float voxel_size;
    double extent;
    trace_settings settings;
    size_t anchors_initial, points_used;
    bool points_made;        /* the data set has no sparse points: ours */
    char start_text[160];    /* what the run starts from, for people */

    pace pace;
    uint64_t step;        /* steps done */
    uint64_t adjust_step; /* steps done at the last adjust */
    uint64_t anchor_t;    /* Adam steps of the per-anchor groups */
    uint64_t skipped_steps, skipped_in_row;
    double seconds;       /* training time so far, over all runs that continued one another */

    frame frame;
    image photo, d_image;
    loss_scratch loss_scratch;
    uint32_t *order; /* views of the epoch */
    uint64_t order_epoch;
    bool order_ready;
} trainer;

/** Load the data, make the anchors. Start from {0}; free with trainer_free() after success or failure. */
gbt_status trainer_open(trainer *t, const char *data, const gbt_train_def *def, gbt_error *err);

/** One iteration: pick a view, render, loss, adjoint, Adam, statistics, grow and prune. The pace must know this step. */
gbt_status trainer_step(trainer *t, step_report *out, gbt_error *err);

/** Mean PSNR over the held-out views at full training resolution, on 8-bit images. */
gbt_status trainer_held_out_psnr(trainer *t, double *psnr, gbt_error *err);

void trainer_free(trainer *t);

#endif
