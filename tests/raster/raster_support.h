/* SPDX-License-Identifier: Apache-2.0 */
/* tests/raster/raster_support.h -- random Gaussians, cameras, and passes over them. */
#ifndef GBT_TESTS_RASTER_SUPPORT_H
#define GBT_TESTS_RASTER_SUPPORT_H

#include "gaussians_support.h"

#include "base/memory.h"
#include "raster/raster.h"

typedef struct cloud_def {
    const char *name;
    size_t count;
    float spread, scale_low, scale_high, flatness; /* of scattered_gaussians() */
    double camera[3];                              /* looks at the origin */
    int width, height;
} cloud_def;

/* Of both forms' tests; discs and needles as flat as each can be held to. */
#define RASTER_CLOUDS(flatness)                                                                              \
    {"one", 1, 0.5f, 0.2f, 0.5f, 1, {0, 0.5, -4}, 40, 24},                                                   \
        {"ordinary, from outside", 400, 1, 0.05f, 0.4f, 1, {3, -2, -5}, 70, 53},                             \
        {"ordinary, from inside", 300, 2, 0.05f, 0.4f, 1, {0.2, 0.1, -0.3}, 64, 48},                         \
        {"discs and needles", 400, 1, 0.2f, 0.6f, flatness, {2, 1, -5}, 64, 48},                             \
    {                                                                                                        \
        "one pixel", 200, 1, 0.05f, 0.5f, 1, {0, 0, -5}, 1, 1                                                \
    }

static inline gaussians make_cloud(const cloud_def *def, uint64_t seed)
{
    return scattered_gaussians(def->count, def->spread, def->scale_low, def->scale_high, def->flatness, 1,
                               seed);
}

static inline gbt_camera make_camera(int width, int height, const double center[3])
{
    gbt_camera c = {.model = GBT_CAMERA_PINHOLE,
                    .width = width,
                    .height = height,
                    .params = {0.8 * width, 0.85 * width, 0.5 * width + 0.3, 0.5 * height - 0.2},
                    .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    assert_true(gbt_camera_look_at(center, (const double[3]){0, 0, 0}, (const double[3]){0.05, -1, 0.1}, &c));
    return c;
}

/* One view, forward and back. */
typedef struct drawn {
    image rgb;
    float *T, *weight;
    gaussians d;
    raster_counters counters;
} drawn;

static inline image random_image(int width, int height, uint64_t seed)
{
    image im;
    assert_ok(image_alloc(&im, width, height, 3, NULL));
    for (size_t i = 0; i < 3 * (size_t)width * (size_t)height; i++)
        im.pixels[i] = (float)rng_normal(seed, 20, i);
    return im;
}

static inline drawn draw(const gaussians *g, const gbt_camera *camera, const raster_settings *s,
                         const image *d_rgb)
{
    drawn out = {0};
    raster_scene scene = {0};
    assert_ok(image_alloc(&out.rgb, camera->width, camera->height, 3, NULL));
    out.T = mem_alloc((size_t)camera->width * (size_t)camera->height, sizeof *out.T, "test", NULL);
    out.weight = mem_alloc(g->count, sizeof *out.weight, "test", NULL);
    assert_ok(raster_forward(&scene, g, camera, s, d_rgb != NULL, &out.rgb, out.T, &out.counters, NULL));
    if (d_rgb != NULL)
        assert_ok(raster_backward(&scene, d_rgb, &out.d, out.weight, NULL));
    raster_scene_free(&scene);
    return out;
}

static inline void drawn_free(drawn *d)
{
    image_free(&d->rgb);
    mem_free(d->T);
    mem_free(d->weight);
    gaussians_free(&d->d);
}

static inline double psnr_of(const float *got, const double *wanted, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += pow((double)got[i] - wanted[i], 2);
    return sum == 0 ? 200 : -10 * log10(sum / (double)count);
}

#endif
