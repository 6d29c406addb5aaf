/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_view.h -- one of the views of a step: which photo, which of its pixels, render, loss, adjoint.

   What it says of itself is a view_outcome, plain bytes that may go to another process; its gradient is a
   list of the rows of the anchors that it saw (train/row_list.h). */
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

/** What a view of a step came to. */
typedef struct view_outcome {
    gbt_status status; /* GBT_OK, or the step cannot be made: `text` says why */
    bool bad;          /* the loss or the gradient is not finite: `text` says which */
    char text[VIEW_TEXT_SIZE];
    double loss, l1, ssim, psnr;       /* psnr: NaN where no pixel counts */
    double d_exposure[AFFINE_NUMBERS]; /* dL/d(colour matrix of its photo), with exposures */
    double d_pose[POSE_NUMBERS];       /* dL/d(motion of its camera), with poses */
    double d_sky[SH_COUNT][3];         /* dL/d(background's coefficients), with a sky */
    int width, height;
    uint64_t gaussians, visible, rays, hits, blended;
} view_outcome;

/** Everything a view needs, reused from step to step. Start from {0}; free with step_view_free(). */
typedef struct step_view {
    size_t slot; /* of its photo: an index into trainer.train_views */
    frame frame;
    image photo, d_image, exposed; /* exposed: the render as the photo's exposure shows it */
    unsigned char *marks;          /* which pixels count, where views are more than one */
    size_t marks_capacity;
    loss_scratch loss_scratch;
    learnables gradient; /* with several views a step: a row for each visible anchor */
    growth_stats stats;  /* as `gradient` */
    row_list rows;       /* both, with the anchors' numbers */
    view_outcome outcome;
    gbt_camera camera;   /* of the pixels that it looks at */
    float background[3]; /* what lies behind the scene, for this view */
    const unsigned char *valid;
    stage_time photo_time, compare_time; /* of the last step */
    double seconds;                      /* wall time of all but the photo */
} step_view;

/** trainer.slots: the photos of the next step. */
void step_photos_pick(trainer *t);

/** Photo and pixels of view `index` of the next step, [0, trainer.def.views), after step_photos_pick(). One
   thread. A failure is left in v->outcome. */
void step_view_pick(trainer *t, step_view *v, size_t index);

/**
 * Render, loss, adjoint, of what step_view_pick() has picked.
 *
 * With one view a step the gradient is added to trainer.gradient, and v->rows stay empty; else v->rows have
 * it and, where growing_gathers(), the statistics of growth.
 *
 * Threads: different views of a step may run at once; parallel inside, same bits for every number. A failure
 * is left in v->outcome.
 */
void step_view_run(trainer *t, step_view *v);

/**
 * The loss of the last render to v->photo, as the colour matrix shows it (NULL: as it is); v->d_image becomes
 * dL/drender.
 *
 * @param valid     which pixels count, from frame_valid()
 * @param matrix    [3][4], or NULL
 * @param d_matrix  [out] dL/dmatrix; not written without one
 */
gbt_status step_view_compare(step_view *v, const unsigned char *valid, const float *matrix,
                             image_loss_result *loss, double d_matrix[AFFINE_NUMBERS], gbt_error *err);

/** Draw what `camera` sees of the photo of `view`, with every pixel and to its own near distance, into
 * v->frame. */
gbt_status step_view_draw(const trainer *t, step_view *v, size_t view, const gbt_camera *camera, bool adjoint,
                          gbt_error *err);

/** Nothing nearer to the camera of its photo is drawn. */
float step_view_near(const trainer *t, const step_view *v);

void step_view_free(step_view *v);

#endif
