/* SPDX-License-Identifier: Apache-2.0 */
/* train/seed_points.h -- a starting cloud for data sets with no or too few sparse points: places where the
   photos agree. */
#ifndef GBT_TRAIN_SEED_POINTS_H
#define GBT_TRAIN_SEED_POINTS_H

#include "train/photos.h"

enum {
    SEED_FEW_PLACES = 128, /* points of a data set at fewer different places are too few */
    SEED_VIEWS_LEAST = 3,  /* photos: a place counts that two others agree on */
    SEED_VIEWS_MOST = 512, /* photos that are looked at; of more, so many at even distances in their list */
    SEED_LONG_SIDE = 400   /* photos are halved until they are no longer than this */
};

/** Bytes of a pixel of such a photo while points are made. */
#define SEED_PIXEL_BYTES (4 * sizeof(float))

/**
 * Make points by plane sweep (Collins 1996).
 *
 * Random pixels of the photos (SEED_VIEWS_MOST, SEED_LONG_SIDE) are swept through 96 depths around the point
 * where the cameras' axes meet; where these are nearly parallel, or meet behind the cameras, around the
 * distance at which most places of 2,000 pixels agree, with a warning if few do. A depth counts by the
 * normalised correlation of 5 x 5 pixels with up to four neighbouring photos, the better half of them. Pixels
 * whose best depth is good and beats all others become points; with few of these, the next best up to 1,000.
 * Pixels that do not count (photos_get()) are in none of the 5 x 5.
 *
 * @param source [in]  opened at the training resolution
 * @param out    [in,out] scene_points without points; filled
 * @return GBT_OK, GBT_ERR_FORMAT (fewer views than SEED_VIEWS_LEAST, or they agree nowhere), GBT_ERR_IO,
 *         GBT_ERR_NO_MEMORY
 * Deterministic for a seed; parallel.
 */
gbt_status seed_points_make(photos *source, const size_t *views, size_t view_count, uint64_t seed,
                            scene_points *out, gbt_error *err);

#endif
