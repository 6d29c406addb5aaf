/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/random_scene.h -- random Gaussians in front of a pinhole camera. */
#ifndef GBT_TESTS_TRACE_RANDOM_SCENE_H
#define GBT_TESTS_TRACE_RANDOM_SCENE_H

#include "base/gaussians.h"
#include "base/rng.h"
#include "test_support.h"
#include "trace/rays.h"

/* Around the origin, sizes 0.05 to 0.6, opacities from `opacity_low` to 1, colours in [0, 1]. */
static inline gaussians random_gaussians(size_t count, float opacity_low, uint64_t seed)
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, count, NULL));
    float *const means[3] = {g.mean_x, g.mean_y, g.mean_z}, *const scales[3] = {g.scale_x, g.scale_y,
                                                                                g.scale_z};
    float *const quats[4] = {g.quat_w, g.quat_x, g.quat_y, g.quat_z}, *const colors[3] = {g.red, g.green,
                                                                                          g.blue};
    for (size_t i = 0; i < count; i++) {
        float square = 0;
        for (uint64_t k = 0; k < 3; k++) {
            means[k][i] = (float)rng_normal(seed, k, i);
            scales[k][i] = 0.05f * powf(12, rng_uniform(seed, 3 + k, i));
            colors[k][i] = rng_uniform(seed, 6 + k, i);
        }
        for (uint64_t k = 0; k < 4; k++) {
            quats[k][i] = (float)rng_normal(seed, 9 + k, i);
            square += quats[k][i] * quats[k][i];
        }
        for (int k = 0; k < 4; k++)
            quats[k][i] /= sqrtf(square);
        g.opacity[i] = opacity_low + (1 - opacity_low) * rng_uniform(seed, 13, i);
    }
    gaussians_pad(&g);
    return g;
}

/* At (0, 0, -6), looking along z; and its rays. */
static inline gbt_camera pinhole_camera(int width, int height)
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = width,
                        .height = height,
                        .center = {0, 0, -6},
                        .params = {0.7 * width, 0.7 * width, 0.5 * width, 0.5 * height},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static inline ray_image pinhole_rays(int width, int height)
{
    const gbt_camera camera = pinhole_camera(width, height);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    return rays;
}

#endif
