/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/surface_gaussians.h -- covers the surfaces of a world with many flat Gaussians, in a .ply of any
   size. */
#ifndef GBT_SCENES_SURFACE_GAUSSIANS_H
#define GBT_SCENES_SURFACE_GAUSSIANS_H

#include "scenes/world.h"

/**
 * Write `count` Gaussians to `path`, spread evenly over all triangles and in their order. They are flat, as
 * wide as their spacing, and have the colours seen from the front. The sky, which shines by itself, gets few
 * but large ones. Spherical harmonics have degree 3, so that the file is as large as that of as many trained
 * Gaussians; the coefficients above degree 0 are small and random.
 *
 * Memory: some megabytes. Threads: uses all; the same bytes for every thread count.
 */
gbt_status surface_gaussians_write(const world *w, const char *path, size_t count, uint64_t seed,
                                   gbt_error *err);

#endif
