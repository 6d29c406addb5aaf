/* SPDX-License-Identifier: Apache-2.0 */
/* tests/raster/test_raster.c -- values known by hand, what is not drawn, sizes, threads, instruction sets,
   failures: both forms. */
#include "base/cpu.h"
#include "base/near.h"
#include "base/parallel.h"
#include "raster/raster_support.h"

static gbt_camera plain_camera(int width, int height)
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = width,
                        .height = height,
                        .params = {100, 100, 0.5 * width, 0.5 * height},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

/* Round, red, of size 0.1, at depth 10: 1 pixel wide on the image. */
static gaussians ball(double x, double y, double z, float opacity)
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, 1, NULL));
    gaussians_zero(&g);
    gaussians_pad(&g);
    g.mean_x[0] = (float)x;
    g.mean_y[0] = (float)y;
    g.mean_z[0] = (float)z;
    g.scale_x[0] = g.scale_y[0] = g.scale_z[0] = 0.1f;
    g.quat_w[0] = 1;
    g.opacity[0] = opacity;
    g.red[0] = 1;
    return g;
}

static raster_settings form_settings(int form)
{
    raster_settings s = raster_settings_default();
    s.form = form == 0 ? RASTER_EWA : RASTER_PER_RAY;
    if (form == 1)
        s.near = 0.01f;
    return s;
}

static double red_at(const gaussians *g, const gbt_camera *camera, const raster_settings *s, int x, int y)
{
    drawn got = draw(g, camera, s, NULL);
    const double red = (double)got.rgb.pixels[3 * (y * camera->width + x)];
    drawn_free(&got);
    return red;
}

/* Variance on the image: (0.1 * 100 / 10)^2 + 0.3 = 1.3 px^2. The centre is between pixels in an image of
   even size. */
static void one_gaussian_by_hand(void **state)
{
    (void)state;
    const raster_settings s = form_settings(0);
    const gbt_camera odd = plain_camera(33, 33);
    gaussians g = ball(0, 0, 10, 0.5f);
    assert_near(red_at(&g, &odd, &s, 16, 16), 0.5, 1e-7);
    assert_near(red_at(&g, &odd, &s, 17, 16), 0.5 * exp(-0.5 / 1.3), 1e-7);
    assert_near(red_at(&g, &odd, &s, 15, 17), 0.5 * exp(-1.0 / 1.3), 1e-7);
    const gbt_camera even = plain_camera(32, 32);
    assert_near(red_at(&g, &even, &s, 15, 15), 0.5 * exp(-0.25 / 1.3), 1e-7);
    g.opacity[0] = 1; /* cut at alpha_max */
    assert_near(red_at(&g, &odd, &s, 16, 16), 0.99, 1e-7);
    gaussians_free(&g);
}

/* A centre is that of the tracer's rays, a float in each coordinate. */
static void centre_of_the_rays(void **state)
{
    (void)state;
    const cloud_def clouds[] = {RASTER_CLOUDS(20)};
    const cloud_def *def = &clouds[1];
    gaussians g = make_cloud(def, 7);
    gbt_camera exact = make_camera(def->width, def->height, (const double[3]){3.1, -2.2, -5.3}),
               rounded = exact;
    for (int k = 0; k < 3; k++) {
        volatile float as_float = (float)exact.center[k];
        rounded.center[k] = (double)as_float;
    }
    for (int form = 0; form < 2; form++) {
        const raster_settings s = form_settings(form);
        drawn a = draw(&g, &exact, &s, NULL), b = draw(&g, &rounded, &s, NULL);
        assert_memory_equal(a.rgb.pixels, b.rgb.pixels,
                            3 * (size_t)(def->width * def->height) * sizeof(float));
        drawn_free(&a);
        drawn_free(&b);
    }
    gaussians_free(&g);
}

/* Along the ray (1, 0, 100) / 100 the nearest point is at sin(angle) * 10 from the centre. */
static void one_ray_by_hand(void **state)
{
    (void)state;
    const raster_settings s = form_settings(1);
    const gbt_camera odd = plain_camera(33, 33);
    gaussians g = ball(0, 0, 10, 0.5f);
    assert_near(red_at(&g, &odd, &s, 16, 16), 0.5, 1e-7);
    const double d2 = 100 * (0.0001 / 1.0001) / 0.01;
    assert_near(red_at(&g, &odd, &s, 17, 16), 0.5 * exp(-0.5 * d2), 1e-7);
    g.mean_z[0] = -0.05f; /* behind the eye, and the eye within it: the response is the one at t_near */
    assert_near(red_at(&g, &odd, &s, 16, 16), 0.5 * exp(-0.5 * 0.36), 1e-6);
    gaussians_free(&g);
}

/* The cut at 3 std-devs is by tiles: radius ceil(3 sqrt(1.3)) = 4 from pixel 16 on, so tile 0 is drawn in and
   tile -1 never is. */
static void three_sigma_goes_by_tiles(void **state)
{
    (void)state;
    raster_settings s = form_settings(0);
    s.alpha_min = 1e-10f;
    const gbt_camera camera = plain_camera(64, 16);
    gaussians g = ball(0, 0, 10, 1);
    g.mean_x[0] = (float)((32.0 - 32.0 + 4.4) * 0.1); /* at pixel 35.9: 4 further is still in tile 2 on the
                                                         left, 39.9 on the right */
    assert_true(red_at(&g, &camera, &s, 32, 7) > 0);
    assert_true(red_at(&g, &camera, &s, 31, 7) > 0); /* 31.9 is in tile 1 */
    g.mean_x[0] = (float)(4.6 * 0.1);                /* at 36.1: 32.1 is in tile 2 */
    assert_true(red_at(&g, &camera, &s, 32, 7) > 0);
    assert_true(red_at(&g, &camera, &s, 31, 7) == 0);
    s.exact_cut = true;
    assert_true(red_at(&g, &camera, &s, 31, 7) > 0);
    gaussians_free(&g);
}

static void stops_before_it_is_dark(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++) {
        raster_settings s = form_settings(form);
        const gbt_camera camera = plain_camera(33, 33);
        gaussians g = {0};
        s.background[2] = 1;
        assert_ok(gaussians_resize(&g, 3, NULL));
        gaussians_zero(&g);
        gaussians_pad(&g);
        for (int i = 0; i < 3; i++) {
            g.mean_z[i] = 10 + (float)i;
            g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 0.1f;
            g.quat_w[i] = 1;
            g.opacity[i] = 1;
        }
        g.red[0] = 1;
        g.green[1] = 1;
        g.red[2] = 1;
        /* T: 1, 0.01, then 1e-4 in float is below 1e-4 or not: 0.01 (1 - 0.99) is decided by rounding, so use
           2e-4 */
        s.transmittance_min = 2e-4f;
        drawn got = draw(&g, &camera, &s, NULL);
        const float *p = got.rgb.pixels + 3 * (16 * 33 + 16);
        assert_near((double)p[0], 0.99, 1e-6);
        assert_true(p[1] == 0);
        assert_near((double)p[2], 0.01, 1e-6);
        assert_near((double)got.T[16 * 33 + 16], 0.01, 1e-6);
        drawn_free(&got);
        gaussians_free(&g);
    }
}

typedef struct hidden_case {
    const char *name;
    double x, y, z;
    bool drawn[2]; /* by form */
} hidden_case;

static const hidden_case hidden_cases[] = {
    {"in front", 0, 0, 10, {true, true}},
    {"behind", 0, 0, -10, {false, false}},
    {"at the near plane", 0, 0, 0.2f, {false, true}},
    {"just beyond it", 0, 0, 0.21, {true, true}},
    {"far to the side", 90, 0, 10, {false, false}},
    {"around the eye", 0.02, 0.02, 0, {false, true}},
    {"beside the eye, out of sight", 3, 0, 0, {false, false}},
};

static void what_is_not_seen(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++)
        for (size_t i = 0; i < sizeof hidden_cases / sizeof *hidden_cases; i++) {
            const hidden_case *c = &hidden_cases[i];
            const raster_settings s = form_settings(form);
            const gbt_camera camera = plain_camera(33, 33);
            gaussians g = ball(c->x, c->y, c->z, 0.8f);
            image d_rgb = random_image(33, 33, 4);
            drawn got = draw(&g, &camera, &s, &d_rgb);
            if ((got.counters.blended > 0) != c->drawn[form])
                fail_msg("%s, form %d: %llu blended", c->name, form,
                         (unsigned long long)got.counters.blended);
            assert_int_equal(got.d.red[0] != 0, c->drawn[form]);
            drawn_free(&got);
            image_free(&d_rgb);
            gaussians_free(&g);
        }
}

/* Each field in turn is not a number, or infinite, or a scale is not positive: the other Gaussian is drawn as
   if alone. */
static void unusable_fields_are_not_drawn(void **state)
{
    (void)state;
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e38f, 0, -1};
    for (int form = 0; form < 2; form++)
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
                const raster_settings s = form_settings(form);
                const gbt_camera camera = plain_camera(20, 20);
                gaussians g = {0};
                float *fields[GAUSSIANS_FIELD_COUNT];
                image d_rgb = random_image(20, 20, 4);
                assert_ok(gaussians_resize(&g, 2, NULL));
                gaussians_zero(&g);
                gaussians_pad(&g);
                field_list(&g, fields);
                for (int i = 0; i < 2; i++) {
                    g.mean_z[i] = 10;
                    g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 0.3f;
                    g.quat_w[i] = 1;
                    g.opacity[i] = 0.5f;
                    g.red[i] = 1;
                }
                fields[f][0] = bad[k];
                drawn got = draw(&g, &camera, &s, &d_rgb);
                float *d[GAUSSIANS_FIELD_COUNT];
                field_list(&got.d, d);
                for (int i = 0; i < 1200; i++)
                    assert_true(isfinite(got.rgb.pixels[i]));
                const bool scale = f >= FIELD_SCALE && f < FIELD_QUAT;
                if (!isfinite(bad[k]) || (scale && bad[k] <= 0)) {
                    assert_int_equal(got.counters.drawn, 1);
                    assert_in_range(got.counters.pairs, 1, 4); /* the picture has two by two tiles */
                }
                for (int j = 0; j < GAUSSIANS_FIELD_COUNT; j++)
                    if (fabsf(bad[k]) < 1e30f)
                        assert_true(isfinite(d[j][1]));
                drawn_free(&got);
                image_free(&d_rgb);
                gaussians_free(&g);
            }
}

static void nothing_to_draw(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++) {
        raster_settings s = form_settings(form);
        const gbt_camera camera = plain_camera(19, 3);
        gaussians g = {0};
        image d_rgb = random_image(19, 3, 8);
        s.background[1] = 0.25f;
        assert_ok(gaussians_resize(&g, 0, NULL));
        gaussians_pad(&g);
        drawn got = draw(&g, &camera, &s, &d_rgb);
        for (size_t i = 0; i < 57; i++)
            assert_true(got.rgb.pixels[3 * i] == 0 && got.rgb.pixels[3 * i + 1] == 0.25f && got.T[i] == 1);
        assert_int_equal(got.d.count, 0);
        drawn_free(&got);
        image_free(&d_rgb);
        gaussians_free(&g);
    }
}

/* A larger image is the smaller one with more around it: pixels outside of the small one neither count nor
   show. */
static void any_size(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {15, 16}, {16, 17}, {17, 15}, {3, 50}, {65, 2}};
    const cloud_def def = {"sizes", 300, 1, 0.05f, 0.5f, 1, {0, 0, -5}, 0, 0};
    gaussians g = make_cloud(&def, 2);
    for (int form = 0; form < 2; form++)
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
            raster_settings s = form_settings(form);
            s.exact_cut = true;
            gbt_camera small = make_camera(80, 80, def.camera), large = small;
            small.width = sizes[i][0];
            small.height = sizes[i][1];
            drawn a = draw(&g, &small, &s, NULL), b = draw(&g, &large, &s, NULL);
            for (int y = 0; y < small.height; y++)
                for (int x = 0; x < small.width; x++)
                    for (int c = 0; c < 3; c++) {
                        /* the limits of J depend on the size of the image: not of a view as narrow as this
                           one */
                        const float in_small = a.rgb.pixels[3 * (y * small.width + x) + c],
                                    in_large = b.rgb.pixels[3 * (y * 80 + x) + c];
                        if (form == 1 && in_small != in_large)
                            fail_msg("%d x %d, pixel %d %d: %g and %g", small.width, small.height, x, y,
                                     (double)in_small, (double)in_large);
                        assert_true(isfinite(in_small));
                    }
            drawn_free(&a);
            drawn_free(&b);
        }
    gaussians_free(&g);
}

/* Both pictures and gradients, bit by bit. */
static void assert_same(const char *what, const drawn *a, const drawn *b)
{
    float *f[2][GAUSSIANS_FIELD_COUNT];
    field_list(&a->d, f[0]);
    field_list(&b->d, f[1]);
    const size_t pixels = (size_t)a->rgb.width * (size_t)a->rgb.height;
    if (memcmp(a->rgb.pixels, b->rgb.pixels, 3 * pixels * sizeof(float)) != 0 ||
        memcmp(a->T, b->T, pixels * sizeof(float)) != 0)
        fail_msg("%s: another picture", what);
    for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
        if (memcmp(f[0][k], f[1][k], a->d.count * sizeof(float)) != 0)
            fail_msg("%s: another gradient of field %d", what, k);
    assert_memory_equal(a->weight, b->weight, a->d.count * sizeof(float));
}

/* Under dL/dred = 1 everywhere a Gaussian's red feels exactly the sum of T alpha. */
static void weights_are_what_colors_feel(void **state)
{
    (void)state;
    const cloud_def def = {"weights", 2000, 1.5f, 0.03f, 0.3f, 5, {1, 0.5, -4}, 60, 50};
    gaussians g = make_cloud(&def, 3);
    const gbt_camera camera = make_camera(def.width, def.height, def.camera);
    image d_rgb;
    assert_ok(image_alloc(&d_rgb, def.width, def.height, 3, NULL));
    for (size_t i = 0; i < 3 * (size_t)def.width * (size_t)def.height; i++)
        d_rgb.pixels[i] = i % 3 == 0;
    for (int form = 0; form < 2; form++) {
        const raster_settings s = form_settings(form);
        drawn d = draw(&g, &camera, &s, &d_rgb);
        size_t seen = 0;
        for (size_t i = 0; i < g.count; i++) {
            seen += d.weight[i] > 0;
            if (fabsf(d.weight[i] - d.d.red[i]) > 1e-6f * d.weight[i])
                fail_msg("form %d, Gaussian %zu: weight %g, gradient %g", form, i, (double)d.weight[i],
                         (double)d.d.red[i]);
        }
        assert_true(seen > 300);
        drawn_free(&d);
    }
    image_free(&d_rgb);
    gaussians_free(&g);
}

static void threads_and_instruction_sets_give_the_same_bits(void **state)
{
    (void)state;
    const cloud_def def = {"bits", 9000, 1.5f, 0.02f, 0.3f, 5, {1, 0.5, -4}, 100, 70};
    const int threads = parallel_threads();
    gaussians g = make_cloud(&def, 11);
    const gbt_camera camera = make_camera(def.width, def.height, def.camera);
    image d_rgb = random_image(def.width, def.height, 1);
    for (int form = 0; form < 2; form++) {
        const raster_settings s = form_settings(form);
        drawn first = draw(&g, &camera, &s, &d_rgb);
        assert_true(first.counters.blended > 10000);
        for (int count = 1; count <= 5; count += 2) {
            parallel_set_threads(count);
            drawn other = draw(&g, &camera, &s, &d_rgb);
            assert_same("threads", &other, &first);
            drawn_free(&other);
        }
        parallel_set_threads(threads);
        for (cpu_isa isa = CPU_PLAIN; isa <= CPU_AVX512; isa++) {
            cpu_limit_isa(isa);
            drawn other = draw(&g, &camera, &s, &d_rgb);
            assert_same(cpu_isa_name(cpu_best_isa()), &other, &first);
            drawn_free(&other);
        }
        cpu_limit_isa(CPU_AVX512);
        drawn_free(&first);
    }
    image_free(&d_rgb);
    gaussians_free(&g);
}

/* One scene used for views of other forms and sizes gives what a fresh one gives. */
static void memory_is_used_again(void **state)
{
    (void)state;
    const cloud_def def = {"again", 500, 1, 0.05f, 0.4f, 1, {1, 0.5, -4}, 50, 40};
    raster_scene scene = {0};
    gaussians g = make_cloud(&def, 1), d = {0};
    for (int round = 0; round < 6; round++) {
        const raster_settings s = form_settings(round % 2);
        const gbt_camera camera = make_camera(50 - 17 * (round / 2), 40, def.camera);
        image d_rgb = random_image(camera.width, camera.height, 1), rgb;
        drawn fresh = draw(&g, &camera, &s, &d_rgb);
        assert_ok(image_alloc(&rgb, camera.width, camera.height, 3, NULL));
        assert_ok(raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, NULL));
        for (int twice = 0; twice < 2; twice++) /* the tape is kept */
            assert_ok(raster_backward(&scene, &d_rgb, &d, NULL, NULL));
        assert_memory_equal(rgb.pixels, fresh.rgb.pixels,
                            3 * (size_t)(camera.width * camera.height) * sizeof(float));
        assert_memory_equal(d.mean_z, fresh.d.mean_z, g.count * sizeof(float));
        drawn_free(&fresh);
        image_free(&d_rgb);
        image_free(&rgb);
    }
    raster_scene_free(&scene);
    gaussians_free(&g);
    gaussians_free(&d);
}

static void wrong_arguments(void **state)
{
    (void)state;
    raster_scene scene = {0};
    gaussians g = ball(0, 0, 10, 0.5f), d = {0};
    image rgb, small;
    gbt_error err = {0};
    gbt_camera camera = plain_camera(20, 20), other = camera;
    raster_settings s = raster_settings_default();
    assert_ok(image_alloc(&rgb, 20, 20, 3, NULL));
    assert_ok(image_alloc(&small, 19, 20, 3, NULL));
    assert_int_equal(raster_backward(&scene, &rgb, &d, NULL, NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(raster_forward(&scene, &g, &camera, &s, true, &small, NULL, NULL, &err),
                     GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "19 x 20"));
    other.model = GBT_CAMERA_OPENCV;
    assert_int_equal(raster_forward(&scene, &g, &other, &s, true, &rgb, NULL, NULL, NULL), GBT_ERR_ARGUMENT);
    other = camera;
    other.params[0] = NAN;
    assert_int_equal(raster_forward(&scene, &g, &other, &s, true, &rgb, NULL, NULL, NULL), GBT_ERR_ARGUMENT);
    other = camera;
    other.rotation[4] = INFINITY;
    assert_int_equal(raster_forward(&scene, &g, &other, &s, true, &rgb, NULL, NULL, NULL), GBT_ERR_ARGUMENT);
    s.alpha_min = 0;
    assert_int_equal(raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, NULL), GBT_ERR_ARGUMENT);
    s = raster_settings_default();
    assert_ok(raster_forward(&scene, &g, &camera, &s, false, &rgb, NULL, NULL, NULL));
    assert_int_equal(raster_backward(&scene, &rgb, &d, NULL, NULL), GBT_ERR_ARGUMENT); /* no tape */
    assert_ok(raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, NULL));
    assert_int_equal(raster_backward(&scene, &small, &d, NULL, NULL), GBT_ERR_ARGUMENT);
    assert_ok(raster_backward(&scene, &rgb, &d, NULL, NULL));
    /* Nobody wants the picture any more; the next one is drawn. */
    const atomic_bool stopped = true;
    scene.stop = &stopped;
    assert_int_equal(raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, NULL),
                     GBT_ERR_INTERRUPTED);
    scene.stop = NULL;
    assert_ok(raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, NULL));
    raster_scene_free(&scene);
    raster_scene_free(&scene); /* twice is fine */
    image_free(&rgb);
    image_free(&small);
    gaussians_free(&g);
    gaussians_free(&d);
}

static void memory_runs_out(void **state)
{
    (void)state;
    const cloud_def def = {"memory", 50, 1, 0.05f, 0.4f, 1, {1, 0.5, -4}, 20, 20};
    gaussians g = make_cloud(&def, 1);
    const gbt_camera camera = make_camera(20, 20, def.camera);
    image d_rgb = random_image(20, 20, 1), rgb;
    assert_ok(image_alloc(&rgb, 20, 20, 3, NULL));
    for (int form = 0; form < 2; form++) {
        const raster_settings s = form_settings(form);
        gbt_status status = GBT_ERR_NO_MEMORY;
        int failures = 0;
        for (long n = 0; status != GBT_OK; n++) {
            raster_scene scene = {0};
            gaussians d = {0};
            gbt_error err = {0};
            mem_fail_after(n);
            status = raster_forward(&scene, &g, &camera, &s, true, &rgb, NULL, NULL, &err);
            if (status == GBT_OK)
                status = raster_backward(&scene, &d_rgb, &d, NULL, &err);
            mem_fail_after(-1);
            if (status != GBT_OK) {
                failures++;
                assert_int_equal(status, GBT_ERR_NO_MEMORY);
                assert_true(err.text[0] != '\0');
            }
            raster_scene_free(&scene);
            gaussians_free(&d);
        }
        assert_true(failures >= 15);
    }
    image_free(&d_rgb);
    image_free(&rgb);
    gaussians_free(&g);
}

/* A corner as a camera of its own (gbt_camera_cropped()) shows what the whole picture has there,
   of Gaussians long enough in depth for the limits of J to matter. */
static void a_part_is_the_part_of_the_picture(void **state)
{
    (void)state;
    enum { SIDE = 96, PART = 32, X = 64, Y = 60 };
    const cloud_def def = {"parts", 400, 2, 0.02f, 0.08f, 1, {0, 0, -8}, SIDE, SIDE};
    gaussians g = make_cloud(&def, 5);
    for (size_t i = 0; i < g.count; i++) {
        g.quat_w[i] = 1;
        g.quat_x[i] = g.quat_y[i] = g.quat_z[i] = 0;
        g.scale_z[i] *= 8;
    }
    raster_settings s = form_settings(0);
    s.exact_cut = true;
    const gbt_camera whole = make_camera(SIDE, SIDE, def.camera);
    gbt_camera part;
    assert_true(gbt_camera_cropped(&whole, X, Y, PART, PART, &part));
    drawn a = draw(&g, &whole, &s, NULL), b = draw(&g, &part, &s, NULL);
    double wanted[3 * PART * PART];
    for (int y = 0; y < PART; y++)
        for (int x = 0; x < 3 * PART; x++)
            wanted[y * 3 * PART + x] = (double)a.rgb.pixels[3 * ((Y + y) * SIDE + X) + x];
    const double psnr = psnr_of(b.rgb.pixels, wanted, 3 * PART * PART);
    print_message("a part: %.1f dB\n", psnr);
    assert_true(psnr > 60);
    drawn_free(&a);
    drawn_free(&b);
    gaussians_free(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_gaussian_by_hand),
        cmocka_unit_test(centre_of_the_rays),
        cmocka_unit_test(one_ray_by_hand),
        cmocka_unit_test(three_sigma_goes_by_tiles),
        cmocka_unit_test(stops_before_it_is_dark),
        cmocka_unit_test(what_is_not_seen),
        cmocka_unit_test(unusable_fields_are_not_drawn),
        cmocka_unit_test(nothing_to_draw),
        cmocka_unit_test(any_size),
        cmocka_unit_test(weights_are_what_colors_feel),
        cmocka_unit_test(threads_and_instruction_sets_give_the_same_bits),
        cmocka_unit_test(memory_is_used_again),
        cmocka_unit_test(wrong_arguments),
        cmocka_unit_test(memory_runs_out),
        cmocka_unit_test(a_part_is_the_part_of_the_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
