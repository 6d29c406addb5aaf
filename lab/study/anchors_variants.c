/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors_variants.c -- the runs that the study "anchors" compares. */
#include "study/anchors.h"

/* THE table to edit: name, settings. The order of the first three is fixed. If a variant changes its meaning
   it needs a new name, because the name is the folder of its runs. */
const anchors_variant anchors_variants[] = {
    {"voxels, final prune factor 1", "init = voxel\nfinal-prune-factor = 1"},
    {"the paper's balls", ""},
    {"adaptive balls", "init = adaptive"},
    {"random points", "init = random"},
    {"adaptive balls, threshold factor 1.5", "init = adaptive\nthreshold-factor = 1.5"},
    {"adaptive balls, threshold factor 2.5", "init = adaptive\nthreshold-factor = 2.5"},
    {"adaptive balls, threshold factor 0.5", "init = adaptive\nthreshold-factor = 0.5"},
    {"voxels", "init = voxel"},
};

const size_t anchors_variant_count = sizeof anchors_variants / sizeof *anchors_variants;
