/* SPDX-License-Identifier: Apache-2.0 */
/* command/doctor_self_test.c -- trace a small cloud and its gradients, compare them with the double-precision
   references, and time the tracer on a larger cloud. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"
#include "command/doctor.h"
#include "trace/rounding_band.h"
#include "trace/reference.h"
#include "trace/trace.h"

enum {
    SMALL = 1500,
    LARGE = 30000,
    SMALL_WIDTH = 64,
    SMALL_HEIGHT = 48,
    LARGE_SIDE = 256,
    PASSES = 3,
    STREAM_PLACE = 1,
    STREAM_GRADIENT = 2
};

/* Away from cut-offs, a float image differs from the reference only by the rounding of its sums. The tests
   apply the same limits to random scenes. */
static const double picture_limit = 1e-4, gradient_limit = 5e-5;

typedef struct self_test {
    gaussians g, d_gaussians;
    trace_scene scene;
    trace_settings settings;
    ray_image rays;
    image rgb, d_rgb;
    bool *in_band;
    double *wanted, *d_wanted, *d_exact; /* [rays][3], [fields][count], [rays][3] */
} self_test;

/* Flat and round Gaussians in the unit ball, the same on every machine. */
static gbt_status make_cloud(gaussians *g, size_t count, double size, gbt_error *err)
{
    GBT_TRY(gaussians_resize(g, count, err));
    for (size_t i = 0; i < count; i++) {
        double p[3], q[4], length = 0;
        for (unsigned k = 0; k < 3; k++)
            p[k] = 0.5 * rng_normal(STREAM_PLACE, i, k);
        for (unsigned k = 0; k < 4; k++) {
            q[k] = rng_normal(STREAM_PLACE, i, 3 + k);
            length += q[k] * q[k];
        }
        length = sqrt(length);
        g->mean_x[i] = (float)p[0];
        g->mean_y[i] = (float)p[1];
        g->mean_z[i] = (float)p[2];
        g->quat_w[i] = (float)(q[0] / length);
        g->quat_x[i] = (float)(q[1] / length);
        g->quat_y[i] = (float)(q[2] / length);
        g->quat_z[i] = (float)(q[3] / length);
        g->scale_x[i] = (float)(size * exp(0.3 * rng_normal(STREAM_PLACE, i, 7)));
        g->scale_y[i] = (float)(size * exp(0.3 * rng_normal(STREAM_PLACE, i, 8)));
        g->scale_z[i] = (float)(0.3 * size);
        g->opacity[i] = (float)(0.5 + 0.4 * sin((double)i));
        g->red[i] = (float)(0.5 + 0.5 * sin(0.37 * (double)i));
        g->green[i] = (float)(0.5 + 0.5 * sin(0.61 * (double)i + 1));
        g->blue[i] = (float)(0.5 + 0.5 * sin(0.93 * (double)i + 2));
    }
    gaussians_pad(g);
    return GBT_OK;
}

static gbt_status set_up(self_test *p, size_t count, double size, int width, int height, gbt_error *err)
{
    const gbt_camera camera = {.model = GBT_CAMERA_SIMPLE_PINHOLE,
                               .width = width,
                               .height = height,
                               .params = {width, 0.5 * width, 0.5 * height},
                               .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                               .center = {0, 0, -3}};
    p->settings = trace_settings_default();
    GBT_TRY(make_cloud(&p->g, count, size, err));
    GBT_TRY(ray_image_from_camera(&camera, &p->rays, err));
    GBT_TRY(image_fit(&p->rgb, width, height, 3, err));
    return trace_build(&p->scene, &p->g, &p->settings, ray_image_reach(&p->rays), err);
}

static gbt_status find_band(self_test *p, const reference_scene *exact, size_t *left_out, gbt_error *err)
{
    const size_t rays = ray_image_count(&p->rays);
    *left_out = 0;
    memset(p->in_band, true, rays);
    GBT_TRY(rounding_band_find(exact, &p->settings, &p->rays, p->in_band, err));
    for (size_t i = 0; i < rays; i++)
        *left_out += p->in_band[i];
    return GBT_OK;
}

void doctor_compare(gbt_diagnosis *d, const char *name, const char *what, double error, double limit,
                    size_t rays, size_t left_out)
{
    gbt_check *c = doctor_line(d, name);
    snprintf(
        c->found, sizeof c->found,
        "%d Gaussians, %zu rays (%zu at a cut-off left out): %s %.1e from the double reference (limit %.0e)",
        (int)SMALL, rays, left_out, what, error, limit);
    if (!(error <= limit) || left_out > rays / 2) {
        c->level = GBT_CHECK_FAIL;
        snprintf(c->advice, sizeof c->advice,
                 "do not use this build; try GBT_ISA=avx2 or GBT_ISA=plain, and report it");
    }
}

static gbt_status compare_pictures(self_test *p, const reference_scene *exact, gbt_diagnosis *d,
                                   gbt_error *err)
{
    const trace_outputs out = {.rgb = &p->rgb};
    const size_t rays = ray_image_count(&p->rays);
    size_t left_out;
    double worst = 0;
    GBT_TRY(find_band(p, exact, &left_out, err));
    GBT_TRY(trace_forward(&p->scene, &p->rays, true, &out, NULL, err));
    GBT_TRY(reference_scene_forward(exact, &p->settings, &p->rays, p->wanted, NULL, NULL, err));
    for (size_t i = 0; i < 3 * rays; i++)
        if (!p->in_band[i / 3]) {
            const double error = fabs((double)p->rgb.pixels[i] - p->wanted[i]);
            worst = error <= worst ? worst : error; /* the comparison keeps a NaN */
        }
    doctor_compare(d, "tracer", "largest error", worst, picture_limit, rays, left_out);
    return GBT_OK;
}

static gbt_status compare_gradients(self_test *p, const reference_scene *exact, gbt_diagnosis *d,
                                    gbt_error *err)
{
    const size_t rays = ray_image_count(&p->rays);
    size_t left_out = 0;
    double square = 0, wanted_square = 0;
    for (size_t i = 0; i < 3 * rays; i++) {
        p->d_rgb.pixels[i] = p->in_band[i / 3] ? 0 : (float)rng_normal(STREAM_GRADIENT, i, 0);
        p->d_exact[i] = (double)p->d_rgb.pixels[i];
        left_out += i % 3 == 0 && p->in_band[i / 3];
    }
    GBT_TRY(trace_backward(&p->scene, &p->rays, &p->d_rgb, &p->d_gaussians, NULL, err));
    GBT_TRY(reference_scene_backward(exact, &p->settings, &p->rays, p->d_exact, NULL, p->d_wanted, err));
    const float *const fields[] = {
#define X(name, pad, meaning) p->d_gaussians.name,
        GAUSSIANS_FIELDS(X)
#undef X
    };
    for (size_t f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        for (size_t i = 0; i < p->g.count; i++) {
            const double wanted = p->d_wanted[f * p->g.count + i], error = (double)fields[f][i] - wanted;
            square += error * error;
            wanted_square += wanted * wanted;
        }
    doctor_compare(d, "gradients", "relative error", sqrt(square / wanted_square), gradient_limit, rays,
                   left_out);
    return GBT_OK;
}

static gbt_status check_exactness(self_test *p, gbt_diagnosis *d, gbt_error *err)
{
    GBT_TRY(set_up(p, SMALL, 0.06, SMALL_WIDTH, SMALL_HEIGHT, err));
    const size_t rays = ray_image_count(&p->rays);
    GBT_TRY(image_fit(&p->d_rgb, SMALL_WIDTH, SMALL_HEIGHT, 3, err));
    p->in_band = mem_calloc(rays, sizeof *p->in_band, "self test", err);
    p->wanted = mem_calloc(rays, 3 * sizeof *p->wanted, "self test", err);
    p->d_exact = mem_calloc(rays, 3 * sizeof *p->d_exact, "self test", err);
    p->d_wanted = mem_calloc(SMALL, GAUSSIANS_FIELD_COUNT * sizeof *p->d_wanted, "self test", err);
    if (p->in_band == NULL || p->wanted == NULL || p->d_exact == NULL || p->d_wanted == NULL)
        return GBT_ERR_NO_MEMORY;
    reference_scene exact = {0};
    gbt_status status = reference_scene_make(&p->g, &exact, err);
    if (status == GBT_OK)
        status = compare_pictures(p, &exact, d, err);
    if (status == GBT_OK)
        status = compare_gradients(p, &exact, d, err);
    reference_scene_free(&exact);
    return status;
}

static gbt_status measure_speed(self_test *p, gbt_diagnosis *d, gbt_error *err)
{
    const trace_outputs out = {.rgb = &p->rgb};
    double best = (double)INFINITY;
    GBT_TRY(set_up(p, LARGE, 0.03, LARGE_SIDE, LARGE_SIDE, err));
    for (int i = 0; i <= PASSES; i++) { /* the first pass is a warm-up */
        const double start = clock_wall();
        GBT_TRY(trace_forward(&p->scene, &p->rays, false, &out, NULL, err));
        best = i > 0 ? fmin(best, clock_wall() - start) : best;
    }
    gbt_check *c = doctor_line(d, "speed");
    snprintf(c->found, sizeof c->found, "%.2f million rays per second through %d Gaussians, %d x %d pixels",
             (double)ray_image_count(&p->rays) / best * 1e-6, (int)LARGE, (int)LARGE_SIDE, (int)LARGE_SIDE);
    return GBT_OK;
}

gbt_status doctor_self_test(gbt_diagnosis *d, gbt_error *err)
{
    self_test p = {0};
    gbt_status status = check_exactness(&p, d, err);
    if (status == GBT_OK)
        status = measure_speed(&p, d, err);
    trace_scene_free(&p.scene);
    gaussians_free(&p.g);
    gaussians_free(&p.d_gaussians);
    ray_image_free(&p.rays);
    image_free(&p.rgb);
    image_free(&p.d_rgb);
    mem_free(p.in_band);
    mem_free(p.wanted);
    mem_free(p.d_exact);
    mem_free(p.d_wanted);
    return status;
}
