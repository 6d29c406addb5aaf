/* SPDX-License-Identifier: Apache-2.0 */
/* command/init_quality.h -- compare how well centres represent a cloud: the paper's balls, adaptive balls,
   and voxels. */
#ifndef GBT_COMMAND_INIT_QUALITY_H
#define GBT_COMMAND_INIT_QUALITY_H

#include "data/scene.h"

enum { INIT_QUALITY_ROWS = 3 };

typedef struct init_quality {
    const char *name; /* "gb", "adaptive", "voxel" */
    size_t anchors;
    double distance; /* RMS distance from a point to its nearest centre, scene units */
    double color; /* RMS difference per channel between a point's colour and the mean of the points that share
                     its centre */
} init_quality;

/**
 * Measure the paper's balls, adaptive balls, and the finest voxel grid that has no more voxels than there are
 * adaptive balls.
 *
 * @param points   [in] at least one
 * @param fraction [in] adaptive balls per point, 0: half of the paper's; as in anchor_init_def
 * @param out      [out] [INIT_QUALITY_ROWS]
 * @return GBT_OK, GBT_ERR_ARGUMENT (setting out of range), GBT_ERR_NO_MEMORY
 *
 * Threads: same bits for every thread count. Cost: the partitions, about forty voxel grids, and a
 * nearest-centre query per point and row.
 */
gbt_status init_quality_measure(const scene_points *points, float voxel_size, int max_depth, double fraction,
                                init_quality *out, gbt_error *err);

#endif
