/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure_spread.h -- do the photos differ in exposure? Measured at the sparse points, whose colours
   are known before training. */
#ifndef GBT_TRAIN_EXPOSURE_SPREAD_H
#define GBT_TRAIN_EXPOSURE_SPREAD_H

#include "train/photos.h"

/** Standard deviations, in stops, above which a run learns exposures on its own. With tracks, photos of equal
    exposure measure 0.001 (0.03 for photos of 48 x 36 pixels), and cameras whose automatic exposure varies a
    little 0.06. Without tracks, photos of equal exposure measure 0.05 to 0.19, because hidden points are
    compared, too. */
#define EXPOSURE_SPREAD_BY_TRACKS 0.1
#define EXPOSURE_SPREAD_WITHOUT 0.25

/** Spread of the exposures of photos. */
typedef struct exposure_spread {
    double stops; /* standard deviation; 0 when fewer than two photos show 50 points, or when points have no
                     colours */
    bool large;   /* more than EXPOSURE_SPREAD_BY_TRACKS, or EXPOSURE_SPREAD_WITHOUT */
} exposure_spread;

/**
 * The standard deviation over photos of the median over sparse points of log2(photo / point). The points of a
 * photo are those whose tracks name it; without tracks, all points in view, including hidden ones.
 *
 * @param views [in] [count]; their photos are read one after the other if they are not in memory
 * @return GBT_OK, GBT_ERR_NO_MEMORY, or why a photo cannot be read
 */
gbt_status exposure_spread_find(photos *p, const size_t *views, size_t count, exposure_spread *out,
                                gbt_error *err);

#endif
