/* SPDX-License-Identifier: Apache-2.0 */
/* tests/raster/test_per_ray.c -- the per-ray form against the tracer and the tracer's double reference,
   forward and back. */
#include "base/near.h"
#include "data/gaussian_file.h"
#include "raster/raster_support.h"
#include "trace/reference_once.h"
#include "trace/trace.h"

static const cloud_def clouds[] = {
    RASTER_CLOUDS(30),
    {"large, eye in the middle of them", 60, 0.5f, 0.3f, 2, 1, {0.1, 0.1, -0.1}, 48, 48},
    {"800 in one place", 800, 0.1f, 0.2f, 0.6f, 1, {0, 0, -4}, 17, 15},
};

/* The same numbers for both: default cuts, a background that is seen. */
static raster_settings settings_of(trace_settings *traced)
{
    raster_settings s = raster_settings_default();
    *traced = trace_settings_default();
    s.form = RASTER_PER_RAY;
    s.near = traced->t_near;
    for (int c = 0; c < 3; c++)
        s.background[c] = traced->background[c] = 0.2f + 0.3f * (float)c;
    s.sky.varies = true;
    for (int k = 0; k < 3 * SKY_HARMONICS; k++)
        s.sky.harmonic[k / 3][k % 3] = 0.1f * cosf(1.7f * (float)k);
    traced->sky = s.sky;
    return s;
}

static float reach_of(const gbt_camera *camera)
{
    return (float)(fabs(camera->center[0]) + fabs(camera->center[1]) + fabs(camera->center[2]));
}

typedef struct traced {
    image rgb;
    gaussians d;
} traced;

/* Without `d_rgb` the picture alone. */
static traced trace_view(const gaussians *g, const gbt_camera *camera, const trace_settings *s,
                         const image *d_rgb)
{
    traced out = {0};
    trace_scene scene = {0};
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(camera, &rays, NULL));
    assert_ok(image_alloc(&out.rgb, camera->width, camera->height, 3, NULL));
    assert_ok(trace_build(&scene, g, s, reach_of(camera), NULL));
    assert_ok(trace_forward(&scene, &rays, d_rgb != NULL, &(trace_outputs){.rgb = &out.rgb}, NULL, NULL));
    if (d_rgb != NULL)
        assert_ok(trace_backward(&scene, &rays, d_rgb, &out.d, NULL, NULL));
    trace_scene_free(&scene);
    ray_image_free(&rays);
    return out;
}

static void traced_free(traced *t)
{
    image_free(&t->rgb);
    gaussians_free(&t->d);
}

/* Relative L2 error of fields [first, end). */
static double field_error(const gaussians *got, const gaussians *wanted, int first, int end)
{
    float *f[GAUSSIANS_FIELD_COUNT], *w[GAUSSIANS_FIELD_COUNT];
    double off = 0, all = 1e-30;
    field_list(got, f);
    field_list(wanted, w);
    for (int k = first; k < end; k++)
        for (size_t i = 0; i < wanted->count; i++) {
            off += pow((double)f[k][i] - (double)w[k][i], 2);
            all += pow((double)w[k][i], 2);
        }
    return sqrt(off / all);
}

/* A pixel differs by 1e-5 at most, but for those whose ray has a response, a T or two depths within rounding
   of a cut: those are few, and `d_rgb` becomes 0 there, so that gradients can be compared. */
static void compare_images(const char *what, const image *got, const image *wanted, image *d_rgb)
{
    const size_t floats = 3 * (size_t)wanted->width * (size_t)wanted->height;
    size_t off = 0;
    double largest = 0, square = 0;
    for (size_t i = 0; i < floats; i++) {
        const double difference = fabs((double)got->pixels[i] - (double)wanted->pixels[i]);
        assert_true(isfinite(difference));
        if (difference > 1e-5) {
            off++;
            for (size_t c = 0; c < 3 && d_rgb != NULL; c++)
                d_rgb->pixels[i / 3 * 3 + c] = 0;
        } else {
            largest = fmax(largest, difference);
            square += difference * difference;
        }
    }
    const double psnr = square > 0 ? -10 * log10(square / (double)floats) : 200;
    print_message("%s: %zu of %zu values beyond 1e-5, the others within %.1e, %.1f dB\n", what, off, floats,
                  largest, psnr);
    if (!(psnr >= 100) || off > floats / 200)
        fail_msg("%s: %.1f dB, %zu values beyond 1e-5", what, psnr, off);
}

static void agrees_with_the_tracer(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++) {
        trace_settings traced_settings;
        const raster_settings s = settings_of(&traced_settings);
        gaussians g = make_cloud(&clouds[i], 80 + i);
        const gbt_camera camera = make_camera(clouds[i].width, clouds[i].height, clouds[i].camera);
        image d_rgb = random_image(camera.width, camera.height, i);
        traced seen = trace_view(&g, &camera, &traced_settings, NULL);
        drawn shown = draw(&g, &camera, &s, NULL);
        compare_images(clouds[i].name, &shown.rgb, &seen.rgb, &d_rgb);
        traced_free(&seen);
        drawn_free(&shown);
        traced wanted = trace_view(&g, &camera, &traced_settings, &d_rgb);
        drawn got = draw(&g, &camera, &s, &d_rgb);
        const double error[] = {field_error(&got.d, &wanted.d, FIELD_MEAN, FIELD_SCALE),
                                field_error(&got.d, &wanted.d, FIELD_SCALE, FIELD_QUAT),
                                field_error(&got.d, &wanted.d, FIELD_QUAT, FIELD_OPACITY),
                                field_error(&got.d, &wanted.d, FIELD_OPACITY, FIELD_COLOR),
                                field_error(&got.d, &wanted.d, FIELD_COLOR, GAUSSIANS_FIELD_COUNT)};
        print_message("  gradients: mean %.1e, scale %.1e, rotation %.1e, opacity %.1e, colour %.1e\n",
                      error[0], error[1], error[2], error[3], error[4]);
        for (size_t k = 0; k < sizeof error / sizeof *error; k++)
            if (!(error[k] <= 1e-3))
                fail_msg("%s: gradients of class %zu off by %g", clouds[i].name, k, error[k]);
        traced_free(&wanted);
        drawn_free(&got);
        image_free(&d_rgb);
        gaussians_free(&g);
    }
}

/* A sheet a thousand times as wide as it is thick, seen slantwise: turning it moves its thin axis, along
   which float32 has few digits. */
static void a_thin_sheet_keeps_its_gradients(void **state)
{
    (void)state;
    trace_settings traced_settings;
    const raster_settings s = settings_of(&traced_settings);
    const cloud_def def = {"sheet", 1, 0, 26, 26.0001f, 1, {20, -25, -40}, 40, 30};
    const gbt_camera camera = make_camera(def.width, def.height, def.camera);
    double worst = 0;
    for (uint64_t seed = 0; seed < 20; seed++) {
        gaussians g = make_cloud(&def, 90 + seed);
        g.scale_x[0] = 0.0266f;
        g.scale_z[0] = 4;
        g.opacity[0] = 0.5f;
        image d_rgb = random_image(camera.width, camera.height, seed);
        const size_t floats = 3 * (size_t)camera.width * (size_t)camera.height;
        double *d = mem_alloc(floats, sizeof *d, "test", NULL), wanted[GAUSSIANS_FIELD_COUNT] = {0}, off = 0,
               all = 0;
        for (size_t i = 0; i < floats; i++)
            d[i] = (double)d_rgb.pixels[i];
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        assert_ok(reference_backward(&g, &traced_settings, &rays, d, NULL, wanted, NULL));
        drawn got = draw(&g, &camera, &s, &d_rgb);
        float *f[GAUSSIANS_FIELD_COUNT];
        field_list(&got.d, f);
        for (int k = FIELD_QUAT; k < FIELD_OPACITY; k++) {
            off += pow((double)f[k][0] - wanted[k], 2);
            all += pow(wanted[k], 2);
        }
        worst = fmax(worst, sqrt(off / all));
        drawn_free(&got);
        mem_free(d);
        ray_image_free(&rays);
        image_free(&d_rgb);
        gaussians_free(&g);
    }
    print_message("rotation of a sheet 1:1000, worst of 20: %.1e\n", worst);
    assert_true(worst <= 1e-4);
}

/* A 3DGS model as exporters write it, with its camera; colours by degree 0. */
static void peer_scene_agrees(void **state)
{
    (void)state;
    const char *path = shared_path("peer/match1500/scene.ply");
    gaussian_cloud cloud;
    if (path == NULL)
        skip();
    assert_ok(gaussian_file_read(path, &cloud, NULL));
    gaussians g = gaussians_of_cloud(&cloud, 1);
    trace_settings traced_settings;
    const raster_settings s = settings_of(&traced_settings);
    gbt_camera camera = make_camera(256, 256, (const double[3]){0, -38, 9});
    camera.params[0] = camera.params[1] = 128 / tan(19 * 3.14159265358979 / 180);
    camera.params[2] = camera.params[3] = 128;
    traced wanted = trace_view(&g, &camera, &traced_settings, NULL);
    drawn got = draw(&g, &camera, &s, NULL);
    compare_images("match1500", &got.rgb, &wanted.rgb, NULL);
    traced_free(&wanted);
    drawn_free(&got);
    gaussian_cloud_free(&cloud);
    gaussians_free(&g);
}

/* In the order of the centres all else is the same: with one Gaussian nothing changes, with crossing ones
   something does. */
static void order_by_center(void **state)
{
    (void)state;
    for (size_t count = 1; count <= 200; count += 199) {
        const cloud_def def = {"order", count, 0.4f, 0.2f, 0.8f, 1, {1, 0.5, -4}, 40, 40};
        trace_settings traced_settings;
        raster_settings s = settings_of(&traced_settings), by_center;
        gaussians g = make_cloud(&def, 3);
        s.transmittance_min = 1e-30f; /* so that no pixel stops */
        for (size_t i = 0; i < g.count; i++)
            g.opacity[i] *= 0.3f;
        by_center = s;
        by_center.order_by_center = true;
        const gbt_camera camera = make_camera(def.width, def.height, def.camera);
        drawn a = draw(&g, &camera, &s, NULL), b = draw(&g, &camera, &by_center, NULL);
        const bool same = memcmp(a.rgb.pixels, b.rgb.pixels, 3 * 1600 * sizeof(float)) == 0;
        assert_int_equal(same, count == 1);
        /* What is left for the background is a product of the same numbers in another order. */
        for (size_t i = 0; i < 1600; i++)
            assert_near((double)b.T[i], (double)a.T[i], 1e-5 * (double)a.T[i]);
        drawn_free(&a);
        drawn_free(&b);
        gaussians_free(&g);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_the_tracer),
        cmocka_unit_test(a_thin_sheet_keeps_its_gradients),
        cmocka_unit_test(peer_scene_agrees),
        cmocka_unit_test(order_by_center),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
