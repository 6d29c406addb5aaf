/* SPDX-License-Identifier: Apache-2.0 */
/* stability/embree.c -- case A16 of the study "stability": what Embree cannot take, refuses, or loses. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/rng.h"
#include "bvh/device.h"
#include "stability/draw.h"

static const trace_kernel kernels[] = {TRACE_TREE, TRACE_SINGLE, TRACE_EMBREE};
enum { KERNELS = sizeof kernels / sizeof *kernels };

static size_t boxes_of(const trace_scene *scene)
{
    return scene->kernel == TRACE_EMBREE ? scene->embree.box_count : scene->tree.box_count;
}

/* Small Gaussians in a cube of half-size 10. */
static void fill(stability *s, size_t count, gaussians *g)
{
    static const double white[3] = {1, 1, 1}, scale[3] = {0.1, 0.1, 0.1};
    draw_some(s, g, count);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        double mean[3];
        for (uint64_t k = 0; k < 3; k++)
            mean[k] = 20 * (double)rng_uniform(16, k, i) - 10;
        draw_set(g, i, mean, scale, NULL, 0.5, white);
    }
}

/* Boxes that Embree would drop without a word: each must be counted, and no good one lost. */
static void bad_boxes(stability *s)
{
    static const float values[] = {NAN, INFINITY, -INFINITY, 1e18f, -1e19f, 1e38f, -1e38f};
    enum { BAD = 3 * sizeof values / sizeof *values };
    const trace_settings settings = trace_settings_default();
    gaussians g = {0};
    size_t off = 0;
    fill(s, 1000, &g);
    for (size_t i = 0; i < BAD && s->status == GBT_OK; i++)
        (i % 3 == 0 ? g.mean_x : i % 3 == 1 ? g.mean_y : g.mean_z)[40 * i + 3] = values[i / 3];
    for (int k = 0; k < KERNELS && s->status == GBT_OK; k++) {
        trace_scene scene = {.kernel = kernels[k]};
        if (stability_ok(s, trace_build(&scene, &g, &settings, 10, s->err)))
            off += (size_t)llabs((long long)boxes_of(&scene) - (1000 - BAD)) +
                   (size_t)llabs((long long)(kernels[k] == TRACE_EMBREE ? scene.embree.rejected_count
                                                                        : scene.tree.rejected_count) -
                                 BAD);
        trace_scene_free(&scene);
    }
    stability_check(s, "A16a", (double)off, NAN,
                    "%d bad boxes among 1,000; Embree itself drops them and reports no error.", (int)BAD);
    gaussians_free(&g);
}

/* Rays on which Debian's Embree 3 aborts: they must see the background. */
static void bad_rays(stability *s)
{
    static const float values[] = {NAN, INFINITY, -INFINITY, 2e18f, -2e18f, 1e38f};
    enum { COUNT = 6 * sizeof values / sizeof *values + 1 };
    static const double here[3] = {0, 0, -20}, ahead[3] = {0, 0, 1};
    trace_settings settings = trace_settings_default();
    settings.background[0] = 0.25f;
    settings.background[1] = 0.5f;
    settings.background[2] = 0.75f;
    gaussians g = {0};
    ray_image rays = {0};
    size_t off = 0;
    fill(s, 1000, &g);
    draw_rays(s, &rays, COUNT, 1);
    for (size_t i = 0; i < COUNT && s->status == GBT_OK; i++) {
        draw_ray(&rays, i, here, ahead);
        if (i < COUNT - 1)
            (i % 6 < 3 ? rays.origin : rays.dir)[3 * i + i % 3] = values[i / 6];
        else
            rays.dir[3 * i + 2] = 0; /* no direction */
    }
    for (int k = 0; k < KERNELS && s->status == GBT_OK; k++) {
        drawing d = {.traced.kernel = kernels[k]};
        if (stability_ok(s, trace_build(&d.traced, &g, &settings, 20, s->err)) &&
            stability_ok(s, image_alloc(&d.rgb, COUNT, 1, 3, s->err)))
            stability_ok(
                s, trace_forward(&d.traced, &rays, false, &(trace_outputs){.rgb = &d.rgb}, NULL, s->err));
        for (size_t i = 0; i < 3 * COUNT && s->status == GBT_OK; i++)
            off += d.rgb.pixels[i] != settings.background[i % 3];
        drawing_free(&d);
    }
    stability_check(s, "A16b", (double)off, NAN, "%d rays, three kernels.", (int)COUNT);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Embree's memory refused at ever more bytes: each build is an error or whole, never half, and can be
   repeated. */
static void refusals(stability *s)
{
    const trace_settings settings = trace_settings_default();
    gaussians g = {0};
    size_t wrong = 0, refused = 0, tries = 0;
    fill(s, 5000, &g);
    const bool tree_too = stability_number(s, "refuse_trees") != 0;
    for (int k = tree_too ? 0 : 2; k < KERNELS && s->status == GBT_OK; k += 2) /* TRACE_SINGLE has the tile's
                                                                                  tree */
        for (size_t allowed = 0; allowed < 2000000 && s->status == GBT_OK; allowed += 100000, tries++) {
            trace_scene scene = {.kernel = kernels[k]};
            gbt_error why = {0};
            bvh_limit_memory(bvh_memory_bytes() + allowed);
            const gbt_status status = trace_build(&scene, &g, &settings, 10, &why);
            bvh_limit_memory(SIZE_MAX);
            refused += status == GBT_ERR_NO_MEMORY;
            wrong += status == GBT_OK ? boxes_of(&scene) != g.count
                                      : status != GBT_ERR_NO_MEMORY || why.text[0] == '\0';
            wrong += trace_build(&scene, &g, &settings, 10, NULL) != GBT_OK || boxes_of(&scene) != g.count;
            trace_scene_free(&scene);
        }
    stability_check(s, "A16c", (double)wrong, NAN, "%zu of %zu builds refused; a build after each is whole.",
                    refused, tries);
    gaussians_free(&g);
}

static void builds_again(stability *s)
{
    const int builds = (int)stability_number(s, "rebuilds");
    const trace_settings settings = trace_settings_default();
    gaussians g = {0};
    double grown = 0;
    fill(s, 2000, &g);
    for (int k = 0; k < KERNELS && s->status == GBT_OK; k += 2) {
        const size_t before = bvh_memory_bytes();
        for (int i = 0; i < builds && s->status == GBT_OK; i++) {
            trace_scene scene = {.kernel = kernels[k]};
            stability_ok(s, trace_build(&scene, &g, &settings, 10, s->err));
            trace_scene_free(&scene);
        }
        grown += fabs((double)bvh_memory_bytes() - (double)before);
    }
    stability_check(s, "A16d", grown, NAN, "%d builds of each kind.", builds);
    gaussians_free(&g);
}

/* Small spheres far from the origin, a ray at each: Embree's own boxes lose many of them. */
static void far_boxes(stability *s)
{
    enum { RAYS = 4096 };
    double places[12];
    const size_t count = stability_list(s, "far", 12, places) / 2;
    const trace_settings settings = trace_settings_default();
    size_t lost = 0, rays_traced = 0;
    gaussians g = {0};
    ray_image rays = {0};
    draw_some(s, &g, RAYS);
    draw_rays(s, &rays, 64, RAYS / 64);
    for (size_t p = 0; p < count && s->status == GBT_OK; p++) {
        const double size = places[2 * p], offset = places[2 * p + 1];
        for (size_t i = 0; i < RAYS; i++) {
            static const double white[3] = {1, 1, 1};
            double mean[3], dir[3], origin[3];
            draw_random_direction(17, 0, i, dir);
            for (uint64_t k = 0; k < 3; k++)
                mean[k] = (double)(float)(offset + 1000 * size * (double)rng_uniform(17, 5 + k, i)),
                origin[k] = mean[k] - 5000 * size * dir[k];
            const double scale[3] = {size / 3.3, size / 3.3, size / 3.3};
            draw_set(&g, i, mean, scale, NULL, 1, white);
            draw_ray(&rays, i, origin, dir);
        }
        double *T = mem_alloc(RAYS, sizeof *T, "transmittance", s->err),
               *exact = T == NULL ? NULL : draw_exact(s, &g, &settings, &rays, T);
        stability_ok(s, T == NULL ? GBT_ERR_NO_MEMORY : GBT_OK);
        for (int k = 0; k < KERNELS && s->status == GBT_OK; k++) {
            drawing d = {.traced.kernel = kernels[k]};
            draw_traced(s, &d, &g, &settings, &rays);
            for (size_t i = 0; i < RAYS && s->status == GBT_OK; i++)
                lost += T[i] < 0.97 && d.transmittance[i] == 1.0f;
            rays_traced += RAYS;
            drawing_free(&d);
        }
        mem_free(T);
        mem_free(exact);
    }
    stability_check(s, "A16e", (double)lost, NAN,
                    "%zu rays at spheres of 5 mm at 100 km to 50 cm at 10,000 km, three kernels. Unpadded "
                    "boxes lose 1 to 72 %% of such hits.",
                    rays_traced);
    gaussians_free(&g);
    ray_image_free(&rays);
}

gbt_status stability_a16(stability *s)
{
    bad_boxes(s);
    bad_rays(s);
    refusals(s);
    builds_again(s);
    far_boxes(s);
    return s->status;
}
