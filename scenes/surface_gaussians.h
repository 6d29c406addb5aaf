/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/surface_gaussians.h -- the surfaces of a world as many flat Gaussians, in a .ply of any size. */
#ifndef GBT_SCENES_SURFACE_GAUSSIANS_H
#define GBT_SCENES_SURFACE_GAUSSIANS_H

#include "scenes/world.h"

/**
 * Write `count` Gaussians to `path`, spread evenly over all triangles, in the order of the triangles: flat,
 * as wide as they are far apart, in the colours that are seen from in front. What shines by itself, the sky,
 * gets few, but large ones. Harmonics have degree 3, so that the file is as large as one of that many
 * trained Gaussians; those above degree 0 are small and random.
 *
 * Memory: some megabytes. Threads: uses all; the same bytes for every thread count.
 */
gbt_status surface_gaussians_write(const world *w, const char *path, size_t count, uint64_t seed,
                                   gbt_error *err);

#endif
