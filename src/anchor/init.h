/* anchor/init.h -- where anchors come from: balls (GBAI) or voxels, with a scale from balls (GBSP) or from neighbours. */
#ifndef GBT_ANCHOR_INIT_H
#define GBT_ANCHOR_INIT_H

#include "anchor/anchors.h"
#include "gb/balls.h"

typedef enum anchor_init_kind { ANCHOR_INIT_GB, ANCHOR_INIT_VOXEL } anchor_init_kind;
typedef enum anchor_scale_kind { ANCHOR_SCALE_GB, ANCHOR_SCALE_NN } anchor_scale_kind;

typedef struct anchor_init_def {
    anchor_init_kind kind;        /* default ANCHOR_INIT_GB */
    anchor_scale_kind scale;      /* default ANCHOR_SCALE_GB; voxels always use ANCHOR_SCALE_NN */
    balls_def balls;              /* voxel_size must be set; also the voxel edge of ANCHOR_INIT_VOXEL */
    int offset_count;             /* K, default 10 */
    float fusion;                 /* alpha, eq 34: weight of the neighbour scale. Default 0.5 */
    float clip_min, clip_max;     /* lambda_min, lambda_max, eq 33: defaults 0.25 and 4 */
    float scale_max;              /* largest initial scale, scene units; isolated points would get huge ones. Default infinity */
} anchor_init_def;
anchor_init_def anchor_init_def_default(void);

/**
 * Make anchors: offsets and features 0, log-scales from the scale rule.
 *
 * ANCHOR_SCALE_NN: root mean square distance to the 3 nearest anchors, floor sqrt(1e-7). ANCHOR_SCALE_GB: eqs 29-34 with the nearest
 * distinct anchor. Fewer than 4 anchors, coincident anchors and a lone anchor have defined results (docs/balls.md).
 *
 * @param out_balls [out] optional (NULL): the balls behind the anchors, free with balls_free(); zeroed for voxels
 */
gbt_status anchors_init(const float *position, const float *color, size_t count, const anchor_init_def *def, anchors *out, balls *out_balls,
                        gbt_error *err);

#endif
