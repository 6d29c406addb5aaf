/* SPDX-License-Identifier: Apache-2.0 */
/* train/light.h -- do photos differ in exposure? Asked of the sparse points, whose colours are known before
   anything is trained. */
#ifndef GBT_TRAIN_LIGHT_H
#define GBT_TRAIN_LIGHT_H

#include "train/photos.h"

/** From here on a run learns exposures by itself: stops. Photos of one exposure come to 0.05 to 0.19, mostly
    by what hides points; the same times 0.5 to 2 to 0.6. */
#define LIGHT_SPREAD_MIN 0.25

/**
 * How far apart the exposures of photos are: the standard deviation over them of the median, over the sparse
 * points in view, of log2(photo / point). Points that others hide are among them; the median bears that.
 *
 * @param views [in]  [count]; of these, photos that are in memory
 * @param stops [out] 0 where fewer than two photos show 50 points, or points have no colours
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status light_spread(const photos *p, const size_t *views, size_t count, double *stops, gbt_error *err);

#endif
