/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/footprint_one.h -- the adjoint of widening, of one Gaussian. */
#ifndef GBT_TEST_TRACE_FOOTPRINT_ONE_H
#define GBT_TEST_TRACE_FOOTPRINT_ONE_H

#include "trace/footprint.h"

static inline void footprint_to_arrays(const footprint_gaussian *from, gaussians *to)
{
    float *const mean[] = {to->mean_x, to->mean_y, to->mean_z};
    float *const scale[] = {to->scale_x, to->scale_y, to->scale_z};
    float *const quat[] = {to->quat_w, to->quat_x, to->quat_y, to->quat_z};
    for (int k = 0; k < 3; k++) {
        *mean[k] = (float)from->mean[k];
        *scale[k] = (float)from->scale[k];
    }
    for (int k = 0; k < 4; k++)
        *quat[k] = (float)from->quat[k];
    *to->opacity = (float)from->opacity;
}

/** `d`: dL/d(widened) in, dL/d(g) out; `g` is the Gaussian as it was before. All go through float32. */
static inline gbt_status footprint_adjoint(const footprint_view *view, float variance, float pixel_min,
                                           const footprint_gaussian *g, footprint_gaussian *d)
{
    gaussians one = {0}, back = {0};
    gbt_status status = gaussians_resize(&one, 1, NULL);
    if (status == GBT_OK)
        status = gaussians_resize(&back, 1, NULL);
    if (status == GBT_OK) {
        footprint_to_arrays(g, &one);
        footprint_to_arrays(d, &back);
        footprint_backward(view, variance, &pixel_min, &one, &back);
        *d = (footprint_gaussian){
            .mean = {(double)*back.mean_x, (double)*back.mean_y, (double)*back.mean_z},
            .scale = {(double)*back.scale_x, (double)*back.scale_y, (double)*back.scale_z},
            .quat = {(double)*back.quat_w, (double)*back.quat_x, (double)*back.quat_y, (double)*back.quat_z},
            .opacity = (double)*back.opacity};
    }
    gaussians_free(&one);
    gaussians_free(&back);
    return status;
}

#endif
