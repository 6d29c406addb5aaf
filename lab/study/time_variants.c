/* SPDX-License-Identifier: Apache-2.0 */
/* study/time_variants.c -- the runs that the study "time" compares: THE table to edit. */
#include "study/time.h"

/* One row per run: its name, its differences from the default settings (one per line, with the keys that
   `gbtrace train` writes to RUN/config), and its training time in budgets. The first two rows are fixed; any
   others may be added or removed. If a row changes its meaning it needs a new name, because the name is the
   folder of its runs. */
const time_variant time_variants[] = {
    {"default", "", 1},
    {"faithful protocol, splats", "compat = 1\nrenderer = raster", 5},
    {"all pixels", "step-pixels = 0", 1},
    {"splats first", "splats-until = 0.7", 1},
    {"first scales x 1", "scale-factor = 1", 1},
    {"no growth", "grow = 0", 1},
    {"final prune factor 1", "final-prune-factor = 1", 1},
    {"near 0", "near = 0", 1},
    {"K = 10", "offsets = 10", 1},
    {"adaptive balls", "init = adaptive", 1},
    {"voxels", "init = voxel", 1},
    {"voxels, final prune factor 1", "init = voxel\nfinal-prune-factor = 1", 1},
};

const size_t time_variant_count = sizeof time_variants / sizeof *time_variants;

_Static_assert(sizeof time_variants / sizeof *time_variants <= TIME_VARIANTS_MAX,
               "every variant has a place");
