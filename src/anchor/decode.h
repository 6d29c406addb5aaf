/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode.h -- decode anchors into Gaussians for a camera centre, and the adjoint (Lu 2024; Yang 2026,
   eqs 13-15; docs/training.md). */
#ifndef GBT_ANCHOR_DECODE_H
#define GBT_ANCHOR_DECODE_H

#include "anchor/anchors.h"
#include "base/gaussians.h"

/** Values that a forward decode keeps for its adjoint, and scratch memory. Start from {0}; reuse it from view
    to view; free with decode_tape_free(). */
typedef struct decode_tape {
    size_t visible_count, capacity;
    const uint32_t *visible; /* borrowed from decode_forward() until decode_backward() returns */
    float *alpha;            /* internal: opacities of all Gaussians of the visible anchors, kept or not */
    uint32_t *place;  /* internal: indices into `visible` of the anchors that have Gaussians, grouped by
                         chunk */
    uint32_t *filled; /* internal: number of such anchors in each chunk */
    float camera[3];  /* internal: the camera's centre */
    float *view;      /* internal: direction and distance (or 0) of each visible anchor */
    float *output;    /* internal: activations of the kept Gaussians, one array of `output_stride` floats per
                         field */
    size_t output_stride;
    size_t kept_count;
    size_t *first; /* internal: first kept Gaussian of each chunk */
    size_t first_capacity, filled_capacity, place_capacity;
    float *weights; /* internal: network weights in the layout of the kernels */
    size_t weight_capacity;
    size_t block_capacity; /* floats */
    float *block_grad;     /* internal: one decoder gradient per block, summed in block order */
    uint32_t *slot; /* [gaussian count]: the slot of each Gaussian, (index into `visible`) * K + offset,
                       ascending */
    size_t slot_capacity;
    float *opacity_sum; /* [visible_count]: sum over offsets of max(alpha, 0): see GROWTH_BY_OPACITY */
} decode_tape;

/**
 * Decode the visible anchors for one camera centre.
 *
 * Input of the networks: feature, unit direction from the camera to the anchor ((0, 0, 1) for a camera on the
 * anchor), distance if the decoder has it. Gaussian k of anchor i: opacity = alpha = tanh(.), mean = x +
 * offset exp(l[0..2]), scale = exp(l[3..5]) sigmoid(c[0..2]), quaternion = c[3..6] normalised, colour =
 * sigmoid(.). Log-scales are clamped to [-30, 30], with gradient 0 beyond. Arguments are clamped to [-30, 30]
 * in sigmoid and to [-10, 10] in tanh, where the derivatives, computed from the values, are almost 0. A scale
 * below 1e-4 of the Gaussian's largest scale is raised to that; its gradient then goes to the largest scale.
 * A Gaussian is kept iff alpha > `opacity_min` (0 = the reference's rule); kept Gaussians are packed in the
 * order of (index into `visible`, offset).
 *
 * @param visible [in] [visible_count] anchor indices, ascending; borrowed until decode_backward()
 * @param out     [out] resized and padded; out->count kept Gaussians; all finite for finite parameters
 * @return GBT_OK, GBT_ERR_ARGUMENT (K of anchors and decoder differ, `visible` not ascending or out of
 *         range), GBT_ERR_NO_MEMORY
 * Threads: same bits for every thread count. Cost (K = 10): 1440 multiply-adds per visible anchor, and 5440
 * more for each that has Gaussians.
 */
gbt_status decode_forward(const anchors *a, const decoder *d, const float camera_center[3],
                          const uint32_t *visible, size_t visible_count, float opacity_min, gaussians *out,
                          decode_tape *tape, gbt_error *err);

/**
 * Adjoint of the last decode_forward() on `tape`: adds dL/d(parameters).
 *
 * @param a, d [in] the arguments of decode_forward(), unchanged: hidden layers are recomputed from them
 * @param d_gaussians [in]  gradients in the order of the forward's `out`; quat_* is dL/d(unit quaternion),
 *                          whose component along q is ignored
 * @param d_anchors   [out] same shape as `a` (position unused); rows in `visible` are added to. Or, with
 * d_anchors->count == visible_count, only these rows, in their order
 * @param d_params    [out] [d->param_count], added to
 * @return GBT_OK, GBT_ERR_ARGUMENT (shapes differ from the forward's), GBT_ERR_NO_MEMORY; after a failure
 *         nothing was added
 * Threads: same bits for every thread count (per-block sums in block order).
 */
gbt_status decode_backward(const anchors *a, const decoder *d, decode_tape *tape,
                           const gaussians *d_gaussians, anchors *d_anchors, float *d_params, gbt_error *err);

/**
 * Adjoint with respect to the camera: dL/d(camera_center) at fixed means. Shapes, opacities and colours
 * depend on the direction u = (x - c) / r and the distance r of each anchor x, with du/dc = -(1 - u u^T) / r
 * and dr/dc = -u. A clamped distance has derivative 0.
 *
 * @param d_camera [out] overwritten
 * @return GBT_OK, GBT_ERR_ARGUMENT (shapes differ from the forward's), GBT_ERR_NO_MEMORY
 * Threads: same bits for every thread count. Cost: about half of decode_backward().
 */
gbt_status decode_backward_camera(const anchors *a, const decoder *d, decode_tape *tape,
                                  const gaussians *d_gaussians, double d_camera[3], gbt_error *err);

/**
 * Raise output biases of the opacity network: each offset whose mean opacity over the anchors of the last
 * decode_forward() is below `least` gets a mean of about `opacity`; the others stay.
 *
 * A Gaussian with opacity below 0 is not made and has no gradient, so training cannot bring it back.
 * @param opacity [in] (-1, 1)
 */
void decode_raise_opacity(const decode_tape *tape, float least, float opacity, decoder *d);

void decode_tape_free(decode_tape *tape);

#endif
