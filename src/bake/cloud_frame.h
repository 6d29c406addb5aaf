/* bake/cloud_frame.h -- one view of plain Gaussians: colours for the camera, tree, trace; and back. */
#ifndef GBT_BAKE_CLOUD_FRAME_H
#define GBT_BAKE_CLOUD_FRAME_H

#include "data/gaussian_cloud.h"
#include "trace/footprint.h"
#include "trace/trace.h"

/** Reused from view to view. Start from {0}, set the first two; free with cloud_frame_free(). */
typedef struct cloud_frame {
    float footprint; /* variance of a pixel, px^2 (trace/footprint.h); 0: rays are thin */
    int pixel_step;  /* the camera's pixels are every n-th of a picture, and as wide as that one's; 0 and 1: all */
    ray_image rays;
    gaussians seen, wide, d_seen; /* of all Gaussians, in their order: from the camera; as its pixels resolve them */
    float *basis;                 /* [count][GAUSSIAN_SH_COUNT] */
    size_t basis_capacity;
    bool widened;
    footprint_view view;
    trace_scene scene;
    image rgb; /* the render */
} cloud_frame;

/**
 * Render `camera` (any model) into f->rgb.
 *
 * @param cloud     [in] borrowed until the backward pass
 * @param keep_tape [in] true when cloud_frame_backward() follows
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 * Threads: one frame per thread; parallel inside; same bits for every thread count. Cost: every Gaussian gets into the tree, seen or not.
 */
gbt_status cloud_frame_render(cloud_frame *f, const gaussian_cloud *cloud, const gbt_camera *camera, const trace_settings *settings, bool keep_tape,
                              gbt_error *err);

/**
 * Adjoint of the last render: dL/d(scale_log, quat, opacity, sh). Means are taken as fixed: of their gradient nothing is told.
 *
 * @param d_cloud [out] as many Gaussians as `cloud`; overwritten but for `mean`; quat's is tangent to the unit quaternions
 * @param weight  [out] optional (NULL), [count]: sum over rays of T alpha
 */
gbt_status cloud_frame_backward(cloud_frame *f, const gaussian_cloud *cloud, const image *d_image, gaussian_cloud *d_cloud, float *weight, gbt_error *err);

void cloud_frame_free(cloud_frame *f);

#endif
