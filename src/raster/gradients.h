/* SPDX-License-Identifier: Apache-2.0 */
/* raster/gradients.h -- from the sums of the tiles to the gradients of a Gaussian's fields. */
#ifndef GBT_RASTER_GRADIENTS_H
#define GBT_RASTER_GRADIENTS_H

#include "raster/order.h"

/**
 * Sum the records of every splat in the order of its tiles, and follow the chain back to mean, scale,
 * rotation, opacity and colour.
 *
 * @param drawn   [in]  splats in each block, see tile_lists_make()
 * @param records [in]  [pairs][sums], see kernel.h
 * @param out     [out] resized like `g` and overwritten: dL/dfield (scales linear, quaternion tangent)
 * @param weight  [out] optional (NULL), [g->count]: sum over pixels of T alpha
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status raster_gradients(const raster_view *view, const gaussians *g, const splat *splats,
                            const size_t *drawn, const tile_lists *lists, const float *records,
                            gaussians *out, float *weight, gbt_error *err);

#endif
