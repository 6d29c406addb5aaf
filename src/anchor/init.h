/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/init.h -- initial anchors at balls (GBAI), voxels or points, with initial scales from balls (GBSP)
   or from neighbours (Yang 2026, eqs 28-34). */
#ifndef GBT_ANCHOR_INIT_H
#define GBT_ANCHOR_INIT_H

#include "anchor/anchors.h"
#include "gb/balls.h"
#include "gbtrace/choices.h"

typedef struct anchor_init_def {
    gbt_init_kind kind;    /* default GBT_INIT_GB */
    gbt_scale_prior scale; /* default GBT_SCALE_PRIOR_GB, for GBT_INIT_GB alone: the others always use
                                GBT_SCALE_PRIOR_NN */
    uint64_t seed;         /* for GBT_INIT_RANDOM. Default 0 */
    double fraction;  /* anchors per point of GBT_INIT_ADAPTIVE and _RANDOM, [0, 1]; at least one anchor is
                         made; 0: half as many as GBT_INIT_GB makes. Default 0 */
    balls_def balls;  /* voxel_size must be set; it is also the voxel edge of GBT_INIT_VOXEL */
    int offset_count; /* K, default 10 */
    float fusion;     /* alpha, eq 34: weight of the neighbour scale. Default 0.5 */
    float clip_min, clip_max; /* lambda_min, lambda_max, eq 33: defaults 0.25 and 4 */
    float scale_factor;       /* multiplies the initial scales, > 0; larger Gaussians overlap more. Default
                                 1 */
    float scale_max; /* cap of the initial scales, scene units, because isolated points would get huge ones.
                        Default infinity */
} anchor_init_def;
anchor_init_def anchor_init_def_default(void);

/**
 * Make the initial anchors: offsets and features are 0, log-scales follow the scale rule.
 *
 * GBT_SCALE_PRIOR_NN: root mean square distance to the 3 nearest anchors (or as many as there are), with
 * floor ANCHOR_SPACING_LEAST(), for voxels with balls.min_radius > 0 sqrt(1e-7); a single anchor uses the
 * voxel size.
 * GBT_SCALE_PRIOR_GB: eqs 29-34 with the nearest anchor, with floor balls_least_radius(); an anchor that is
 * alone or coincides with another uses its ball's radius as the spacing. Then all scales are multiplied by
 * scale_factor; scale_max takes precedence over floors and factor. No points give no anchors.
 *
 * @param position  [in] [count][3], finite
 * @param color     [in] [count][3] in [0, 1], or NULL
 * @param out       [out] new anchors, free with anchors_free(); zeroed on failure
 * @param out_balls [out] optional (NULL): the balls behind the anchors, free with balls_free(); zeroed when
 *                        there are none
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, non-finite point), GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: the partition, building one tree over the anchors, and one
 * query per anchor.
 */
gbt_status anchors_init(const float *position, const float *color, size_t count, const anchor_init_def *def,
                        anchors *out, balls *out_balls, gbt_error *err);

/**
 * Initial scales of anchors at these positions by GBT_SCALE_PRIOR_NN. A single anchor has spacing 0 and
 * therefore gets the floor.
 *
 * @param position [in]  [count][3], finite
 * @param least    [in]  floor of the spacing, > 0
 * @param factor   [in]  > 0; `most` takes precedence
 * @param out      [out] [count], > 0
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 * Cost: one tree, and one query per anchor.
 */
gbt_status anchor_scales_from_spacing(const float *position, size_t count, double least, double factor,
                                      double most, float *out, gbt_error *err);

/** Floor of the spacing, which coincident points get. It is a fraction of the voxel size, so that it does not
    depend on the unit of length; the baseline of the paper uses sqrt(1e-7) in the data's unit. */
#define ANCHOR_SPACING_LEAST(voxel_size) ((double)(voxel_size) / 64)

#endif
