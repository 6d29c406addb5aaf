/* SPDX-License-Identifier: Apache-2.0 */
/* stability/values.c -- cases of the study "stability" about values: saturated stacks and their gradients
   (A7), and non-finite values (A8). */
#include <math.h>
#include <string.h>

#include "base/rng.h"
#include "stability/draw.h"
#include "stability/gradient.h"
#include "stability/model.h"

/* ---- A7: saturation ---- */

/* A white Gaussian and n - 1 grey ones behind it, half a unit apart. */
static void in_a_row(stability *s, size_t n, double opacity, gaussians *g)
{
    const double scale[3] = {0.2, 0.2, 0.2};
    draw_alloc(s, g, n);
    for (size_t i = 0; i < n && s->status == GBT_OK; i++) {
        const double mean[3] = {0, 0, 2 + 0.5 * (double)i}, grey = i == 0 ? 1 : 0.2,
                     color[3] = {grey, grey, grey};
        draw_set(g, i, mean, scale, NULL, opacity, color);
    }
}

/* Largest gradient of all fields except colours; for a response cut at alpha_max it must be exactly 0. */
static double shape_gradient(const gaussians *d)
{
    double most = 0;
#define X(name, pad, meaning)                                                                                \
    for (size_t i = 0; i < d->count && d->name != d->red && d->name != d->green && d->name != d->blue; i++)  \
        most = fmax(most, fabs((double)d->name[i]));
    GAUSSIANS_FIELDS(X)
#undef X
    return most;
}

typedef struct saturation {
    double relative, inside;
    size_t bad, stacks;
} saturation;

static void measure_stack(stability *s, double opacity, size_t n, double slope,
                          const trace_settings *settings, saturation *out)
{
    static const double here[3] = {0, 0, 0};
    const double dir[3] = {slope, 0, 1};
    gaussians g = {0}, d = {0};
    ray_image rays = {0};
    in_a_row(s, n, opacity, &g);
    draw_rays(s, &rays, 1, 1);
    if (s->status == GBT_OK) {
        draw_ray(&rays, 0, here, dir);
        const gradient_error e = draw_gradient_error(s, &g, settings, &rays, &d);
        out->bad += e.bad;
        out->stacks++;
        if (slope == 0 && opacity > (double)settings->alpha_max) /* every response is cut at alpha_max */
            out->inside = fmax(out->inside, s->status == GBT_OK ? shape_gradient(&d) : 0);
        out->relative = fmax(out->relative, e.relative);
    }
    ray_image_free(&rays);
    gaussians_free(&g);
    gaussians_free(&d);
}

gbt_status stability_a7(stability *s)
{
    double opacities[8], slopes[8], stops[4];
    const size_t opacity_count = stability_list(s, "opacities", 8, opacities),
                 slope_count = stability_list(s, "slopes", 8, slopes);
    const size_t stop_count = stability_list(s, "stops", 4, stops),
                 most = (size_t)stability_number(s, "most");
    trace_settings settings = trace_settings_default();
    saturation out = {0};
    for (size_t stop = 0; stop < stop_count; stop++)
        for (size_t o = 0; o < opacity_count; o++)
            for (size_t k = 0; k < slope_count; k++)
                for (size_t n = 1; n <= most && s->status == GBT_OK; n++) {
                    settings.transmittance_min = (float)stops[stop];
                    if (slopes[k] != 0 || (float)opacities[o] != settings.alpha_max) /* there is no derivative
                                                                                        exactly at the cut */
                        measure_stack(s, opacities[o], n, slopes[k], &settings, &out);
                }
    stability_check(s, "A7a", out.relative, NAN, "%zu stacks of 1 to %zu, T_min %g and %g.", out.stacks, most,
                    stops[0], stops[stop_count > 0 ? stop_count - 1 : 0]);
    stability_check(
        s, "A7b", out.inside, NAN,
        "Where alpha is cut at 0.99 the derivative is 0; dividing it out unmasked would give 0.8.");
    stability_check(s, "A7c", (double)out.bad, NAN, "%s", "");
    return s->status;
}

/* ---- A8: non-finite values ---- */

static const float bad_values[] = {0.0f,   -0.0f, NAN,    INFINITY, -INFINITY,
                                   1e-45f, 1e38f, -1e38f, 100.0f,   -1000.0f};
enum { BAD_VALUES = sizeof bad_values / sizeof *bad_values, BAD_SIZE = 24 };

static void scatter(stability *s, size_t count, gaussians *g)
{
    draw_alloc(s, g, count);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        double mean[3], scale[3], color[3], quat[4];
        draw_random_turn(8, 9, i, quat);
        for (uint64_t k = 0; k < 3; k++) {
            mean[k] = rng_normal(8, k, i) + (k == 2 ? 5 : 0);
            scale[k] = 0.1 + 0.4 * (double)rng_uniform(8, 3 + k, i);
            color[k] = (double)rng_uniform(8, 6 + k, i);
        }
        draw_set(g, i, mean, scale, quat, 0.5, color);
    }
}

typedef struct poisoning {
    trace_scene traced;
    raster_scene splatted;
    image rgb, d_rgb;
    ray_image rays;
    gbt_camera camera;
    gaussians d_gaussians;
    size_t tries, bad_pixels, bad_gradients, overflows, bad_splatted;
} poisoning;

static bool is_color(const char *field)
{
    return strcmp(field, "red") == 0 || strcmp(field, "green") == 0 || strcmp(field, "blue") == 0;
}

/* Picture and gradient of Gaussians one of which has a bad value. */
static void try_poison(stability *s, poisoning *p, const gaussians *g, const char *field, float value)
{
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    const size_t values = 3 * ray_image_count(&p->rays);
    gaussians *d = &p->d_gaussians;
    if (s->status != GBT_OK || !stability_ok(s, trace_build(&p->traced, g, &settings, 0, s->err)) ||
        !stability_ok(
            s, trace_forward(&p->traced, &p->rays, true, &(trace_outputs){.rgb = &p->rgb}, NULL, s->err)))
        return;
    p->tries++;
    p->bad_pixels += draw_count_bad(p->rgb.pixels, values);
    if (!stability_ok(s, trace_backward(&p->traced, &p->rays, &p->d_rgb, d, NULL, s->err)))
        return;
    const size_t bad = draw_count_bad_fields(d);
    if (fabsf(value) > 1e37f && isfinite(value) && is_color(field))
        p->overflows += bad;
    else
        p->bad_gradients += bad;
    if (stability_ok(s,
                     raster_forward(&p->splatted, g, &p->camera, &splat, false, &p->rgb, NULL, NULL, s->err)))
        p->bad_splatted += draw_count_bad(p->rgb.pixels, values);
}

static void poison_arrays(stability *s, size_t count)
{
    static const double here[3] = {0, 0, 0};
    poisoning p = {.camera = draw_pinhole(BAD_SIZE, BAD_SIZE, BAD_SIZE, here)};
    gaussians g = {0};
    scatter(s, count, &g);
    stability_ok(s, image_alloc(&p.rgb, BAD_SIZE, BAD_SIZE, 3, s->err));
    stability_ok(s, image_alloc(&p.d_rgb, BAD_SIZE, BAD_SIZE, 3, s->err));
    if (s->status == GBT_OK)
        stability_ok(s, ray_image_from_camera(&p.camera, &p.rays, s->err));
    for (size_t i = 0; i < 3 * BAD_SIZE * BAD_SIZE && s->status == GBT_OK; i++)
        p.d_rgb.pixels[i] = 1;
    for (size_t v = 0; v < BAD_VALUES && s->status == GBT_OK; v++) {
        float kept;
#define X(name, pad, meaning)                                                                                \
    kept = g.name[5], g.name[5] = bad_values[v];                                                             \
    try_poison(s, &p, &g, #name, bad_values[v]);                                                             \
    g.name[5] = kept;
        GAUSSIANS_FIELDS(X)
#undef X
    }
    stability_check(s, "A8a", (double)p.bad_pixels, (double)p.bad_splatted,
                    "%zu pictures of %zu Gaussians, one of them poisoned in one field.", p.tries, count);
    stability_check(
        s, "A8b", (double)p.bad_gradients, NAN,
        "%zu gradients. Not counted: %zu infinities where a colour is 1e38, whose gradient no float holds.",
        p.tries, p.overflows);
    trace_scene_free(&p.traced);
    raster_scene_free(&p.splatted);
    image_free(&p.rgb);
    image_free(&p.d_rgb);
    ray_image_free(&p.rays);
    gaussians_free(&p.d_gaussians);
    gaussians_free(&g);
}

/* Rows of a file, one of them with a bad value: every loaded value must be finite, and dropped rows must be
   counted. */
static void poison_files(stability *s, size_t count)
{
    enum { ROWS_MAX = 256 };
    static float rows[ROWS_MAX][MODEL_COLUMNS];
    size_t bad = 0, miscounted = 0, dropped = 0, repaired = 0, tries = 0;
    count = count < ROWS_MAX ? count : ROWS_MAX;
    for (size_t i = 0; i < count; i++) {
        const float row[MODEL_COLUMNS] = {(float)i, 1,  5,  0.1f, 0.2f, 0.3f, 1,
                                          -1,       -2, -3, 1,    0.1f, 0.2f, 0.3f};
        memcpy(rows[i], row, sizeof row);
    }
    for (size_t column = 0; column < MODEL_COLUMNS; column++)
        for (size_t v = 0; v < BAD_VALUES && s->status == GBT_OK; v++) {
            gaussian_cloud cloud;
            const float kept = rows[5][column];
            rows[5][column] = bad_values[v];
            const bool loaded = stability_read_model(s, rows, count, &cloud) == GBT_OK;
            rows[5][column] = kept;
            tries++;
            miscounted += !loaded || cloud.count + cloud.dropped != count;
            bad += stability_bad_in_model(&cloud);
            dropped += cloud.dropped;
            repaired += cloud.identity_rotations + cloud.scales_clamped;
            gaussian_cloud_free(&cloud);
        }
    stability_check(s, "A8c", (double)bad, NAN, "%zu files: %zu rows dropped, %zu repaired.", tries, dropped,
                    repaired);
    stability_check(s, "A8d", (double)miscounted, NAN, "%s", "");
}

gbt_status stability_a8(stability *s)
{
    const size_t count = (size_t)stability_number(s, "gaussians");
    poison_arrays(s, count);
    poison_files(s, count);
    return s->status;
}
