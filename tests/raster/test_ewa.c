/* SPDX-License-Identifier: Apache-2.0 */
/* tests/raster/test_ewa.c -- the EWA form and its adjoint against the double reference, and the reference
   against differences. */
#include "base/near.h"
#include "reference/raster_ref.h"
#include "raster/raster_support.h"

static const cloud_def clouds[] = {
    RASTER_CLOUDS(100),
    {"sub-pixel", 2000, 1, 0.001f, 0.01f, 1, {0, 0, -6}, 48, 48},
    {"wide, lists of more than one chunk", 3000, 1, 0.1f, 0.8f, 1, {0, 0, -5}, 33, 17},
};

/* Forms of the cuts. Backgrounds are not black, so that their gradients are seen. */
static const struct {
    const char *name;
    float dilation, near, alpha_max;
    bool exact_cut;
} forms[] = {{"3DGS", 0.3f, 0.2f, 0.99f, false},
             {"exact cut", 0.3f, 0.2f, 0.99f, true},
             {"no dilation", 0, 0.05f, 0.99f, true},
             {"half opaque at most", 0.3f, 0.2f, 0.5f, false}};

static raster_settings settings_of(size_t form)
{
    raster_settings s = raster_settings_default();
    s.dilation = forms[form].dilation;
    s.near = forms[form].near;
    s.alpha_max = forms[form].alpha_max;
    s.exact_cut = forms[form].exact_cut;
    s.background[0] = 0.3f;
    s.background[1] = 0.6f;
    s.background[2] = 0.1f;
    s.sky.varies = true;
    for (int k = 0; k < 3 * SKY_HARMONICS; k++)
        s.sky.harmonic[k / 3][k % 3] = 0.1f * cosf(1.7f * (float)k);
    return s;
}

static void image_agrees(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++)
        for (size_t form = 0; form < sizeof forms / sizeof *forms; form++) {
            const raster_settings s = settings_of(form);
            gaussians g = make_cloud(&clouds[i], 7 + i);
            const gbt_camera camera = make_camera(clouds[i].width, clouds[i].height, clouds[i].camera);
            const size_t floats = 3 * raster_reference_pixels(&camera, 1);
            raster_reference reference;
            double *wanted = mem_alloc(floats, sizeof *wanted, "test", NULL);
            assert_ok(raster_reference_make(&g, &reference, NULL));
            assert_ok(raster_reference_forward(&reference, &camera, &s, 1, wanted, NULL));
            drawn got = draw(&g, &camera, &s, NULL);
            const double psnr = psnr_of(got.rgb.pixels, wanted, floats);
            print_message("%s, %s: %.1f dB, %llu pairs\n", clouds[i].name, forms[form].name, psnr,
                          (unsigned long long)got.counters.pairs);
            if (!(psnr >= 100))
                fail_msg("%s, %s: %.1f dB", clouds[i].name, forms[form].name, psnr);
            drawn_free(&got);
            mem_free(wanted);
            mem_free(reference.fields);
            gaussians_free(&g);
        }
}

/* Relative L2 error of each class of fields. */
static void compare_gradients(const char *what, const gaussians *got, const double *wanted, double limit)
{
    static const struct {
        const char *name;
        int first, end;
    } classes[] = {{"mean", FIELD_MEAN, FIELD_SCALE},
                   {"scale", FIELD_SCALE, FIELD_QUAT},
                   {"rotation", FIELD_QUAT, FIELD_OPACITY},
                   {"opacity", FIELD_OPACITY, FIELD_COLOR},
                   {"colour", FIELD_COLOR, GAUSSIANS_FIELD_COUNT}};
    float *f[GAUSSIANS_FIELD_COUNT];
    field_list(got, f);
    for (size_t c = 0; c < sizeof classes / sizeof *classes; c++) {
        double off = 0, all = 0;
        for (int k = classes[c].first; k < classes[c].end; k++)
            for (size_t i = 0; i < got->count; i++) {
                const double want = wanted[(size_t)k * got->count + i];
                off += pow((double)f[k][i] - want, 2);
                all += want * want;
            }
        print_message("%s: %s %.2e\n", what, classes[c].name, sqrt(off / all));
        if (!(sqrt(off) <= limit * sqrt(all)))
            fail_msg("%s: gradient of %s off by %g of %g", what, classes[c].name, sqrt(off), sqrt(all));
    }
}

static void gradients_agree(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++) {
        const raster_settings s = settings_of(i % (sizeof forms / sizeof *forms));
        gaussians g = make_cloud(&clouds[i], 31 + i);
        const gbt_camera camera = make_camera(clouds[i].width, clouds[i].height, clouds[i].camera);
        image d_rgb = random_image(camera.width, camera.height, i);
        const size_t floats = 3 * raster_reference_pixels(&camera, 1);
        raster_reference reference;
        double *d = mem_alloc(floats, sizeof *d, "test", NULL),
               *wanted = mem_calloc(GAUSSIANS_FIELD_COUNT * g.count, sizeof *wanted, "test", NULL);
        for (size_t k = 0; k < floats; k++)
            d[k] = (double)d_rgb.pixels[k];
        assert_ok(raster_reference_make(&g, &reference, NULL));
        assert_ok(raster_reference_backward(&reference, &camera, &s, d, wanted, NULL));
        drawn got = draw(&g, &camera, &s, &d_rgb);
        compare_gradients(clouds[i].name, &got.d, wanted, 1e-4);
        drawn_free(&got);
        mem_free(d);
        mem_free(wanted);
        mem_free(reference.fields);
        image_free(&d_rgb);
        gaussians_free(&g);
    }
}

static double loss_of(const raster_reference *reference, const gbt_camera *camera, const raster_settings *s,
                      const double *d, double *rgb)
{
    double loss = 0;
    assert_ok(raster_reference_forward(reference, camera, s, 1, rgb, NULL));
    for (size_t i = 0; i < 3 * raster_reference_pixels(camera, 1); i++)
        loss += d[i] * rgb[i];
    return loss;
}

/* Move field `f` of Gaussian i by h; a quaternion stays on the unit sphere. */
static void move_field(raster_reference *r, int f, size_t i, double h)
{
    double square = 0;
    r->fields[(size_t)f * r->count + i] += h;
    if (f < FIELD_QUAT || f >= FIELD_OPACITY)
        return;
    for (int k = FIELD_QUAT; k < FIELD_OPACITY; k++)
        square += pow(r->fields[(size_t)k * r->count + i], 2);
    for (int k = FIELD_QUAT; k < FIELD_OPACITY; k++)
        r->fields[(size_t)k * r->count + i] /= sqrt(square);
}

/* The reference's own adjoint. No cuts that jump: alpha_min is tiny, the box does not cut, and few Gaussians,
   so that no pixel is opaque. Some are clamped in J, and some are cut at alpha_max. */
static void reference_is_its_own_derivative(void **state)
{
    (void)state;
    const cloud_def def = {"differences", 12, 0.7f, 0.1f, 0.5f, 1, {0.3, -0.2, -1.6}, 12, 9};
    raster_settings s = settings_of(1);
    s.alpha_min = 1e-12f;
    s.transmittance_min = 1e-12f;
    s.alpha_max = 0.9f;
    gaussians g = make_cloud(&def, 5);
    const gbt_camera camera = make_camera(def.width, def.height, def.camera);
    const size_t floats = 3 * raster_reference_pixels(&camera, 1), n = def.count;
    raster_reference reference;
    assert_ok(raster_reference_make(&g, &reference, NULL));
    double *d = mem_alloc(floats, sizeof *d, "test", NULL),
           *rgb = mem_alloc(floats, sizeof *rgb, "test", NULL);
    double *got = mem_calloc(GAUSSIANS_FIELD_COUNT * n, sizeof *got, "test", NULL), off = 0, all = 0;
    for (size_t k = 0; k < floats; k++)
        d[k] = rng_normal(3, 1, k);
    for (size_t i = 0; i < n; i++) /* unit to double's precision, so that moved ones are compared with it */
        move_field(&reference, FIELD_QUAT, i, 0);
    assert_ok(raster_reference_backward(&reference, &camera, &s, d, got, NULL));
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        for (size_t i = 0; i < n; i++) {
            double keep[GAUSSIANS_FIELD_COUNT], loss[2];
            for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
                keep[k] = reference.fields[(size_t)k * n + i];
            const double h = 1e-6;
            for (int side = 0; side < 2; side++) {
                move_field(&reference, f, i, side == 0 ? -h : h);
                loss[side] = loss_of(&reference, &camera, &s, d, rgb);
                for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
                    reference.fields[(size_t)k * n + i] = keep[k];
            }
            const double want = (loss[1] - loss[0]) / (2 * h), have = got[(size_t)f * n + i];
            off += pow(have - want, 2);
            all += want * want;
            if (!(fabs(have - want) <= 2e-5 * fmax(1, fabs(want))))
                fail_msg("field %d of Gaussian %zu: %.10g, differences say %.10g", f, i, have, want);
        }
    print_message("adjoint of the reference against differences: %.1e\n", sqrt(off / all));
    assert_true(sqrt(off) <= 1e-6 * sqrt(all));
    mem_free(d);
    mem_free(rgb);
    mem_free(got);
    mem_free(reference.fields);
    gaussians_free(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(image_agrees),
        cmocka_unit_test(gradients_agree),
        cmocka_unit_test(reference_is_its_own_derivative),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
