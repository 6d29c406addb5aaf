/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/init.h -- where anchors come from: balls (GBAI), voxels or points, with a scale from balls (GBSP) or
   from neighbours (Yang 2026, eqs 28-34). */
#ifndef GBT_ANCHOR_INIT_H
#define GBT_ANCHOR_INIT_H

#include <stdbool.h>

#include "anchor/anchors.h"
#include "gb/adaptive.h"
#include "gb/balls.h"
#include "gbtrace/choices.h"

typedef struct anchor_init_def {
    gbt_init_kind kind;    /* default GBT_INIT_GB */
    gbt_scale_prior scale; /* default GBT_SCALE_PRIOR_GB, for GBT_INIT_GB alone: the others always use
                                GBT_SCALE_PRIOR_NN */
    uint64_t seed;         /* of GBT_INIT_RANDOM. Default 0 */
    double fraction;  /* anchors per point of GBT_INIT_ADAPTIVE and _RANDOM, [0, 1], at least one; 0: half
                         as many as GBT_INIT_GB makes. Default 0 */
    balls_def balls;  /* voxel_size must be set; also the voxel edge of GBT_INIT_VOXEL */
    int offset_count; /* K, default 10 */
    float fusion;     /* alpha, eq 34: weight of the neighbour scale. Default 0.5 */
    float clip_min, clip_max; /* lambda_min, lambda_max, eq 33: defaults 0.25 and 4 */
    float scale_factor;       /* of the first scales, > 0: wider ones overlap. Default 1 */
    float scale_max; /* largest initial scale, scene units; isolated points would get huge ones. Default
                        infinity */
} anchor_init_def;
anchor_init_def anchor_init_def_default(void);

/**
 * Make anchors: offsets and features 0, log-scales from the scale rule.
 *
 * GBT_SCALE_PRIOR_NN: root mean square distance to the 3 nearest anchors (or as many as there are), floor
 * ANCHOR_SPACING_LEAST(), of voxels sqrt(1e-7); a lone anchor takes the voxel size. GBT_SCALE_PRIOR_GB: eqs
 * 29-34 with the nearest anchor, floor balls_least_radius(); an anchor that is alone or coincides with
 * another takes its ball's radius for the spacing. Then all are multiplied by scale_factor; scale_max wins
 * over floors and factor. No points give no anchors.
 *
 * @param position  [in] [count][3], finite
 * @param color     [in] [count][3] in [0, 1], or NULL
 * @param out       [out] new anchors, free with anchors_free(); zeroed on failure
 * @param out_balls [out] optional (NULL): the balls behind the anchors, free with balls_free(); zeroed when
 *                        there are none
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, non-finite point), GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: the partition, one tree over the anchors and one query
 * each.
 */
gbt_status anchors_init(const float *position, const float *color, size_t count, const anchor_init_def *def,
                        anchors *out, balls *out_balls, gbt_error *err);

/**
 * First scales of anchors at these positions by GBT_SCALE_PRIOR_NN; one that is alone has no spacing: 0, and
 * so the floor.
 *
 * @param position [in]  [count][3], finite
 * @param least    [in]  of the spacing, > 0
 * @param factor   [in]  > 0; `most` wins over it
 * @param out      [out] [count], > 0
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 * Cost: one tree and one query each.
 */
gbt_status anchor_scales_from_spacing(const float *position, size_t count, double least, double factor,
                                      double most, float *out, gbt_error *err);

/** The least spacing, which also stands for points in one place: a part of the voxel size, so that no unit of
    length is meant. The baseline has sqrt(1e-7) of the data's own. */
#define ANCHOR_SPACING_LEAST(voxel_size) ((double)(voxel_size) / 64)

#endif
