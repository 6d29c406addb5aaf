/* SPDX-License-Identifier: Apache-2.0 */
/* bake/refine.h -- plain Gaussians fitted to what the anchor model shows, by our own tracer and its
   adjoint. */
#ifndef GBT_BAKE_REFINE_H
#define GBT_BAKE_REFINE_H

#include "frame/frame.h"

typedef struct refine_def {
    int steps;     /* >= 0. Default 500 */
    uint64_t seed; /* of the order of views and pixels. Default 0 */
} refine_def;
refine_def refine_def_default(void);

/**
 * Make the cloud look like the model: each step renders every second pixel in both directions of one camera
 * with both, and steps opacities, shapes and colours (Adam; means stay) against 0.8 L1 + 0.2 (1 - SSIM) of
 * the two pictures.
 *
 * @param teacher  [in,out] a frame with the model's own drawing
 * @param settings [in]     [camera_count]: how each is drawn
 * @param cloud    [in,out] sh_degree stays; unit quaternions and opacities in (0, 1) come out
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Cost: some 30 ms of two cores a step at 480 x 359 and
 * 40,000 Gaussians.
 */
gbt_status refine_cloud(frame *teacher, const anchors *a, const decoder *d, const gbt_camera *cameras,
                        size_t camera_count, const trace_settings *settings, const refine_def *def,
                        gaussian_cloud *cloud, gbt_error *err);

#endif
