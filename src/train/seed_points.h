/* train/seed_points.h -- a starting cloud for data sets that have no sparse points: places where the photos agree on a colour. */
#ifndef GBT_TRAIN_SEED_POINTS_H
#define GBT_TRAIN_SEED_POINTS_H

#include "train/photos.h"

/**
 * Make points by photo consistency.
 *
 * Candidates are drawn along random pixels' rays, at depths around the point where the cameras' axes meet; each is projected into the
 * other photos (at 1/8 size), and those whose colour varies least among the views that see them are kept.
 *
 * @param source [in]  opened at the training resolution; left at its coarsest level in use
 * @param out    [in,out] scene_points without points; filled
 * Deterministic for a seed; parallel.
 */
gbt_status seed_points_make(photos *source, const size_t *views, size_t view_count, uint64_t seed, scene_points *out, gbt_error *err);

#endif
