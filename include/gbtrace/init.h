/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/init.h -- the initial anchors of a scene: granular balls of a sparse point cloud, compared with the
   voxel baseline. */
#ifndef GBTRACE_INIT_H
#define GBTRACE_INIT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_init_def {
    gbt_init_kind init; /* default GBT_INIT_GB */
    double init_count;  /* anchors per point of GBT_INIT_ADAPTIVE and _RANDOM, [0, 1]; at least one anchor is
                           made; 0: half as many anchors as the paper's balls. Default 0 */
    gbt_scale_prior scale_prior; /* for GBT_INIT_GB only; the others use GBT_SCALE_PRIOR_NN. Default
                                    GBT_SCALE_PRIOR_GB */
    int max_depth;               /* D_max of the balls, [0, 64]. Default 18 */
    float voxel_size;            /* v, scene units, [0, 1e9]; 0: estimated from the points by `voxel_rule`.
                                    Default 0 */
    gbt_voxel_rule voxel_rule;   /* default GBT_VOXEL_RULE_MEDIAN */
    bool mesh;                   /* write an icosphere per ball instead of one vertex. Default false */
    uint32_t cookie_;            /* set by gbt_init_def_default() */
} gbt_init_def;

gbt_init_def gbt_init_def_default(void);

/**
 * Make balls and anchors from a data set's sparse points and write them as PLY. Print their number next to
 * that of the voxel baseline, and the distances from the points to the centres of the paper's balls, of
 * adaptive balls, and of an equal number of voxels.
 *
 * The PLY opens in any mesh viewer. Without `mesh`: one vertex per anchor with x y z, radius,
 * scale_0..scale_5 (std-devs, not logs), count (points in its ball), depth, red green blue. With `mesh`: an
 * icosphere of 42 vertices and 80 triangles per anchor, with the ball's radius (without a ball, the anchor's
 * scale) and colour. Coordinates are the data set's own, as doubles (as floats with GBT_INIT_VOXEL).
 *
 * @param data      [in]  data set folder or point cloud (.ply)
 * @param out_ply   [in]  written atomically
 * @param json_path [in]  file for the counts as JSON with "schema": 1; NULL: none
 * @param report    [in]  open stream for the counts as text; NULL: none
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, output is an input), GBT_ERR_FORMAT (bad data, no
 *         points), GBT_ERR_IO, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct outputs; same bytes for every thread count. Cost: O(n log n) for n points.
 */
gbt_status gbt_init(const char *data, const gbt_init_def *def, const char *out_ply, const char *json_path,
                    FILE *report, gbt_error *err);

GBT_API_END
#endif
