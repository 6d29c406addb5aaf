/* SPDX-License-Identifier: Apache-2.0 */
/* bake/bake.h -- an anchor model as plain Gaussians, which every viewer draws without its networks. */
#ifndef GBT_BAKE_BAKE_H
#define GBT_BAKE_BAKE_H

#include "data/gaussian_cloud.h"
#include "frame/frame.h"

typedef struct bake_def {
    int sh_degree; /* of the colours, [0, 3]. Default 3 */
    double prior;  /* [0, 1]: weight of directions that no camera had, against those that some had. Without it
                      colours there explode. Default 0.3 */
    size_t count_max; /* keep no more Gaussians than these, those that are blended most; 0: all. Default 0 */
} bake_def;
bake_def bake_def_default(void);

typedef struct bake_result {
    gaussian_cloud cloud; /* scene-local coordinates; free with gaussian_cloud_free() */
    size_t unseen;        /* Gaussians that no camera sees: left out */
    size_t thinned;       /* that are seen, and are not among `count_max`: left out too */
} bake_result;

/**
 * One plain Gaussian for each neural one that some camera sees. Its place is exact: in these models it does
 * not depend on the view. What does is averaged over the cameras, each with the weight that the Gaussian has
 * in its picture (sum of T alpha over every second ray): opacity as a mean over what would be seen if it were
 * opaque, shape as the mean of covariances, colour as the least-squares fit of spherical harmonics, to which
 * 64 directions spread over the sphere are added with the weight `prior`. How much a Gaussian is blended is
 * the sum of its weights over all cameras.
 *
 * @param f       [in,out] any frame; its drawing is kept, but for the renderer: weights are traced
 * @param cameras [in] those of the training photos
 * @param settings [in] [camera_count]: how each is drawn
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, no Gaussian is seen), GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Memory: 1.5 kB per neural Gaussian. Cost: a forward
 * and an adjoint pass of a quarter of the pixels per camera.
 */
gbt_status bake_cloud(frame *f, const anchors *a, const decoder *d, const gbt_camera *cameras,
                      size_t camera_count, const trace_settings *settings, const bake_def *def,
                      bake_result *out, gbt_error *err);

#endif
