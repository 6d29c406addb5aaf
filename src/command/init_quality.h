/* SPDX-License-Identifier: Apache-2.0 */
/* command/init_quality.h -- how well so many centres stand for a cloud: the paper's balls, adaptive ones and
   voxels side by side. */
#ifndef GBT_COMMAND_INIT_QUALITY_H
#define GBT_COMMAND_INIT_QUALITY_H

#include "data/scene.h"

enum { INIT_QUALITY_ROWS = 3 };

typedef struct init_quality {
    const char *name; /* "gb", "adaptive", "voxel" */
    size_t anchors;
    double distance; /* root mean square from a point to its nearest centre, scene units */
    double color; /* root mean square from its colour to the mean of those that share the centre, per channel
                   */
} init_quality;

/**
 * Measure the paper's balls, adaptive ones, and the finest voxels that are no more than the adaptive balls.
 *
 * @param points   [in] at least one
 * @param fraction [in] adaptive balls per point, 0: half of the paper's; as in anchor_init_def
 * @param out      [out] [INIT_QUALITY_ROWS]
 * @return GBT_OK, GBT_ERR_ARGUMENT (setting out of range), GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: the partitions, some forty voxel grids, a nearest-centre
 * query per point and row.
 */
gbt_status init_quality_measure(const scene_points *points, float voxel_size, int max_depth, double fraction,
                                init_quality *out, gbt_error *err);

#endif
