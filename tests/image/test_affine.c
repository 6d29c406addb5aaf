/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/test_affine.c -- colour matrices: by hand, adjoint against differences, least squares that come
   back, halves, PSNR with colours fitted. */
#include "image_support.h"

#include "base/parallel.h"
#include "image/affine.h"
#include "image/metrics.h"

static void fill_matrix(float m[AFFINE_NUMBERS], uint64_t seed)
{
    affine_identity(m);
    for (uint64_t i = 0; i < AFFINE_NUMBERS; i++)
        m[i] += 0.8f * rng_uniform(seed, 1, i) - 0.4f;
}

static void by_hand(void **state)
{
    (void)state;
    float m[AFFINE_NUMBERS] = {2, 0, 0, 0.5f, 0, 0, 1, 0, 0, -1, 0, 0.25f};
    image im = make_image(1, 1, 3);
    im.pixels[0] = 0.25f;
    im.pixels[1] = 0.5f;
    im.pixels[2] = 0.75f;
    affine_apply(m, &im, &im);
    assert_true(im.pixels[0] == 1.0f && im.pixels[1] == 0.75f && im.pixels[2] == -0.25f);
    affine_identity(m);
    image noise = make_noise(9, 7, 3, 1), same = make_image(9, 7, 3);
    affine_apply(m, &noise, &same);
    assert_memory_equal(noise.pixels, same.pixels, 9 * 7 * 3 * sizeof(float));
    image_free(&im);
    image_free(&noise);
    image_free(&same);
}

/* What lies beyond the white or the black of a photo asks nothing; what lies within its range does. */
static void beyond_the_range_is_cut(void **state)
{
    (void)state;
    const float photo_is[6] = {1, 0.995f, 1, 0, 0.5f, 0.005f},
                shown_is[6] = {1.4f, 0.9f, 0.8f, -0.3f, 0.7f, 0.2f}, want[6] = {1, 0.9f, 0.8f, 0, 0.7f, 0.2f},
                d_want[6] = {0, 2, 3, 0, 5, 6};
    image photo = make_image(2, 1, 3), shown = make_image(2, 1, 3), d = make_image(2, 1, 3);
    memcpy(photo.pixels, photo_is, sizeof photo_is);
    memcpy(shown.pixels, shown_is, sizeof shown_is);
    for (int i = 0; i < 6; i++)
        d.pixels[i] = (float)(i + 1);
    affine_cut(&photo, &shown);
    affine_cut_backward(&photo, &shown, &d);
    assert_memory_equal(shown.pixels, want, sizeof want);
    assert_memory_equal(d.pixels, d_want, sizeof d_want);
    image_free(&photo);
    image_free(&shown);
    image_free(&d);
}

/* f = sum of weight * m(in), in double. */
static double weighted(const float m[AFFINE_NUMBERS], const image *in, const image *weight)
{
    double sum = 0;
    for (int i = 0; i < 3 * in->width * in->height; i += 3)
        for (int r = 0; r < 3; r++) {
            double value = (double)m[4 * r + 3];
            for (int k = 0; k < 3; k++)
                value += (double)m[4 * r + k] * (double)in->pixels[i + k];
            sum += (double)weight->pixels[i + r] * value;
        }
    return sum;
}

/* f is linear in the matrix and in the picture, so a difference of any size is exact but for rounding. */
static void adjoint_agrees_with_differences(void **state)
{
    (void)state;
    enum { WIDTH = 83, HEIGHT = 61 };
    float m[AFFINE_NUMBERS];
    fill_matrix(m, 3);
    image in = make_noise(WIDTH, HEIGHT, 3, 4), weight = make_noise(WIDTH, HEIGHT, 3, 5),
          d = make_noise(WIDTH, HEIGHT, 3, 5);
    double d_m[AFFINE_NUMBERS];
    affine_backward(m, &in, &d, d_m);
    for (int k = 0; k < AFFINE_NUMBERS; k++) {
        float up[AFFINE_NUMBERS], down[AFFINE_NUMBERS];
        memcpy(up, m, sizeof m);
        memcpy(down, m, sizeof m);
        up[k] += 0.5f;
        down[k] -= 0.5f;
        const double step = (double)up[k] - (double)down[k];
        assert_near(d_m[k], (weighted(up, &in, &weight) - weighted(down, &in, &weight)) / step,
                    1e-8 * fabs(d_m[k]));
    }
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i += 37) {
        const float keep = in.pixels[i];
        in.pixels[i] = keep + 0.5f;
        const double high = weighted(m, &in, &weight);
        in.pixels[i] = keep;
        assert_near((double)d.pixels[i],
                    (high - weighted(m, &in, &weight)) / ((double)(keep + 0.5f) - (double)keep), 1e-6);
    }
    image_free(&in);
    image_free(&weight);
    image_free(&d);
}

static void threads_give_the_same_bits(void **state)
{
    (void)state;
    const int before = parallel_threads();
    float m[AFFINE_NUMBERS];
    fill_matrix(m, 8);
    image in = make_noise(512, 300, 3, 9);
    double d_m[3][AFFINE_NUMBERS];
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        image d = make_noise(512, 300, 3, 10);
        affine_backward(m, &in, &d, d_m[threads - 1]);
        image_free(&d);
    }
    parallel_set_threads(before);
    assert_memory_equal(d_m[0], d_m[1], sizeof d_m[0]);
    assert_memory_equal(d_m[0], d_m[2], sizeof d_m[0]);
    image_free(&in);
}

static void a_fit_finds_the_matrix(void **state)
{
    (void)state;
    float m[AFFINE_NUMBERS], got[AFFINE_NUMBERS];
    fill_matrix(m, 11);
    image from = make_noise(40, 30, 3, 12), to = make_image(40, 30, 3);
    affine_apply(m, &from, &to);
    for (int i = 0; i < 40 * 30; i++) /* outside the columns that count */
        if (i % 40 < 10 || i % 40 >= 30)
            to.pixels[3 * i] = 77;
    affine_fit(&from, &to, NULL, 10, 30, got);
    for (int k = 0; k < AFFINE_NUMBERS; k++)
        assert_near((double)got[k], (double)m[k], 3e-5); /* the pull to the identity is 1e-6 against variances
                                                            of 1/12 */
    image_free(&from);
    image_free(&to);
}

static void masked_pixels_are_not_fitted(void **state)
{
    (void)state;
    enum { WIDTH = 20, HEIGHT = 8 };
    float m[AFFINE_NUMBERS], got[AFFINE_NUMBERS];
    unsigned char valid[WIDTH * HEIGHT];
    fill_matrix(m, 31);
    image from = make_noise(WIDTH, HEIGHT, 3, 32), to = make_image(WIDTH, HEIGHT, 3);
    affine_apply(m, &from, &to);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        valid[i] = i % 3 != 0;
        if (!valid[i])
            to.pixels[3 * i + 2] = 9;
    }
    affine_fit(&from, &to, valid, 0, WIDTH, got);
    for (int k = 0; k < AFFINE_NUMBERS; k++)
        assert_near((double)got[k], (double)m[k], 3e-4);
    for (int i = 0; i < WIDTH * HEIGHT; i++) /* what is masked does not pull towards the identity either */
        valid[i] = i % WIDTH < 2;
    float columns[AFFINE_NUMBERS];
    affine_fit(&from, &to, valid, 0, WIDTH, got);
    affine_fit(&from, &to, NULL, 0, 2, columns);
    assert_memory_equal(got, columns, sizeof got);
    affine_half half;
    assert_ok(affine_split(&from, &to, valid, &half, NULL));
    for (int y = 0; y < HEIGHT; y++)
        assert_memory_equal(half.valid + y * WIDTH / 2, valid + y * WIDTH + WIDTH / 2, WIDTH / 2);
    affine_half_free(&half);
    image_free(&from);
    image_free(&to);
}

/* Pictures that say little leave the identity as it is, or the nearest matrix that explains them; nothing is
   ever not finite. */
static void poor_pictures_fit_too(void **state)
{
    (void)state;
    static const struct {
        float from, to;
        int begin, end;
        float identity_error;
    } cases[] = {
        {0, 0, 0, 8, 0},           {0.5f, 0.5f, 0, 8, 0},    {0.3f, 0.3f, 4, 4, 0},
        {0, 0.4f, 0, 8, 0.41f},    {NAN, 0.5f, 0, 8, 0.51f}, {INFINITY, INFINITY, 0, 8, 0},
        {1e-30f, 1e-30f, 0, 8, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        image from = make_constant(8, 6, cases[i].from), to = make_constant(8, 6, cases[i].to);
        float m[AFFINE_NUMBERS], identity[AFFINE_NUMBERS];
        affine_fit(&from, &to, NULL, cases[i].begin, cases[i].end, m);
        affine_identity(identity);
        for (int k = 0; k < AFFINE_NUMBERS; k++)
            assert_near((double)m[k], (double)identity[k], (double)cases[i].identity_error + 1e-9);
        image_free(&from);
        image_free(&to);
    }
}

static void halves(void **state)
{
    (void)state;
    enum { WIDTH = 21, HEIGHT = 9, RIGHT = 11 };
    float m[AFFINE_NUMBERS];
    fill_matrix(m, 21);
    image render = make_noise(WIDTH, HEIGHT, 3, 22), photo = make_image(WIDTH, HEIGHT, 3);
    affine_half right_half;
    affine_apply(m, &render, &photo);
    for (int i = 0; i < WIDTH * HEIGHT; i++) /* the right half shows something else: it must not be fitted to
                                              */
        if (i % WIDTH >= WIDTH / 2)
            photo.pixels[3 * i + 1] = 5;
    assert_ok(affine_split(&render, &photo, NULL, &right_half, NULL));
    assert_true(right_half.render.width == RIGHT && right_half.photo.width == RIGHT &&
                right_half.render.height == HEIGHT && right_half.photo.height == HEIGHT);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                const int at = 3 * (y * WIDTH + x) + c, right = 3 * (y * RIGHT + x - WIDTH / 2) + c;
                if (x < WIDTH / 2)
                    assert_near((double)render.pixels[at], (double)photo.pixels[at], 1e-4);
                else
                    assert_true(right_half.render.pixels[right] == render.pixels[at] &&
                                right_half.photo.pixels[right] == photo.pixels[at]);
            }
    affine_half_free(&right_half);
    image_free(&render);
    image_free(&photo);

    image thin = make_noise(1, 3, 3, 1), same = make_noise(1, 3, 3, 1); /* no left half: the identity */
    assert_ok(affine_split(&thin, &same, NULL, &right_half, NULL));
    assert_memory_equal(thin.pixels, same.pixels, 9 * sizeof(float));
    assert_int_equal(right_half.render.width, 1);
    affine_half_free(&right_half);
    image_free(&thin);
    image other = make_image(2, 3, 3);
    assert_int_equal(affine_split(&other, &same, NULL, &right_half, NULL), GBT_ERR_ARGUMENT);
    assert_null(right_half.render.pixels);
    image_free(&same);
    image_free(&other);
}

/* A photo of another exposure is 8-bit rounding away once its colours are fitted; what a mask covers does not
   count. */
static void fitted_psnr_leaves_exposure_out(void **state)
{
    (void)state;
    const float exposure[AFFINE_NUMBERS] = {0.7f, 0.05f, 0, 0.02f, 0, 0.8f, 0, 0.01f, 0.03f, 0, 0.75f, 0};
    image render = make_noise(32, 24, 3, 4), photo = make_image(32, 24, 3);
    unsigned char valid[32 * 24];
    affine_apply(exposure, &render, &photo);
    image_quantize(&render);
    image_quantize(&photo);
    double psnr;
    assert_ok(image_psnr_fitted(&render, &photo, NULL, 0, &psnr, NULL));
    print_message("PSNR %.2f dB, colours fitted %.2f dB\n", metric_psnr(&render, &photo), psnr);
    assert_true(metric_psnr(&render, &photo) < 20 && psnr > 53);
    for (int i = 0; i < 32 * 24; i++) {
        valid[i] = i % 5 != 0;
        if (!valid[i])
            photo.pixels[3 * i] = 1 - photo.pixels[3 * i];
    }
    double masked;
    assert_ok(image_psnr_fitted(&render, &photo, NULL, 0, &psnr, NULL));
    assert_ok(image_psnr_fitted(&render, &photo, valid, 0, &masked, NULL));
    assert_true(psnr < 30 && masked > 53);
    for (int i = 0; i < 32 * 24; i++) { /* what is left of the first column is neither fitted nor scored */
        valid[i] = i % 32 >= 16;
        for (int c = 0; c < 3 && !valid[i]; c++)
            photo.pixels[3 * i + c] = 0.5f;
    }
    double right;
    assert_ok(image_psnr_fitted(&render, &photo, valid, 0, &masked, NULL));
    assert_ok(image_psnr_fitted(&render, &photo, NULL, 16, &right, NULL));
    assert_true(fabs(right - masked) < 1e-9);
    memset(valid, 0, sizeof valid);
    assert_ok(image_psnr_fitted(&render, &photo, valid, 0, &psnr, NULL));
    assert_true(isnan(psnr));
    image_free(&render);
    image_free(&photo);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(by_hand),
        cmocka_unit_test(beyond_the_range_is_cut),
        cmocka_unit_test(adjoint_agrees_with_differences),
        cmocka_unit_test(threads_give_the_same_bits),
        cmocka_unit_test(a_fit_finds_the_matrix),
        cmocka_unit_test(poor_pictures_fit_too),
        cmocka_unit_test(masked_pixels_are_not_fitted),
        cmocka_unit_test(halves),
        cmocka_unit_test(fitted_psnr_leaves_exposure_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
