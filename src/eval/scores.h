/* SPDX-License-Identifier: Apache-2.0 */
/* eval/scores.h -- the scores of a run: per held-out view, and their means. */
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
    char file[FILE_NAME_SIZE]; /* common name of its image files, without endings (loaded_run_view_name()) */
    double psnr, ssim, flip;
    double psnr_fitted; /* image_psnr_fitted() */
    double seconds;     /* time of decoding, tree building and tracing */
    lpips_scores lpips; /* when a network is given */
    size_t gaussians;
    bool masked; /* the photo has invalid pixels */
    char render_path[VIEW_PATH_SIZE], photo_path[VIEW_PATH_SIZE],
        error_path[VIEW_PATH_SIZE]; /* PNG files; the last is FLIP, 1 channel */
} view_score;

/** Means are NaN without held-out views. */
typedef struct evaluation {
    view_score *views;
    size_t view_count;
    double psnr, psnr_fitted, ssim, flip, gaussians_per_view;
    lpips_scores lpips;
    const char *lpips_network; /* "vgg", "alex"; NULL: no LPIPS scores */
    size_t anchors, model_bytes;
    gbt_renderer renderer; /* renderer of the views */
    double downscale;      /* divisor of the photo sizes */
    bool masked;           /* some view is masked */
    bool aligned;          /* the held-out poses were aligned with the scene (train/align.h) */
    bool exposure;         /* scored on the right halves of the photos (image/affine.h) */
} evaluation;

/** Set the paths of its images: FOLDER/FILE.png, .photo.png, .flip.png. GBT_ERR_ARGUMENT when a path is too
    long. */
gbt_status view_score_paths(view_score *score, const char *folder, gbt_error *err);

#endif
