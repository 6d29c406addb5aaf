/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/reference_once.h -- calls of the reference that make its scene and free it. */
#ifndef GBT_TEST_TRACE_REFERENCE_ONCE_H
#define GBT_TEST_TRACE_REFERENCE_ONCE_H

#include "trace/reference.h"

static inline gbt_status reference_ray_hits(const gaussians *g, const trace_settings *s,
                                            const double origin[3], const double dir[3], reference_hit **hits,
                                            size_t *count, size_t *capacity, gbt_error *err)
{
    reference_scene scene;
    *count = 0;
    gbt_status status = reference_scene_make(g, &scene, err);
    if (status == GBT_OK)
        status = reference_scene_ray_hits(&scene, s, origin, dir, hits, count, capacity, err);
    reference_scene_free(&scene);
    return status;
}

static inline gbt_status reference_backward(const gaussians *g, const trace_settings *s,
                                            const ray_image *rays, const double *d_rgb,
                                            const double *d_transmittance, double *d_gaussians,
                                            gbt_error *err)
{
    reference_scene scene;
    gbt_status status = reference_scene_make(g, &scene, err);
    if (status == GBT_OK)
        status = reference_scene_backward(&scene, s, rays, d_rgb, d_transmittance, d_gaussians, err);
    reference_scene_free(&scene);
    return status;
}

#endif
