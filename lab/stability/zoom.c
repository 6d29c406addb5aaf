/* SPDX-License-Identifier: Apache-2.0 */
/* stability/zoom.c -- case A9 of the study "stability": Gaussians much smaller and much larger than a pixel.
 */
#include <math.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"
#include "stability/draw.h"
#include "trace/footprint.h"

/* Ways to draw the grid of dots. */
typedef enum zoom_way { ZOOM_FOOTPRINT, ZOOM_SPLAT, ZOOM_POINT, ZOOM_EXACT, ZOOM_WAYS } zoom_way;
static const char *const way_names[ZOOM_WAYS] = {"gbtrace, footprint", "rasterizer (3DGS)",
                                                 "gbtrace, no filter", NULL};

typedef struct zoom {
    gaussians grid, widened;
    trace_settings settings;
    float variance; /* of the footprint, px^2 */
    int samples;    /* per pixel and axis, for the exact picture */
    drawing d;
    ray_image rays;
} zoom;

static void lay_grid(stability *s, double spacing, gaussians *g)
{
    static const double white[3] = {1, 1, 1};
    const size_t across = (size_t)stability_number(s, "across");
    const double size = stability_number(s, "scale"), scale[3] = {size, size, size},
                 opacity = stability_number(s, "opacity");
    draw_alloc(s, g, across * across);
    for (size_t i = 0; s->status == GBT_OK && i < g->count; i++) {
        const double mean[3] = {spacing * ((double)(i % across) - (double)(across / 2)),
                                spacing * ((double)(i / across) - (double)(across / 2)), 0};
        draw_set(g, i, mean, scale, NULL, opacity, white);
    }
}

/* Average blocks of samples x samples pixels; one channel. */
static void average_blocks(const image *rgb, int samples, double *out)
{
    const int width = rgb->width / samples, height = rgb->height / samples;
    memset(out, 0, (size_t)width * (size_t)height * sizeof *out);
    for (int y = 0; y < rgb->height; y++)
        for (int x = 0; x < rgb->width; x++)
            out[(size_t)(y / samples) * (size_t)width + (size_t)(x / samples)] +=
                (double)rgb->pixels[3 * ((size_t)y * (size_t)rgb->width + (size_t)x)] / (samples * samples);
}

/* Red channel of the grid at distance z, drawn in one way, [size][size], with the picture shifted by (dx, dy)
   pixels. */
static void draw_grid(stability *s, zoom *z, zoom_way way, double distance, int size, double dx, double dy,
                      double *out)
{
    const double center[3] = {0, 0, -distance}, focal = stability_number(s, "focal");
    const raster_settings splat = raster_settings_default();
    const int samples = way == ZOOM_EXACT ? z->samples : 1;
    gbt_camera camera = draw_pinhole(size, size, focal, center);
    camera.params[2] += dx;
    camera.params[3] += dy;
    camera = gbt_camera_resized(&camera, size * samples, size * samples);
    if (way == ZOOM_FOOTPRINT) {
        const footprint_view view = footprint_view_of(&camera);
        if (s->status == GBT_OK)
            stability_ok(s, footprint_forward(&view, z->variance, NULL, &z->grid, &z->widened, s->err));
    }
    if (way == ZOOM_SPLAT)
        draw_splatted(s, &z->d, &z->grid, &splat, &camera);
    else
        draw_camera(s, &z->d, way == ZOOM_FOOTPRINT ? &z->widened : &z->grid, &z->settings, &camera,
                    &z->rays);
    if (s->status == GBT_OK)
        average_blocks(&z->d.rgb, samples, out);
}

static double mean_of(const double *values, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += values[i];
    return sum / (double)count;
}

/* Compare the brightness at every distance with that of the exact picture: largest relative error of each
   way. */
static void compare_brightness(stability *s, zoom *z, stability_chart *chart, double worst[ZOOM_WAYS])
{
    double distances[16];
    const size_t count = stability_list(s, "distances", 16, distances);
    const int size = (int)stability_number(s, "size");
    const size_t pixels = (size_t)size * (size_t)size;
    double *picture = mem_alloc(pixels, sizeof *picture, "grid", s->err);
    stability_ok(s, picture == NULL ? GBT_ERR_NO_MEMORY : GBT_OK);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        draw_grid(s, z, ZOOM_EXACT, distances[i], size, 0, 0, picture);
        const double exact = mean_of(picture, pixels);
        for (zoom_way way = 0; way < ZOOM_EXACT && s->status == GBT_OK; way++) {
            draw_grid(s, z, way, distances[i], size, 0, 0, picture);
            const double ratio = mean_of(picture, pixels) / exact;
            worst[way] = fmax(worst[way], isfinite(ratio) ? fabs(ratio - 1) : (double)INFINITY);
            if (chart != NULL)
                stability_point(chart, (int)way, distances[i], fmax(ratio, 1e-3));
        }
    }
    mem_free(picture);
}

enum { SHIFTS = 16 };

/* Standard deviation of a pixel over 16 subpixel shifts, RMS over the pixels. If the dots are closer together
   than pixels, the picture should be uniform. */
static double flicker_of(stability *s, zoom *z, zoom_way way, double distance, int size, double *scratch)
{
    const size_t pixels = (size_t)size * (size_t)size;
    double *first = scratch, *second = scratch + pixels, *picture = scratch + 2 * pixels, sum = 0;
    memset(scratch, 0, 2 * pixels * sizeof *scratch);
    for (int shift = 0; shift < SHIFTS && s->status == GBT_OK; shift++) {
        draw_grid(s, z, way, distance, size, 0.25 * (shift % 4), 0.25 * (shift / 4), picture);
        for (size_t i = 0; i < pixels && s->status == GBT_OK; i++) {
            first[i] += picture[i];
            second[i] += picture[i] * picture[i];
        }
    }
    for (size_t i = 0; i < pixels; i++)
        sum += fmax(second[i] / SHIFTS - first[i] * first[i] / (SHIFTS * SHIFTS), 0);
    return sqrt(sum / (double)pixels);
}

static void compare_flicker(stability *s, zoom *z, double worst[ZOOM_WAYS])
{
    double distances[16];
    const size_t count = stability_list(s, "flicker_distances", 16, distances);
    const int size = (int)stability_number(s, "flicker_size");
    double *scratch = mem_alloc(3 * (size_t)size * (size_t)size, sizeof *scratch, "shifted grids", s->err);
    stability_ok(s, scratch == NULL ? GBT_ERR_NO_MEMORY : GBT_OK);
    for (size_t i = 0; i < count; i++)
        for (zoom_way way = 0; way < ZOOM_EXACT && s->status == GBT_OK; way++)
            worst[way] = larger_or_nan(worst[way], flicker_of(s, z, way, distances[i], size, scratch));
    mem_free(scratch);
}

gbt_status stability_a9(stability *s)
{
    double bright[ZOOM_WAYS] = {0}, usual[ZOOM_WAYS] = {0}, dense[ZOOM_WAYS] = {0}, flicker[ZOOM_WAYS] = {0};
    zoom z = {.settings = trace_settings_default(),
              .variance = (float)stability_number(s, "variance"),
              .samples = (int)stability_number(s, "samples")};
    trace_settings_preset(GBT_PRESET_EXACT, &z.settings);
    lay_grid(s, stability_number(s, "spacing"), &z.grid);
    stability_chart *chart = stability_new_chart(
        s, "Zooming out",
        "Brightness of a grid of dots of 2 cm, over its true brightness. It should be 1 at any distance.",
        "distance, m", "brightness / true");
    chart->log_x = chart->log_y = true;
    for (int way = 0; way < ZOOM_EXACT; way++)
        chart->series[way].name = way_names[way];
    compare_brightness(s, &z, chart, bright);
    compare_flicker(s, &z, flicker);
    z.settings = trace_settings_default();
    compare_brightness(s, &z, NULL, usual);
    trace_settings_preset(GBT_PRESET_EXACT, &z.settings);
    lay_grid(s, stability_number(s, "dense_spacing"), &z.grid);
    compare_brightness(s, &z, NULL, dense);
    stability_check(s, "A9a", bright[ZOOM_FOOTPRINT], bright[ZOOM_SPLAT],
                    "Preset \"exact\", %.2g px^2. Without the filter %.2g. With alpha_min 1/255 %.2g: the "
                    "cut takes faint dots whole. Dots 0.1 m apart: %.2g, since blended dots hide each other.",
                    (double)z.variance, bright[ZOOM_POINT], usual[ZOOM_FOOTPRINT], dense[ZOOM_FOOTPRINT]);
    stability_check(s, "A9b", flicker[ZOOM_FOOTPRINT], flicker[ZOOM_SPLAT], "Without the filter %.2g.",
                    flicker[ZOOM_POINT]);
    drawing_free(&z.d);
    ray_image_free(&z.rays);
    gaussians_free(&z.grid);
    gaussians_free(&z.widened);
    return s->status;
}
