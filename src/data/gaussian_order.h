/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_order.h -- a spatial order of Gaussians: neighbours in the list are close in space, so that
   blocks of the list have a small extent and compress well. */
#ifndef GBT_DATA_GAUSSIAN_ORDER_H
#define GBT_DATA_GAUSSIAN_ORDER_H

#include <stdint.h>

#include "data/gaussian_cloud.h"

/**
 * Indices of all Gaussians in spatial order. The distance is the largest coordinate difference to the centre
 * (the median of the means). Gaussians within the median distance come first, then those within two, four,
 * ... times that; each shell is sorted by Morton code (Morton 1966) with 21 bits per axis of its box. A
 * distant sky thus does not share a block with nearby objects.
 *
 * @param cloud [in] at least one Gaussian
 * @return [cloud->count], free with mem_free(); NULL: no memory
 */
uint32_t *gaussian_order(const gaussian_cloud *cloud, gbt_error *err);

/** The median (the upper one, if the count is even) of at least one value; sorts the values. */
float gaussian_median(float *values, size_t count);

#endif
