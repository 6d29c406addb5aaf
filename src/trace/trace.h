/* trace/trace.h -- ray tracing of Gaussians: build, forward, adjoint.

   What one ray sees is defined in docs/tracing.md; reference.h is that definition in double, and this is the same in float32, sixteen
   rays at a time, over a tree (bvh/gaussian_tree.h). */
#ifndef GBT_TRACE_TRACE_H
#define GBT_TRACE_TRACE_H

#include "base/cpu.h"
#include "base/gaussians.h"
#include "base/image.h"
#include "trace/kernel.h"
#include "trace/rays.h"
#include "trace/settings.h"

/** One view's Gaussians, ready to be traced; and the memory of passes over them, reused from view to view. Start from {0}. */
typedef struct trace_scene {
    const gaussians *source; /* borrowed from trace_build() */
    gaussian_tree tree;
    trace_settings settings;
    float *records;
    size_t record_capacity;
    float reach; /* largest |coordinate| of the ray origins announced to trace_build() */
    struct trace_block *blocks; /* internal: tape and gradient records of each block of packets */
    size_t block_count, block_capacity;
    int tape_width, tape_height; /* rays of the forward pass that the tape holds; 0: none */
    const gradient_record **record_order; /* internal: gradient records sorted by Gaussian, */
    size_t record_order_capacity;
    uint32_t *record_first;               /* and where each Gaussian's begin */
    size_t record_first_capacity;
} trace_scene;

/**
 * Prepare `g` for tracing.
 *
 * @param g        [in] borrowed until the last pass over this build; padded (gaussians_pad)
 * @param reach    [in] largest |coordinate| of any ray origin that will be traced
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 * Gaussians with non-finite fields are not seen (scene->tree.rejected_count). Cost: 10-20 ms per 100,000 on two cores.
 */
gbt_status trace_build(trace_scene *scene, const gaussians *g, const trace_settings *settings, float reach, gbt_error *err);

/**
 * Trace rays.
 *
 * @param rgb            [out] 3 channels, size of `rays`, allocated by the caller; with the background
 * @param transmittance  [out] optional (NULL), [height * width]
 * @param keep_tape      [in]  true when trace_backward() will follow: keeps about 25 bytes per blended hit
 * @param counters       [in,out] optional, added to
 * Threads: uses all; same bits for every thread count.
 */
gbt_status trace_forward(trace_scene *scene, const ray_image *rays, bool keep_tape, image *rgb, float *transmittance, kernel_counters *counters,
                         gbt_error *err);

/**
 * Adjoint of the last trace_forward(keep_tape) on `scene`, with the same rays.
 *
 * @param d_rgb        [in]  dL/d(rgb), size of `rays`
 * @param d_gaussians  [out] resized like the source and overwritten: dL/dfield (scales linear, quaternion tangent)
 * @param weight       [out] optional (NULL), [count]: sum over rays of T alpha, how much each Gaussian was seen
 * @param d_background [out] optional (NULL), [3], overwritten
 * Threads: uses all; same bits for every thread count (sums run in the order of packets and blocks).
 */
gbt_status trace_backward(trace_scene *scene, const ray_image *rays, const image *d_rgb, gaussians *d_gaussians, float *weight,
                          float d_background[3], gbt_error *err);

void trace_scene_free(trace_scene *scene);

#endif
