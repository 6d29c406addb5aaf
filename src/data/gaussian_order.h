/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_order.h -- Gaussians in an order in which neighbours in the list are neighbours in space, and
   of a like size: what they have in common compresses. */
#ifndef GBT_DATA_GAUSSIAN_ORDER_H
#define GBT_DATA_GAUSSIAN_ORDER_H

#include <stdint.h>

#include "data/gaussian_cloud.h"

/**
 * Indices of all Gaussians: those within the median distance from the middle first, then those within twice
 * that, four times and so on; each shell in the order of Morton codes (Morton 1966), 21 bits an axis of its
 * box. So a sky far outside and what is near share no block of the list.
 *
 * @param cloud [in] at least one Gaussian
 * @return [cloud->count], free with mem_free(); NULL: no memory
 */
uint32_t *gaussian_order(const gaussian_cloud *cloud, gbt_error *err);

/** The median of at least one value; sorts them. */
float gaussian_median(float *values, size_t count);

#endif
