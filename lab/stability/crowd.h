/* SPDX-License-Identifier: Apache-2.0 */
/* stability/crowd.h -- a scene with many overlapping Gaussians, and the rays on which rounding may be
   visible. */
#ifndef GBT_STABILITY_CROWD_H
#define GBT_STABILITY_CROWD_H

#include "stability/stability.h"

/** The Gaussians of the scene file, followed by "more_gaussians" random ones in front of the origin (seed:
    "seed"). */
void stability_crowd(stability *s, gaussians *g);

/**
 * Find the rays from the origin on which rounding may change the picture visibly: two depths agree to 2e-6,
 * or an alpha or T is within 1e-5 of its cut-off.
 *
 * @param dirs    [in]  [ray_count][3]
 * @param on_edge [out] [ray_count]
 * @return how many
 */
size_t stability_find_edges(stability *s, const gaussians *g, const float *dirs, size_t ray_count,
                            bool *on_edge);

#endif
