/* SPDX-License-Identifier: Apache-2.0 */
/* stability/order.c -- cases of the study "stability" about blending order: ties (A4), and very many hits
   (A6). */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/compare.h"
#include "base/memory.h"
#include "base/rng.h"
#include "stability/crowd.h"
#include "stability/draw.h"

/* ---- A4: Gaussians in one place ---- */

/* Transmittance and colour of a stack of n copies in closed form, with the same cut-offs. */
static void stack_exact(double alpha, size_t n, double stop, double *T, double *red, double *blue)
{
    *T = 1;
    *red = *blue = 0;
    for (size_t i = 0; i < n && *T * (1 - alpha) >= stop; i++) {
        *(2 * i < n ? red : blue) += *T * alpha;
        *T *= 1 - alpha;
    }
}

typedef struct stack_errors {
    double absolute, relative, color, build_seconds;
} stack_errors;

static void compare_stack(const drawing *d, size_t pixel, double alpha, size_t n, double stop,
                          stack_errors *out)
{
    double T, red, blue;
    stack_exact(alpha, n, stop, &T, &red, &blue);
    const float *rgb = d->rgb.pixels + 3 * pixel;
    const double off = fabs((double)d->transmittance[pixel] - T);
    out->absolute = larger_or_nan(out->absolute, off);
    out->relative = larger_or_nan(out->relative, off / T);
    out->color =
        larger_or_nan(out->color, larger_or_nan(fabs((double)rgb[0] - red), fabs((double)rgb[2] - blue)));
}

static void stack_up(stability *s, size_t n, double alpha, double depth, gaussians *g)
{
    static const double one[3] = {1, 1, 1}, colors[2][3] = {{1, 0, 0}, {0, 0, 1}};
    const double mean[3] = {0, 0, depth};
    draw_alloc(s, g, n);
    for (size_t i = 0; i < n && s->status == GBT_OK; i++)
        draw_set(g, i, mean, one, NULL, alpha, colors[2 * i < n ? 0 : 1]);
}

static void stacks(stability *s)
{
    enum { SIZE = 17, MIDDLE = SIZE * SIZE / 2 };
    static const double here[3] = {0, 0, 0}, ahead[3] = {0, 0, 1};
    double counts[16];
    const size_t sizes = stability_list(s, "copies", 16, counts);
    const double alpha = stability_number(s, "alpha"), depth = stability_number(s, "depth"),
                 raster_most = stability_number(s, "raster_most");
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    const gbt_camera camera = draw_pinhole(SIZE, SIZE, 100, here);
    drawing ours = {0}, theirs = {0};
    trace_scene timed = {.kernel = TRACE_TREE}; /* it builds a tree now; lists would be built only with the
                                                   first rays */
    ray_image rays = {0};
    gaussians g = {0};
    stack_errors e = {0}, r = {0};
    draw_rays(s, &rays, 16, 1);
    for (size_t i = 0; i < 16 && s->status == GBT_OK; i++)
        draw_ray(&rays, i, here, ahead);
    for (size_t i = 0; i < sizes && s->status == GBT_OK; i++) {
        const size_t n = (size_t)counts[i];
        const double stop = (double)settings.transmittance_min;
        stack_up(s, n, alpha, depth, &g);
        const double start = clock_wall();
        if (s->status == GBT_OK)
            stability_ok(s, trace_build(&timed, &g, &settings, 0, s->err));
        e.build_seconds = clock_wall() - start;
        assert(s->status != GBT_OK || timed.tree.box_count == n);
        draw_traced(s, &ours, &g, &settings, &rays);
        for (size_t p = 0; p < 16 && s->status == GBT_OK; p++)
            compare_stack(&ours, p, (double)(float)alpha, n, stop, &e);
        if (counts[i] <= raster_most) {
            draw_splatted(s, &theirs, &g, &splat, &camera);
            if (s->status == GBT_OK)
                compare_stack(&theirs, MIDDLE, (double)(float)alpha, n, stop, &r);
        }
    }
    const double most = sizes > 0 ? counts[sizes - 1] : 0;
    stability_check(s, "A4a", e.absolute, r.absolute,
                    "1 to %.0f copies (the rasterizer: to %.0f), against 0.99^n up to where T falls to 1e-4.",
                    most, raster_most);
    stability_check(s, "A4b", e.relative, r.relative, "%s", "");
    stability_check(s, "A4c", e.color, r.color,
                    "The first half is red and the second blue: equal depths go by index.");
    stability_check(s, "A4e", e.build_seconds, NAN, "%.0f copies.", most);
    trace_scene_free(&timed);
    drawing_free(&ours);
    drawing_free(&theirs);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Store the same Gaussians in another order. */
static void shuffle(stability *s, const gaussians *g, gaussians *out)
{
    if (s->status != GBT_OK || !stability_ok(s, gaussians_copy(g, out, s->err)))
        return;
    for (size_t i = g->count - 1; i > 0; i--) {
        const size_t j = (size_t)((double)rng_uniform(5, 50, i) * (double)(i + 1));
        float swap;
#define X(name, pad, meaning) swap = out->name[i], out->name[i] = out->name[j], out->name[j] = swap;
        GAUSSIANS_FIELDS(X)
#undef X
    }
}

/* Compare two pictures of the same Gaussians, except for rays on edges: the number of values whose bits
   differ, and the largest difference. */
static size_t bits_changed(const stability *s, const drawing d[2], const bool *on_edge, double *most)
{
    const size_t values = 3 * (size_t)d[0].rgb.width * (size_t)d[0].rgb.height;
    size_t changed = 0;
    *most = 0;
    for (size_t i = 0; i < values && s->status == GBT_OK; i++) {
        if (on_edge[i / 3])
            continue;
        changed += memcmp(&d[0].rgb.pixels[i], &d[1].rgb.pixels[i], sizeof(float)) != 0;
        *most = larger_or_nan(*most, draw_difference(&d[0].rgb.pixels[i], &d[1].rgb.pixels[i], 1));
    }
    return changed;
}

static void stored_anyhow(stability *s)
{
    enum { WIDTH = 96, HEIGHT = 64 };
    static const double here[3] = {0, 0, 0};
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    const gbt_camera camera = draw_pinhole(WIDTH, HEIGHT, 80, here);
    gaussians g = {0}, other = {0};
    drawing single[2] = {{.traced.kernel = TRACE_SINGLE}, {.traced.kernel = TRACE_SINGLE}}, tiles[2] = {0},
            splats[2] = {0};
    ray_image rays = {0};
    double most, tile_most, splat_most;
    bool on_edge[WIDTH * HEIGHT];
    size_t edges = 0;
    stability_crowd(s, &g);
    if (s->status == GBT_OK)
        shuffle(s, &g, &other);
    for (int i = 0; i < 2; i++) {
        const gaussians *stored = i == 0 ? &g : &other;
        draw_camera(s, &single[i], stored, &settings, &camera, &rays);
        draw_camera(s, &tiles[i], stored, &settings, &camera, &rays);
        draw_splatted(s, &splats[i], stored, &splat, &camera);
    }
    if (s->status == GBT_OK)
        edges = stability_find_edges(s, &g, rays.dir, WIDTH * HEIGHT, on_edge);
    const size_t changed = bits_changed(s, single, on_edge, &most),
                 tile_changed = bits_changed(s, tiles, on_edge, &tile_most);
    const size_t splat_changed = bits_changed(s, splats, on_edge, &splat_most);
    stability_check(s, "A4d", (double)changed, (double)splat_changed,
                    "%zu Gaussians. Equal depths go by place in the array: %zu of %d rays within rounding of "
                    "a tie or a cut are left out.",
                    g.count, edges, WIDTH * HEIGHT);
    stability_check(s, "A4f", tile_most, splat_most,
                    "The last bit of %zu of %d values: a tile multiplies in the order of its rows.",
                    tile_changed, 3 * WIDTH * HEIGHT);
    for (int i = 0; i < 2; i++) {
        drawing_free(&single[i]);
        drawing_free(&tiles[i]);
        drawing_free(&splats[i]);
    }
    ray_image_free(&rays);
    gaussians_free(&g);
    gaussians_free(&other);
}

gbt_status stability_a4(stability *s)
{
    stacks(s);
    stored_anyhow(s);
    return s->status;
}

/* ---- A6: very many hits ---- */

static void concentric(stability *s, size_t count, double opacity, gaussians *g)
{
    const double size = stability_number(s, "scale"), scale[3] = {size, size, size};
    draw_alloc(s, g, count);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        const double share = (double)i / (double)count;
        const double mean[3] = {0, 0, 4 + 2 * (double)rng_uniform(6, 0, i)},
                     color[3] = {share, 1 - share, 0.5};
        draw_set(g, i, mean, scale, NULL, opacity, color);
    }
}

/* CPU seconds for one picture, minimum of five. */
static double time_picture(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                           const ray_image *rays)
{
    double least = INFINITY;
    for (int i = 0; i < 5; i++) {
        const double start = clock_process();
        draw_traced(s, d, g, settings, rays);
        least = fmin(least, clock_process() - start);
    }
    return least;
}

gbt_status stability_a6(stability *s)
{
    static const double here[3] = {0, 0, 0};
    static const trace_kernel kernels[] = {TRACE_LIST, TRACE_TREE, TRACE_SINGLE, TRACE_EMBREE};
    const size_t count = (size_t)stability_number(s, "gaussians");
    const gbt_camera camera = draw_pinhole(8, 8, 60, here); /* slopes below 0.085, so that every ray is well
                                                               inside of every Gaussian */
    trace_settings settings = trace_settings_default();
    gaussians g = {0};
    ray_image rays = {0};
    drawing d = {0};
    double *exact = NULL, worst = 0;
    concentric(s, count, stability_number(s, "opacity"), &g);
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_camera(&camera, &rays, s->err)))
        exact = draw_exact(s, &g, &settings, &rays, NULL);
    for (int k = 0; k < 4 && s->status == GBT_OK; k++) {
        drawing_free(&d);
        d = (drawing){.traced.kernel = kernels[k]};
        draw_traced(s, &d, &g, &settings, &rays);
        if (s->status == GBT_OK)
            worst = larger_or_nan(worst, draw_error(d.rgb.pixels, exact, 3 * 64));
    }
    stability_check(s, "A6a", worst, NAN, "%zu on every ray; the worst of four kernels.", count);
    drawing_free(&d);
    d = (drawing){0};
    const double large = time_picture(s, &d, &g, &settings, &rays);
    concentric(s, count / 10, stability_number(s, "opacity"), &g);
    const double small = time_picture(s, &d, &g, &settings, &rays);
    stability_check(s, "A6c", large / small / (10 * log2((double)count) / log2((double)count / 10)), NAN,
                    "Processor time of build and picture, the least of five.");

    settings.background[0] = 0.25f;
    settings.background[1] = 0.5f;
    settings.background[2] = 0.75f;
    concentric(s, (size_t)stability_number(s, "unseen"), stability_number(s, "unseen_opacity"), &g);
    draw_traced(s, &d, &g, &settings, &rays);
    double shown = 0;
    for (size_t i = 0; i < 3 * 64 && s->status == GBT_OK; i++)
        shown = larger_or_nan(shown, fabs((double)d.rgb.pixels[i] - (double)settings.background[i % 3]));
    stability_check(s, "A6b", shown, NAN, "%s", "");
    mem_free(exact);
    drawing_free(&d);
    ray_image_free(&rays);
    gaussians_free(&g);
    return s->status;
}
