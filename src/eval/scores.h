/* SPDX-License-Identifier: Apache-2.0 */
/* eval/scores.h -- the scores of a run: of its held-out views, and their means. */
#ifndef GBT_EVAL_SCORES_H
#define GBT_EVAL_SCORES_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"
#include "image/metrics.h"
#include "run/loaded_run.h"

enum { VIEW_PATH_SIZE = 4096 };

typedef struct view_score {
    char name[1024];
    char file[FILE_NAME_SIZE]; /* of its pictures, without what tells them apart (loaded_run_view_name()) */
    double psnr, ssim, flip;
    double psnr_fitted; /* image_psnr_fitted() */
    double seconds;     /* decode, tree and trace of this view */
    lpips_scores lpips; /* with a network */
    size_t gaussians;
    bool masked; /* some pixels of the photo do not count */
    char render_path[VIEW_PATH_SIZE], photo_path[VIEW_PATH_SIZE],
        error_path[VIEW_PATH_SIZE]; /* PNG files; the last is FLIP, 1 channel */
} view_score;

/** Means are NaN without held-out views. */
typedef struct evaluation {
    view_score *views;
    size_t view_count;
    double psnr, psnr_fitted, ssim, flip, gaussians_per_view;
    lpips_scores lpips;
    const char *lpips_network; /* "vgg", "alex"; NULL: there are no such scores */
    size_t anchors, model_bytes;
    gbt_renderer renderer; /* what drew the views */
    double downscale;      /* the photos were divided by this */
    bool masked;           /* some view is */
    bool aligned;          /* the photos' poses, to the scene (train/align.h) */
    bool exposure;         /* scored on the right halves of the photos (image/affine.h) */
} evaluation;

/** Where its pictures are: FOLDER/FILE.png, .photo.png, .flip.png. GBT_ERR_ARGUMENT when a path is too long.
 */
gbt_status view_score_paths(view_score *score, const char *folder, gbt_error *err);

#endif
