/* SPDX-License-Identifier: Apache-2.0 */
/* stability/crowd.h -- a scene where much overlaps, and the rays of it on which a last bit may show. */
#ifndef GBT_STABILITY_CROWD_H
#define GBT_STABILITY_CROWD_H

#include "stability/draw.h"

/** The Gaussians of the scene file, then as many as its number "more_gaussians" says, random ones of "seed"
    in front of the origin. */
void stability_crowd(stability *s, gaussians *g);

/**
 * Rays from the origin on which two depths agree to 2e-6, or an alpha or T lies within 1e-5 of its cut: there
 * a picture has an edge.
 *
 * @param dirs    [in]  [ray_count][3]
 * @param on_edge [out] [ray_count]
 * @return how many
 */
size_t stability_find_edges(stability *s, const gaussians *g, const float *dirs, size_t ray_count,
                            bool *on_edge);

#endif
