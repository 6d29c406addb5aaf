/* SPDX-License-Identifier: Apache-2.0 */
/* train/seed_points.h -- a starting cloud for data sets with no or too few sparse points: made where photos
   are consistent with each other (multi-view stereo). */
#ifndef GBT_TRAIN_SEED_POINTS_H
#define GBT_TRAIN_SEED_POINTS_H

#include "train/photos.h"

enum {
    SEED_FEW_PLACES = 128, /* a data set with points at fewer distinct positions has too few */
    SEED_VIEWS_LEAST = 3,  /* photos: a point must match in two others */
    SEED_VIEWS_MOST = 512, /* photos that are used; if there are more, this many, evenly spaced in their
                              list */
    SEED_LONG_SIDE = 400   /* photos are halved until their longer side is at most this */
};

/** Bytes per pixel of these reduced photos while points are made. */
#define SEED_PIXEL_BYTES (4 * sizeof(float))

/**
 * Make points by plane sweep (Collins 1996).
 *
 * Random pixels of the photos (SEED_VIEWS_MOST, SEED_LONG_SIDE) are swept through 96 depths around the point
 * where the cameras' axes meet; where these are nearly parallel, or meet behind the cameras, around the
 * distance at which most of 2,000 pixels find a match, with a warning if few do. The score of a depth is the
 * mean normalised correlation of 5 x 5 pixels with the better half of up to four neighbouring photos. Pixels
 * whose best depth has a high score, clearly above all others, become points; if these are few, the next best
 * are added, up to 1,000 points. Patches with invalid pixels (photos_get()) are not used.
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
