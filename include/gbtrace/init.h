/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/init.h -- where a scene starts from: granular balls and anchors of a sparse cloud, beside the voxel
   baseline. */
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
    double init_count;  /* anchors per point of adaptive and random, [0, 1], at least one; 0: half as many as
                           the paper's balls. Default 0 */
    gbt_scale_prior scale_prior; /* of GBT_INIT_GB; the others use GBT_SCALE_PRIOR_NN. Default
                                    GBT_SCALE_PRIOR_GB */
    int max_depth;               /* D_max of the balls, [0, 64]. Default 18 */
    float voxel_size;            /* v, scene units, [0, 1e9]; 0: from the points by `voxel_rule`. Default 0 */
    gbt_voxel_rule voxel_rule;   /* default GBT_VOXEL_RULE_MEDIAN */
    bool mesh;                   /* an icosphere per ball in place of one vertex. Default false */
    uint32_t cookie_;            /* set by gbt_init_def_default() */
} gbt_init_def;

gbt_init_def gbt_init_def_default(void);

/**
 * Make balls and anchors from a data set's sparse points, write them as PLY, print their number beside the
 * voxel baseline's, and how far points are from the centres of the paper's balls, of adaptive ones, and of as
 * many voxels.
 *
 * The PLY opens in any mesh viewer. Points: a vertex per anchor with x y z, radius, scale_0..scale_5
 * (std-devs, not logs), count (points in its ball), depth, red green blue. Mesh: an icosphere of 42 vertices
 * and 80 triangles per anchor with the ball's radius (the scale when it has none) and colour. Coordinates are
 * the data set's own, as doubles (as floats with GBT_INIT_VOXEL).
 *
 * @param data      [in]  data set folder or point cloud (.ply)
 * @param out_ply   [in]  written atomically
 * @param json_path [in]  the counts as JSON with "schema": 1; NULL: none
 * @param report    [in]  open stream for the lines for a person
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, output is an input), GBT_ERR_FORMAT (bad data, no
 *         points), GBT_ERR_IO, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct outputs; same bytes for every thread count. Cost: O(n log n) for n points.
 */
gbt_status gbt_init(const char *data, const gbt_init_def *def, const char *out_ply, const char *json_path,
                    FILE *report, gbt_error *err);

GBT_API_END
#endif
