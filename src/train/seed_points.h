/* SPDX-License-Identifier: Apache-2.0 */
/* train/seed_points.h -- a starting cloud for data sets with no or too few sparse points: places where the
   photos agree. */
#ifndef GBT_TRAIN_SEED_POINTS_H
#define GBT_TRAIN_SEED_POINTS_H

#include "train/photos.h"

/**
 * Make points by plane sweep (Collins 1996).
 *
 * Random pixels of the photos (halved until 400 pixels long) are swept through 96 depths around the point
 * where the cameras' axes meet; a depth counts by the normalised correlation of 5 x 5 pixels with up to four
 * neighbouring photos, the better half of them. Pixels whose best depth is good and beats all others become
 * points; with few of these, the next best up to 1,000.
 *
 * @param source [in]  opened at the training resolution; left at its coarsest level in use
 * @param out    [in,out] scene_points without points; filled
 * Deterministic for a seed; parallel.
 */
gbt_status seed_points_make(photos *source, const size_t *views, size_t view_count, uint64_t seed,
                            scene_points *out, gbt_error *err);

#endif
