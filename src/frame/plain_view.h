/* SPDX-License-Identifier: Apache-2.0 */
/* frame/plain_view.h -- what the colours of plain Gaussians owe to where they are seen from. */
#ifndef GBT_FRAME_PLAIN_VIEW_H
#define GBT_FRAME_PLAIN_VIEW_H

#include <stdint.h>

#include "base/gaussians.h"
#include "data/gaussian_cloud.h"

/**
 * The part of the adjoint of plain_forward() (frame/plain.h) that goes through the direction d = (mu - eye) /
 * r: dd/dmu = (1 - d d^T) / r = -dd/deye.
 *
 * @param visible, count [in]  as given to plain_forward()
 * @param seen           [in]  what it gave
 * @param d_seen         [in]  [count] dL of its fields
 * @param d_mean         [out] optional (NULL), [cloud->count][3], overwritten: dL/dmean, with that of d_seen;
 *         0 where nothing is visible
 * @param d_eye          [out] dL/deye
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status plain_backward_view(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible,
                               size_t count, const gaussians *seen, const gaussians *d_seen, float *d_mean,
                               double d_eye[3], gbt_error *err);

#endif
