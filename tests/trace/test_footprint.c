/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_footprint.c -- rays with a width: energy, the cases that can be said by hand, the adjoint,
   and the mean over many thin rays. */
#include "test_support.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "base/vec.h"
#include "footprint_one.h"
#include "random_scene.h"
#include "trace/reference.h"

enum { NUMBERS = 11 };

static gbt_camera camera_of(gbt_camera_model model)
{
    gbt_camera c = {.model = model,
                    .width = 64,
                    .height = 48,
                    .params = {80, 80, 32, 24},
                    .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                    .center = {0.3, -0.2, -6}};
    if (model == GBT_CAMERA_EQUIRECTANGULAR) {
        c.params[0] = 64;
        c.params[1] = 48;
    }
    return c;
}

static footprint_gaussian random_gaussian(uint64_t seed)
{
    footprint_gaussian g = {.opacity = 0.2 + 0.7 * (double)rng_uniform(seed, 20, 0)};
    double square = 0;
    for (uint64_t k = 0; k < 3; k++) {
        g.mean[k] = rng_normal(seed, k, 0);
        g.scale[k] = 0.02 * pow(20, (double)rng_uniform(seed, 3 + k, 0));
    }
    for (uint64_t k = 0; k < 4; k++) {
        g.quat[k] = rng_normal(seed, 6 + k, 0);
        square += g.quat[k] * g.quat[k];
    }
    for (int k = 0; k < 4; k++)
        g.quat[k] /= sqrt(square);
    return g;
}

static double footprint_pixel(const footprint_view *view, const double point[3])
{
    double at[3][FOOTPRINT_LANES], pixel[FOOTPRINT_LANES];
    for (int k = 0; k < 3; k++)
        for (int lane = 0; lane < FOOTPRINT_LANES; lane++)
            at[k][lane] = point[k];
    footprint_pixels(view, at, pixel);
    return pixel[0];
}

/* Every number of a Gaussian by its index: mean, scale, quaternion, opacity. */
static double *number_of(footprint_gaussian *g, int i)
{
    return i < 3 ? &g->mean[i] : i < 6 ? &g->scale[i - 3] : i < 10 ? &g->quat[i - 6] : &g->opacity;
}

static void test_sizes(void **state)
{
    (void)state;
    gbt_camera c = camera_of(GBT_CAMERA_PINHOLE);
    footprint_view view = footprint_view_of(&c);
    assert_true(fabs(footprint_pixel(&view, (double[]){0.3, -0.2, 2}) - 8 / 80.0) < 1e-12);
    /* 45 degrees off the axis at distance t: t cos^(3/2) / f */
    assert_true(fabs(footprint_pixel(&view, (double[]){2.3, -0.2, -4}) - sqrt(8) * pow(0.5, 0.75) / 80) <
                1e-12);
    /* mirrored behind; at the side no less than at 75.5 degrees */
    assert_true(fabs(footprint_pixel(&view, (double[]){2.3, -0.2, -8}) - sqrt(8) * pow(0.5, 0.75) / 80) <
                1e-12);
    assert_true(fabs(footprint_pixel(&view, (double[]){8.3, -0.2, -6}) - 8 * 0.125 / 80) < 1e-12);
    assert_true(footprint_pixel(&view, c.center) == 0);
    c = camera_of(GBT_CAMERA_ORTHOGRAPHIC);
    view = footprint_view_of(&c);
    assert_true(fabs(footprint_pixel(&view, (double[]){5, 5, 100}) - 1 / 80.0) < 1e-12);
    c = camera_of(GBT_CAMERA_OPENCV_FISHEYE);
    view = footprint_view_of(&c);
    assert_true(fabs(footprint_pixel(&view, (double[]){0.3, 3.8, -6}) - 4 / 80.0) < 1e-12); /* 90 degrees off
                                                                                               the axis */
    c.params[0] = NAN;
    view = footprint_view_of(&c);
    assert_true(footprint_pixel(&view, (double[]){0, 0, 1}) == 0);
    c = camera_of(GBT_CAMERA_EQUIRECTANGULAR);
    c.params[0] = c.width = 200; /* as a picture of 200 x 100: a pixel is 1.8 degrees wide and high */
    c.params[1] = c.height = 100;
    view = footprint_view_of(&c);
    const double *down = c.rotation + 3, *ahead = c.rotation + 6;
    for (int degrees = -90; degrees <= 90; degrees += 30) { /* of latitude: columns are closer */
        const double angle = degrees * acos(-1.0) / 180, level = fmax(cos(angle), 0);
        double at[3];
        for (int k = 0; k < 3; k++)
            at[k] = c.center[k] + 4 * (level * ahead[k] + sin(angle) * down[k]);
        assert_true(fabs(footprint_pixel(&view, at) - 4 * acos(-1.0) / 100 * sqrt(level)) < 1e-7);
    }
}

/* Points at once are points one by one. */
static void test_lanes(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_ORTHOGRAPHIC,
                                              GBT_CAMERA_OPENCV_FISHEYE, GBT_CAMERA_EQUIRECTANGULAR};
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        const gbt_camera c = camera_of(models[m]);
        const footprint_view view = footprint_view_of(&c);
        double point[3][FOOTPRINT_LANES], pixel[FOOTPRINT_LANES];
        for (uint64_t lane = 0; lane < FOOTPRINT_LANES; lane++)
            for (uint64_t k = 0; k < 3; k++)
                point[k][lane] = 5 * rng_normal(m, lane, (uint32_t)k);
        footprint_pixels(&view, point, pixel);
        for (int lane = 0; lane < FOOTPRINT_LANES; lane++)
            assert_true(pixel[lane] ==
                        footprint_pixel(&view, (double[]){point[0][lane], point[1][lane], point[2][lane]}));
    }
}

/* A ball of std-dev s on the axis keeps o s^2; a disc seen flat keeps its area, seen edge-on only its width
   grows. */
static void test_energy(void **state)
{
    (void)state;
    const gbt_camera c = camera_of(GBT_CAMERA_PINHOLE);
    const footprint_view view = footprint_view_of(&c);
    const double pixel = 6 / 80.0, w = 0.1 * pixel * pixel;
    footprint_gaussian ball = {
        .mean = {0.3, -0.2, 0}, .scale = {0.02, 0.02, 0.02}, .quat = {1, 0, 0, 0}, .opacity = 0.8};
    footprint_widen(&view, 0.1, 0, &ball);
    assert_true(fabs(ball.scale[0] * ball.scale[0] - (4e-4 + w)) < 1e-15);
    assert_true(fabs(ball.opacity * (4e-4 + w) - 0.8 * 4e-4) < 1e-15);
    footprint_gaussian flat = {.mean = {0.3, -0.2, 0},
                               .scale = {0.5, 0.25, 0},
                               .quat = {1, 0, 0, 0},
                               .opacity = 0.8},
                       edge = flat;
    footprint_widen(&view, 0.1, 0, &flat);
    assert_true(fabs(flat.opacity - 0.8 * 0.125 / sqrt((0.25 + w) * (0.0625 + w))) < 1e-12);
    edge.quat[0] = edge.quat[1] = sqrt(0.5); /* its normal along y */
    footprint_widen(&view, 0.1, 0, &edge);
    assert_true(edge.opacity < 1e-12); /* no area across the ray before, so nothing to keep */
    footprint_gaussian point = {.mean = {0, 0, 1}, .quat = {1, 0, 0, 0}, .opacity = 1};
    footprint_widen(&view, 0.1, 0, &point);
    assert_true(point.opacity == 0 && point.scale[0] > 0);
}

/* Without a width nothing changes; a pixel counts as no smaller than the smallest that the Gaussian was made
   for. */
static void test_limits(void **state)
{
    (void)state;
    const gbt_camera c = camera_of(GBT_CAMERA_PINHOLE);
    const footprint_view view = footprint_view_of(&c);
    footprint_gaussian g = random_gaussian(5), same = g, held = g, far = g;
    footprint_widen(&view, 0, 0.5, &same);
    for (int i = 0; i < NUMBERS; i++)
        assert_true(fabs(*number_of(&same, i) - *number_of(&g, i)) <= 1e-16);
    const double pixel = footprint_pixel(&view, g.mean);
    footprint_widen(&view, 0.1, 3 * pixel, &held);
    footprint_widen(&view, 0.9, 0.5 * pixel, &far); /* 3^2 */
    for (int i = 0; i < NUMBERS; i++)
        assert_true(fabs(*number_of(&held, i) - *number_of(&far, i)) <= 1e-14);
}

static const float checked_variance = 0.3f;

static double loss_of(const footprint_view *view, double pixel_min, footprint_gaussian g,
                      const footprint_gaussian *weights)
{
    double sum = 0;
    footprint_gaussian w = *weights;
    const double norm =
        sqrt(g.quat[0] * g.quat[0] + g.quat[1] * g.quat[1] + g.quat[2] * g.quat[2] + g.quat[3] * g.quat[3]);
    for (int k = 0; k < 4; k++)
        g.quat[k] /= norm;
    footprint_widen(view, (double)checked_variance, pixel_min, &g);
    for (int i = 0; i < NUMBERS; i++)
        if (i < 6 || i >= 10)
            sum += *number_of(&g, i) * *number_of(&w, i);
    return sum;
}

/* Against central differences, relative to the largest gradient. Through a normalised quaternion, so that the
   tangent is what is compared. */
static void test_adjoint(void **state)
{
    (void)state;
    const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_OPENCV_FISHEYE, GBT_CAMERA_ORTHOGRAPHIC,
                                       GBT_CAMERA_EQUIRECTANGULAR};
    for (uint64_t seed = 0; seed < 40; seed++) {
        const gbt_camera c = camera_of(models[seed % 4]);
        const footprint_view view = footprint_view_of(&c);
        footprint_gaussian g = random_gaussian(seed), weights = random_gaussian(seed + 100);
        g.mean[2] -= seed % 16 == 8 ? 12 : 0; /* behind a pinhole */
        for (int i = 0; i < NUMBERS; i++)
            *number_of(&g, i) = (double)(float)*number_of(&g, i);
        const double pixel_min = seed % 8 >= 4 ? (double)(float)(2 * footprint_pixel(&view, g.mean)) : 0;
        footprint_gaussian d = weights;
        memset(d.quat, 0, sizeof d.quat);
        assert_ok(footprint_adjoint(&view, checked_variance, (float)pixel_min, &g, &d));
        double worst = 0, largest = 0;
        for (int i = 0; i < NUMBERS; i++) {
            const double h = 1e-6;
            footprint_gaussian up = g, down = g;
            *number_of(&up, i) += h;
            *number_of(&down, i) -= h;
            const double slope =
                (loss_of(&view, pixel_min, up, &weights) - loss_of(&view, pixel_min, down, &weights)) /
                (2 * h);
            worst = fmax(worst, fabs(slope - *number_of(&d, i)));
            largest = fmax(largest, fabs(slope));
        }
        assert_true(worst <= 1e-6 * largest);
    }
}

/* The picture of one faint Gaussian with a width is the mean of many pictures without, spread over the
   pixel. */
static void test_mean_over_pixel(void **state)
{
    (void)state;
    enum { SIDE = 12, SHIFTS = 24 };
    gbt_camera c = {.model = GBT_CAMERA_PINHOLE,
                    .width = SIDE,
                    .height = SIDE,
                    .params = {40, 40, 6, 6},
                    .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                    .center = {0, 0, -6}};
    gaussians g = random_gaussians(1, 0, 3), wide = {0};
    g.mean_x[0] = g.mean_y[0] = g.mean_z[0] = 0.02f;
    g.scale_x[0] = 0.03f;
    g.scale_y[0] = 0.25f;
    g.scale_z[0] = 0.06f;
    g.opacity[0] = 0.2f;
    const footprint_view view = footprint_view_of(&c);
    const float variance = 1 / 12.0f; /* of the square pixel */
    assert_ok(footprint_forward(&view, variance, NULL, &g, &wide, NULL));
    trace_settings s = trace_settings_default();
    s.alpha_min = 1e-9f;
    ray_image rays = {0};
    double mean[SIDE * SIDE] = {0}, rgb[SIDE * SIDE * 3], left[SIDE * SIDE], worst = 0, unfiltered = 0;
    for (int j = 0; j < SHIFTS * SHIFTS; j++) {
        c.params[2] = 6 + (j % SHIFTS + 0.5) / SHIFTS - 0.5;
        c.params[3] = 6 + (j / SHIFTS + 0.5) / SHIFTS - 0.5;
        assert_ok(ray_image_from_camera(&c, &rays, NULL));
        assert_ok(reference_forward(&g, &s, &rays, rgb, left, NULL, NULL));
        for (int i = 0; i < SIDE * SIDE; i++)
            mean[i] += (1 - left[i]) / (SHIFTS * SHIFTS);
    }
    c.params[2] = c.params[3] = 6;
    assert_ok(ray_image_from_camera(&c, &rays, NULL));
    assert_ok(reference_forward(&wide, &s, &rays, rgb, left, NULL, NULL));
    for (int i = 0; i < SIDE * SIDE; i++)
        worst = fmax(worst, fabs(1 - left[i] - mean[i]));
    assert_ok(reference_forward(&g, &s, &rays, rgb, left, NULL, NULL));
    for (int i = 0; i < SIDE * SIDE; i++)
        unfiltered = fmax(unfiltered, fabs(1 - left[i] - mean[i]));
    assert_true(unfiltered > 0.02); /* the case is one where a width matters */
    assert_true(worst < 0.05 * unfiltered);
    ray_image_free(&rays);
    gaussians_free(&g);
    gaussians_free(&wide);
}

/* The arrays are the single ones, for any number of threads; colours and means pass. */
static void test_arrays(void **state)
{
    (void)state;
    const gbt_camera c = camera_of(GBT_CAMERA_PINHOLE);
    const footprint_view view = footprint_view_of(&c);
    gaussians g = random_gaussians(3001, 0.1f, 9), out = {0}, d = random_gaussians(3001, 0.1f, 10),
              d1 = random_gaussians(3001, 0.1f, 10);
    float *pixel_min = calloc(g.count, sizeof *pixel_min);
    for (size_t i = 0; i < g.count; i++)
        pixel_min[i] = 0.2f * rng_uniform(1, 2, i);
    parallel_set_threads(2);
    assert_ok(footprint_forward(&view, 0.1f, pixel_min, &g, &out, NULL));
    footprint_backward(&view, 0.1f, pixel_min, &g, &d);
    parallel_set_threads(1);
    footprint_backward(&view, 0.1f, pixel_min, &g, &d1);
#define X(name, pad, meaning) assert_memory_equal(d.name, d1.name, d.count * sizeof *d.name);
    GAUSSIANS_FIELDS(X)
#undef X
    for (size_t i = 0; i < g.count; i += 97) {
        footprint_gaussian one = {
            .mean = {(double)g.mean_x[i], (double)g.mean_y[i], (double)g.mean_z[i]},
            .scale = {(double)g.scale_x[i], (double)g.scale_y[i], (double)g.scale_z[i]},
            .quat = {(double)g.quat_w[i], (double)g.quat_x[i], (double)g.quat_y[i], (double)g.quat_z[i]},
            .opacity = (double)g.opacity[i]};
        footprint_widen(&view, (double)0.1f, (double)pixel_min[i], &one);
        assert_true(out.scale_y[i] == (float)one.scale[1] && out.opacity[i] == (float)one.opacity);
        assert_true(out.mean_x[i] == g.mean_x[i] && out.quat_z[i] == g.quat_z[i] && out.red[i] == g.red[i]);
    }
    free(pixel_min);
    gaussians_free(&g);
    gaussians_free(&out);
    gaussians_free(&d);
    gaussians_free(&d1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sizes),   cmocka_unit_test(test_lanes),
                                       cmocka_unit_test(test_energy),  cmocka_unit_test(test_limits),
                                       cmocka_unit_test(test_adjoint), cmocka_unit_test(test_mean_over_pixel),
                                       cmocka_unit_test(test_arrays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
