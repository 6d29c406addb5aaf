/* SPDX-License-Identifier: Apache-2.0 */
/* bake/bake.h -- converts an anchor model to plain Gaussians, which every viewer can draw without the
   networks. */
#ifndef GBT_BAKE_BAKE_H
#define GBT_BAKE_BAKE_H

#include "data/gaussian_cloud.h"
#include "frame/frame.h"

typedef struct bake_def {
    int sh_degree;       /* of the colours' spherical harmonics, [0, 3]. Default 3 */
    double prior_weight; /* [0, 1]: weight of directions without a camera, relative to those with one. Without
                     it the fitted colours take extreme values there. Default 0.3 */
    size_t count_max; /* keep only this many Gaussians, those with the largest weights; 0: all. Default 0 */
} bake_def;
bake_def bake_def_default(void);

typedef struct bake_result {
    gaussian_cloud cloud; /* scene-local coordinates; free with gaussian_cloud_free() */
    size_t unseen;        /* Gaussians left out because no camera sees them */
    size_t thinned;       /* Gaussians left out because of `count_max` */
} bake_result;

/**
 * Make one plain Gaussian of each neural one that some camera sees. Its position is exact, because in these
 * models it does not depend on the view. The other properties do, and are averaged over the cameras, weighted
 * with the Gaussian's contribution to the picture (the sum of T alpha over every second ray in both
 * directions): opacity as the sum of the weights divided by the sum of what they would be if the Gaussian
 * were opaque, shape as the mean covariance, and colour as a least-squares fit of spherical harmonics. 64
 * directions spread over the sphere are added to that fit with the weight `prior_weight`. The sum of a
 * Gaussian's weights over all cameras ranks it for `count_max`.
 *
 * @param f       [in,out] any frame; its drawing settings are used, except for the renderer: weights are
 *                         always ray traced
 * @param cameras [in] those of the training photos
 * @param settings [in] [camera_count]: how each camera's picture is drawn
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, no Gaussian is seen), GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Memory: 1.5 kB per neural Gaussian. Cost: a forward
 * and an adjoint pass of a quarter of the pixels per camera.
 */
gbt_status bake_cloud(frame *f, const anchors *a, const decoder *d, const gbt_camera *cameras,
                      size_t camera_count, const trace_settings *settings, const bake_def *def,
                      bake_result *out, gbt_error *err);

#endif
