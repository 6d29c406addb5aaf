/* SPDX-License-Identifier: Apache-2.0 */
/* frame/visible.h -- which parts of a subject the rays of a view may reach. */
#ifndef GBT_FRAME_VISIBLE_H
#define GBT_FRAME_VISIBLE_H

#include <math.h>

#include "frame/screen.h"
#include "frame/subject.h"
#include "trace/rays.h"

enum { VIEW_PLANES = 5 };

/** All rays start in a ball around `center` and point into a cone around `axis`. When they all look forward,
    all that they reach is on the inner side of planes too: where n.d <= 0 for every direction, n.x is nowhere
    larger than at the rays' own origins. */
typedef struct view_bounds {
    float center[3], origin_radius;
    float axis[3], cos_angle, sin_angle;
    int plane_count;
    float plane[VIEW_PLANES][3]; /* unit normals pointing out: visible ball -> n.(x - center) <= offset +
                                    radius */
    float offset[VIEW_PLANES];
} view_bounds;

/** No bounds: everything is visible. */
static inline view_bounds view_bounds_none(void)
{
    return (view_bounds){.origin_radius = (float)HUGE_VAL, .cos_angle = -1}; /* no planes, and every ball
                                                                                holds an origin */
}

/**
 * Bounds on the rays of all samples of a shot.
 *
 * @param rays [in] those through the middle of the aperture. Another point of it shifts an origin by at most
 *                  its radius R, and with the focus at F a slope by at most R / F and a direction by at most
 *                  asin(R / F)
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status view_bounds_find(const ray_shot *shot, const ray_image *rays, view_bounds *out, gbt_error *err);

/** How far a Gaussian reaches: `sigmas` std-devs, and as many of a pixel's width when rays have one
    (trace/footprint.h). */
typedef struct visible_reach {
    float sigmas;
    float width; /* std-dev of a pixel, in pixels; 0: rays are thin */
    float pixel; /* at most the size of a pixel at distance 1, or anywhere when parallel */
    bool parallel;
    const float *pixel_min; /* optional, [parts] */
} visible_reach;

/** Anchors are left out at random, each with the probability `share`: by (seed, draw, anchor). */
typedef struct visible_chance {
    float share; /* [0, 1); 0: none */
    uint64_t seed, draw;
} visible_chance;

/**
 * Indices of the anchors whose Gaussians a ray may meet, or of such Gaussians, ascending, into a growing
 * array. GBT_OK or GBT_ERR_NO_MEMORY.
 *
 * @param screen [in] optional (NULL): anchors whose own ellipsoid touches it, whatever the bounds say
 * @param chance [in] optional (NULL)
 */
gbt_status visible_find(frame_subject subject, const view_bounds *bounds, const visible_reach *reach,
                        const screen_view *screen, const visible_chance *chance, uint32_t **visible,
                        size_t *count, size_t *capacity, gbt_error *err);

#endif
