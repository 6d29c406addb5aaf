/* SPDX-License-Identifier: Apache-2.0 */
/* frame/plain.h -- evaluate plain Gaussians for a camera (spherical harmonics to colours), and the
   adjoint. */
#ifndef GBT_FRAME_PLAIN_H
#define GBT_FRAME_PLAIN_H

#include <stdint.h>

#include "base/gaussians.h"
#include "data/gaussian_cloud.h"

/**
 * The visible Gaussians of a cloud, seen from `eye`: colour = max(0, 0.5 + sum sh_k Y_k(d)), d from the eye
 * to the mean; scale = exp(scale_log).
 *
 * @param visible [in]  [count] indices into the cloud, ascending
 * @param out     [out] resized to `count` and padded, in the order of `visible`
 * Threads: uses all; same bits for every thread count.
 */
gbt_status plain_forward(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible,
                         size_t count, gaussians *out, gbt_error *err);

/**
 * Adjoint of plain_forward(): dL/d(scale_log, quat, opacity, sh). Means are treated as fixed, so no gradient
 * of means is computed (plain_backward_view() has it).
 *
 * @param seen    [in]  output of plain_forward()
 * @param d_seen  [in]  [count] gradients of its fields
 * @param d_cloud [out] as many Gaussians as `cloud`; overwritten except `mean`, 0 for Gaussians that are not
 *                      visible; the gradient of quat is tangent to the unit quaternions
 */
void plain_backward(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible, size_t count,
                    const gaussians *seen, const gaussians *d_seen, gaussian_cloud *d_cloud);

#endif
