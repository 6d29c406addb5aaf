/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors_variants.c -- the runs that the study "anchors" compares. */
#include "study/anchors.h"

/* THE table to edit: name, settings, series of the chart. The first three have their places. A new meaning
   needs a new name: the name is the folder of the runs. */
const anchors_variant anchors_variants[] = {
    {"voxels, final prune factor 1", "init = voxel\nfinal-prune-factor = 1", 1},
    {"the paper's balls", "", 2},
    {"adaptive balls", "init = adaptive", 3},
    {"random points", "init = random", 4},
    {"adaptive balls, threshold factor 1.5", "init = adaptive\nthreshold-factor = 1.5", 3},
    {"adaptive balls, threshold factor 2.5", "init = adaptive\nthreshold-factor = 2.5", 3},
    {"adaptive balls, threshold factor 0.5", "init = adaptive\nthreshold-factor = 0.5", 3},
    {"voxels", "init = voxel", 1},
};

const size_t anchors_variant_count = sizeof anchors_variants / sizeof *anchors_variants;

_Static_assert(sizeof anchors_variants / sizeof *anchors_variants <= ANCHORS_VARIANTS_MAX,
               "every variant has a place");
