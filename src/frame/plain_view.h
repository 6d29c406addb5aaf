/* SPDX-License-Identifier: Apache-2.0 */
/* frame/plain_view.h -- derivatives of the colours of plain Gaussians with respect to means and eye. */
#ifndef GBT_FRAME_PLAIN_VIEW_H
#define GBT_FRAME_PLAIN_VIEW_H

#include <stdint.h>

#include "base/gaussians.h"
#include "data/gaussian_cloud.h"

/**
 * The part of the adjoint of plain_forward() (frame/plain.h) that goes through the direction d = (mu - eye) /
 * r: dd/dmu = (1 - d d^T) / r = -dd/deye.
 *
 * @param visible, count [in]  arguments of plain_forward()
 * @param seen           [in]  its output
 * @param d_seen         [in]  [count] gradients of its fields
 * @param d_mean         [out] optional (NULL), [cloud->count][3], overwritten: total dL/dmean, including the
 *         part in d_seen; 0 for Gaussians that are not visible
 * @param d_eye          [out] dL/deye
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status plain_backward_view(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible,
                               size_t count, const gaussians *seen, const gaussians *d_seen, float *d_mean,
                               double d_eye[3], gbt_error *err);

#endif
