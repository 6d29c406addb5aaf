/* SPDX-License-Identifier: Apache-2.0 */
/* frame/visible.h -- find the parts of a subject (anchors or Gaussians) that rays of a view may hit. */
#ifndef GBT_FRAME_VISIBLE_H
#define GBT_FRAME_VISIBLE_H

#include <math.h>

#include "frame/screen.h"
#include "frame/subject.h"
#include "trace/rays.h"

enum { VIEW_PLANES = 5 };

/** All rays start in a ball around `center` and point into a cone around `axis`. When all look forward,
    everything they hit is also on the inner side of planes: if n.d <= 0 for every direction d, n.x along the
    rays is never larger than at their origins. */
typedef struct view_bounds {
    float center[3], origin_radius;
    float axis[3], cos_angle, sin_angle;
    int plane_count;
    float plane[VIEW_PLANES][3]; /* unit normals pointing outwards: a visible ball has n.(x - center) <=
                                    offset + radius */
    float offset[VIEW_PLANES];
} view_bounds;

/** No bounds: everything is visible. */
static inline view_bounds view_bounds_none(void)
{
    return (view_bounds){.origin_radius = (float)HUGE_VAL, .cos_angle = -1}; /* no planes, and ray origins
                                                                                anywhere */
}

/**
 * Bounds on the rays of all samples of a shot.
 *
 * @param rays [in] those through the middle of the aperture. Another point of the aperture shifts an origin
 *                  by at most its radius R, and with the focus at F a slope by at most R / F and a direction
 *                  by at most asin(R / F). With ray_shot.one_start the true origins are at most half of the
 *                  camera's path away
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status view_bounds_find(const ray_shot *shot, const ray_image *rays, view_bounds *out, gbt_error *err);

/** How far a Gaussian reaches: `sigmas` std-devs of itself, plus as many of the pixel when rays have a width
    (trace/footprint.h). */
typedef struct visible_reach {
    float sigmas;
    float width; /* std-dev of the pixel footprint, in pixels; 0: thin rays */
    float pixel; /* upper bound of the pixel size at distance 1, or at any distance for parallel rays */
    bool parallel;
    const float *pixel_min; /* optional, [parts] */
} visible_reach;

/** Anchors are left out at random, each with probability `share`, as a function of (seed, draw, anchor). */
typedef struct visible_dropout {
    float share; /* [0, 1); 0: none */
    uint64_t seed, draw;
} visible_dropout;

/**
 * Write the indices of the anchors whose Gaussians a ray may hit, or of such plain Gaussians, ascending, into
 * a growing array. GBT_OK or GBT_ERR_NO_MEMORY.
 *
 * @param screen [in] optional (NULL): then anchors are visible iff their own ellipsoid touches it, regardless
 *                    of the bounds
 * @param dropout [in] optional (NULL)
 */
gbt_status visible_find(frame_subject subject, const view_bounds *bounds, const visible_reach *reach,
                        const screen_view *screen, const visible_dropout *dropout, uint32_t **visible,
                        size_t *count, size_t *capacity, gbt_error *err);

#endif
