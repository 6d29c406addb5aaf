/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure_spread.h -- do photos differ in exposure? Asked of the sparse points, whose colours are
   known before anything is trained. */
#ifndef GBT_TRAIN_EXPOSURE_SPREAD_H
#define GBT_TRAIN_EXPOSURE_SPREAD_H

#include "train/photos.h"

/** From here on a run learns exposures by itself: stops. By tracks, photos of one exposure come to 0.001 (of
   48 x 36 pixels to 0.03), and those of cameras that follow the light a little to 0.06. Without tracks photos
   of one exposure come to 0.05 to 0.19, by what hides points. */
#define EXPOSURE_SPREAD_BY_TRACKS 0.1
#define EXPOSURE_SPREAD_WITHOUT 0.25

/** How far apart the exposures of photos are. */
typedef struct exposure_spread {
    double stops; /* 0 where fewer than two photos show 50 points, or points have no colours */
    bool large;   /* more than EXPOSURE_SPREAD_BY_TRACKS, or EXPOSURE_SPREAD_WITHOUT */
} exposure_spread;

/**
 * The standard deviation over photos of the median, over the sparse points in each, of log2(photo / point).
 * These points are those whose tracks name the photo; where no tracks are known, all in view, some of them
 * hidden.
 *
 * @param views [in] [count]; photos of these that are not in memory are read, one after the other
 * @return GBT_OK, GBT_ERR_NO_MEMORY, or why a photo cannot be read
 */
gbt_status exposure_spread_find(photos *p, const size_t *views, size_t count, exposure_spread *out,
                                gbt_error *err);

#endif
