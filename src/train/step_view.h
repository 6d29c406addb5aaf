/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_view.h -- one view of a step: choice of photo and pixels, render, loss, adjoint.

   Its results are a view_outcome, plain bytes that can be sent to another process, and its gradient, a list
   of rows of the anchors that it saw (train/row_list.h). */
#ifndef GBT_TRAIN_STEP_VIEW_H
#define GBT_TRAIN_STEP_VIEW_H

#include "frame/frame.h"
#include "growth/statistics.h"
#include "image/affine.h"
#include "image/metrics.h"
#include "train/learnables.h"
#include "train/poses.h"
#include "train/row_list.h"

enum { STEP_VIEWS_MAX = 64, VIEW_TEXT_SIZE = 512 };

typedef struct trainer trainer;

/** Results of a view of a step. */
typedef struct view_outcome {
    gbt_status status; /* not GBT_OK: the step has failed, `text` says why */
    bool bad;          /* the loss or the gradient is not finite: `text` says which */
    char text[VIEW_TEXT_SIZE];
    double loss, l1, ssim, psnr;       /* psnr: NaN when no pixel is valid */
    double d_exposure[AFFINE_NUMBERS]; /* dL/d(colour matrix of its photo), when exposures are learned */
    double d_pose[POSE_NUMBERS];       /* dL/d(motion of its camera), when poses are learned */
    double d_sky[SH_COUNT][3];         /* dL/d(background coefficients), with a sky */
    int width, height;
    uint64_t gaussians, visible, rays, hits, blended;
} view_outcome;

/** Everything a view needs, reused from step to step. Start from {0}; free with step_view_free(). */
typedef struct step_view {
    size_t slot; /* index of its photo in trainer.train_views */
    frame frame;
    image photo, d_image, exposed; /* exposed: the render as the photo's exposure shows it */
    unsigned char *marks;          /* mask of valid pixels: own copy when a step has several views */
    size_t marks_capacity;
    loss_scratch loss_scratch;
    learnables gradient; /* with several views per step: a row for each visible anchor */
    growth_stats stats;  /* rows as in `gradient` */
    row_list rows;       /* both, with anchor numbers */
    view_outcome outcome;
    gbt_camera camera;   /* camera of the pixels that the view uses */
    float background[3]; /* background colour of this view, or colour below its sky */
    const unsigned char *valid;
    stage_time photo_time, compare_time; /* of the last step */
    double seconds;                      /* wall time of everything but reading the photo */
} step_view;

/** Choose the photos of the next step: sets trainer.slots. */
void step_photos_pick(trainer *t);

/** Choose and read the pixels of view `index` of the next step, [0, trainer.def.views), after
    step_photos_pick(). Call from one thread. A failure is reported in v->outcome. */
void step_view_pick(trainer *t, step_view *v, size_t index);

/**
 * Render, loss and adjoint for the pixels that step_view_pick() chose.
 *
 * With one view per step the gradient is added to trainer.gradient, and v->rows stay empty. With several,
 * v->rows contain the gradient and, if growing_gathers(), the growth statistics.
 *
 * Threads: different views of a step may run at once; parallel inside, same bits for every number. A failure
 * is left in v->outcome.
 */
void step_view_run(trainer *t, step_view *v);

/**
 * The loss between the last render, passed through the colour matrix (NULL: unchanged), and v->photo;
 * v->d_image becomes dL/drender.
 *
 * @param valid mask of valid pixels, from frame_valid()
 * @param matrix    [3][4], or NULL
 * @param d_matrix  [out] dL/dmatrix; not written without one
 */
gbt_status step_view_compare(step_view *v, const unsigned char *valid, const float *matrix,
                             image_loss_result *loss, double d_matrix[AFFINE_NUMBERS], gbt_error *err);

/** Render the photo of `view` from `camera` into v->frame, with every pixel and the photo's own near
    distance. */
gbt_status step_view_draw(const trainer *t, step_view *v, size_t view, const gbt_camera *camera, bool adjoint,
                          gbt_error *err);

/** The near distance of the view's photo. */
float step_view_near(const trainer *t, const step_view *v);

void step_view_free(step_view *v);

#endif
