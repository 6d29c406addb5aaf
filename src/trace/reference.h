/* SPDX-License-Identifier: Apache-2.0 */
/* trace/reference.h -- the definition of what one ray sees, in double, every Gaussian against every ray; and
   its adjoint. One contribution of each Gaussian, at its maximum response on the ray, as in Moenne-Loccoz
   2024.

   x' = S^-1 R^T (x - mu), w' = S^-1 R^T w, t* = -(x'.w') / (w'.w'), t_c = max(t*, t_near), d2 = |x' + t_c
   w'|^2, alpha = min(alpha_max, o exp(-d2 / 2)), kept if alpha >= alpha_min; ordered by (t_c, id); blended
   front to back; stopped before the hit that would make T < transmittance_min; background last. The fast
   renderers are tested against this one. */
#ifndef GBT_TRACE_REFERENCE_H
#define GBT_TRACE_REFERENCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/gaussians.h"
#include "gbtrace/status.h"
#include "trace/rays.h"
#include "trace/settings.h"

typedef struct reference_hit {
    double t, alpha, d2; /* t = t_c, in lengths of the direction */
    double order;        /* what hits are sorted by: t, or with packet_order its depth for the packet */
    uint32_t id;
} reference_hit;

/** Index of each field in arrays [GAUSSIANS_FIELD_COUNT][count]: REFERENCE_mean_x and so on. */
enum reference_field {
#define X(name, pad, meaning) REFERENCE_##name,
    GAUSSIANS_FIELDS(X)
#undef X
};

/** The Gaussians in double, so that differences can move them by less than a float can hold. */
typedef struct reference_scene {
    size_t count;
    double *fields; /* [GAUSSIANS_FIELD_COUNT][count], in the order of GAUSSIANS_FIELDS; owned */
} reference_scene;

/** Copy of `g` (without its padding). Free with reference_scene_free(). At most 2^32 - 1 Gaussians. */
gbt_status reference_scene_make(const gaussians *g, reference_scene *out, gbt_error *err);
void reference_scene_free(reference_scene *scene); /* zeroes the struct */

/**
 * All hits of one ray with alpha >= alpha_min, sorted by (t, id). A ray alone has no packet: packet_order is
 * ignored.
 *
 * @param hits, capacity [in,out] array that grows by mem_reserve(); start from NULL and 0, free with
 *              mem_free()
 * @param count          [out]    number of hits; 0 for a zero direction
 * Gaussians with values that are not finite, or scales that are not positive, are never hit.
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: any, with distinct `hits`. Cost: about 10 ns per Gaussian.
 */
gbt_status reference_scene_ray_hits(const reference_scene *scene, const trace_settings *s,
                                    const double origin[3], const double dir[3], reference_hit **hits,
                                    size_t *count, size_t *capacity, gbt_error *err);

/** Called for a ray with its hits, as of reference_scene_ray_hits() but with packet_order in that order, and
    within the ray's limits. */
typedef void reference_visitor(void *context, size_t ray, const reference_hit *hits, size_t count);

/**
 * Call `visit` for every ray.
 *
 * @param wanted [in] [rays], may be changed for the ray being visited; NULL: all rays
 * @return GBT_OK or GBT_ERR_NO_MEMORY: then some rays are not visited
 * Threads: `visit` is called for several rays at once. Cost: about 10 ns for each pair of ray and Gaussian.
 */
gbt_status reference_scene_visit(const reference_scene *scene, const trace_settings *s, const ray_image *rays,
                                 const bool *wanted, reference_visitor *visit, void *context, gbt_error *err);

/**
 * Colour and transmittance of every ray.
 *
 * @param rgb           [out] [rays][3], with the background
 * @param transmittance [out] [rays], remaining T in front of the background; optional (NULL)
 * @param blended       [out] [rays], number of hits that were added; optional (NULL)
 * @return GBT_OK, GBT_ERR_ARGUMENT (too many Gaussians) or GBT_ERR_NO_MEMORY
 * Threads: parallel over rays; same bits for every thread count. Cost: about 10 ns for each pair of ray and
 * Gaussian.
 */
gbt_status reference_forward(const gaussians *g, const trace_settings *s, const ray_image *rays, double *rgb,
                             double *transmittance, uint32_t *blended, gbt_error *err);
gbt_status reference_scene_forward(const reference_scene *scene, const trace_settings *s,
                                   const ray_image *rays, double *rgb, double *transmittance,
                                   uint32_t *blended, gbt_error *err);

/**
 * Adjoint of reference_scene_forward(): adds dL/dfield into `d_gaussians`.
 *
 * t_c is held fixed: exact at an inner t* (there d2 is at its minimum along the ray) and at t_near (a
 * constant). The gradient is 0 where alpha is cut at alpha_max. Scales are linear. The quaternion is taken as
 * unit, and its gradient is tangent to it.
 *
 * @param d_rgb           [in]     [rays][3] dL/drgb
 * @param d_transmittance [in]     [rays] dL/dT; NULL = 0
 * @param d_gaussians     [in,out] [GAUSSIANS_FIELD_COUNT][count], in the order of GAUSSIANS_FIELDS
 * @return as reference_forward(); after a failure the gradients are incomplete
 * Threads: one; sums are in ray order.
 */
gbt_status reference_scene_backward(const reference_scene *scene, const trace_settings *s,
                                    const ray_image *rays, const double *d_rgb, const double *d_transmittance,
                                    double *d_gaussians, gbt_error *err);

#endif
