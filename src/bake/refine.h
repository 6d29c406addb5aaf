/* SPDX-License-Identifier: Apache-2.0 */
/* bake/refine.h -- fits plain Gaussians to the pictures of the anchor model, with our ray tracer and its
   adjoint. */
#ifndef GBT_BAKE_REFINE_H
#define GBT_BAKE_REFINE_H

#include "frame/frame.h"

typedef struct refine_def {
    int steps;     /* >= 0. Default 500 */
    uint64_t seed; /* of the order of views and the choice of pixels. Default 0 */
} refine_def;
refine_def refine_def_default(void);

/**
 * Optimize the cloud to reproduce the model's pictures. Each step renders one camera (every second pixel in
 * both directions) with the model and with the cloud, and updates opacities, shapes and colours with Adam to
 * reduce 0.8 L1 + 0.2 (1 - SSIM) between the two pictures. Means are not changed.
 *
 * @param teacher  [in,out] a frame with the model's drawing settings
 * @param settings [in]     [camera_count]: how each camera's picture is drawn
 * @param cloud    [in,out] sh_degree is unchanged; the result has unit quaternions and opacities in (0, 1)
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Cost: about 30 ms on two cores per step, at 480 x 359
 * and 40,000 Gaussians.
 */
gbt_status refine_cloud(frame *teacher, const anchors *a, const decoder *d, const gbt_camera *cameras,
                        size_t camera_count, const trace_settings *settings, const refine_def *def,
                        gaussian_cloud *cloud, gbt_error *err);

#endif
