/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/test_metrics.c -- PSNR, SSIM, FLIP and 8-bit rounding against hand cases, brute force and
   published programs. */
#include "test_support.h"

#include "base/cpu.h"
#include "base/image.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "image/metrics.h"
#include "image_support.h"

static double ssim_of(const image *a, const image *b)
{
    double ssim = 0;
    assert_ok(metric_ssim(a, b, &ssim, NULL));
    return ssim;
}

static double ssim_interior_of(const image *a, const image *b)
{
    double ssim = 0;
    assert_ok(metric_ssim_interior(a, b, &ssim, NULL));
    return ssim;
}

/* Levels of the pictures that the golden numbers below were made from. */
static int ramp(int x, int y, int c) { return (x * 5 + y * 3 + c * 40 + (x * y >> 3)) & 255; }

static int ramp_fainter(int x, int y, int c) { return ramp(x, y, c) * 7 / 8 + 16; }

static int ramp_negative(int x, int y, int c) { return 255 - ramp(x, y, c); }

static int dots(int x, int y, int c) { return x % 8 == 3 && y % 8 == 3 ? 250 : 40 + 10 * c; }

static int dots_moved(int x, int y, int c) { return x % 8 == 4 && y % 8 == 3 ? 250 : 40 + 10 * c; }

static int red(int x, int y, int c)
{
    (void)x;
    (void)y;
    return c == 0 ? 200 : 60;
}

static int blue(int x, int y, int c)
{
    (void)x;
    (void)y;
    return c == 2 ? 200 : 60;
}

/* Stripes of even brightness: what the eye's blue-yellow filter is for. */
static int blue_yellow(int x, int y, int c)
{
    (void)y;
    return x % 14 < 7 ? c < 2 ? 100 : 160 : c < 2 ? 120 : 60;
}

static int even_grey(int x, int y, int c)
{
    (void)x;
    (void)y;
    (void)c;
    return 110;
}

typedef struct golden_case {
    const char *name;
    int width, height;
    int (*a)(int, int, int), (*b)(int, int, int);
    double psnr, ssim, flip;
} golden_case;

/* PSNR from scikit-image 0.26.0 on 8-bit levels. SSIM from numpy with zero padding, whose interior equals
   structural_similarity() of scikit-image (gaussian_weights, sigma 1.5, no sample covariance) to 1e-15. FLIP
   from flip-evaluator 1.7, which works in float32. */
static golden_case golden_cases[] = {
    {"golden: faint ramp", 48, 40, ramp, ramp_fainter, 28.9712203932, 0.987150570507, 0.21975785},
    {"golden: dots moved by a pixel", 48, 40, dots, dots_moved, 17.1544712624, 0.230796099969, 0.10852352},
    {"golden: red for blue", 24, 24, red, blue, 6.9691554857, 0.604617679634, 0.93332630},
    {"golden: narrow negative", 13, 29, ramp, ramp_negative, 7.7607007668, 0.183567680324, 0.88946664},
    {"golden: blue and yellow stripes", 40, 20, blue_yellow, even_grey, 18.5883785143, 0.646764618663,
     0.33124015},
};

static image draw(int width, int height, int (*level)(int, int, int))
{
    image im = make_image(width, height, 3);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++)
                im.pixels[(y * width + x) * 3 + c] = (float)level(x, y, c) / 255.0f;
    return im;
}

static void agrees_with_published_programs(void **state)
{
    const golden_case *g = *state;
    image a = draw(g->width, g->height, g->a), b = draw(g->width, g->height, g->b);
    double flip;
    assert_near(metric_psnr(&a, &b), g->psnr, 1e-6);
    assert_near(ssim_of(&a, &b), g->ssim, 1e-11);
    assert_ok(metric_flip(&a, &b, &flip, NULL, &assert_ok_err_));
    assert_near(flip, g->flip, 5e-5);
    image_free(&a);
    image_free(&b);
}

static void psnr_by_hand(void **state)
{
    (void)state;
    static const struct {
        float a, b;
        double psnr;
    } cases[] = {
        {0.0f, 1.0f, 0.0},
        {0.5f, 0.5f, 100.0},
        {0.25f, 0.75f, 6.020599913279624},
        {0.5f, 0.375f, 18.061799739838871},
        {0.0f, 0x1p-16f, 96.32959861247398},
        {0.0f, 0x1p-17f, 100.0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        image a = make_constant(7, 5, cases[i].a), b = make_constant(7, 5, cases[i].b);
        assert_near(metric_psnr(&a, &b), cases[i].psnr, 1e-9);
        image_free(&a);
        image_free(&b);
    }
    image a = make_constant(4, 1, 0.0f), b = make_constant(4, 1, 0.0f), c = make_constant(1, 4, 0.0f);
    b.pixels[5] = 1.0f; /* one value of twelve */
    assert_near(metric_psnr(&a, &b), 10.79181246047625, 1e-9);
    assert_true(isnan(metric_psnr(&a, &c)));
    b.pixels[5] = NAN;
    assert_true(isnan(metric_psnr(&a, &b)));
    image_free(&a);
    image_free(&b);
    image_free(&c);
}

static void quantize_rounds_half_up(void **state)
{
    (void)state;
    static const float values[] = {0.0f, -1.0f,       NAN,         INFINITY,     -INFINITY,     1.0f,
                                   2.0f, 0.49f / 255, 0.51f / 255, 127.5f / 255, 254.49f / 255, 1e-30f};
    static const int levels[] = {0, 0, 0, 255, 0, 255, 255, 0, 1, 128, 254, 0};
    image im = make_image(4, 1, 3);
    memcpy(im.pixels, values, sizeof values);
    image_quantize(&im);
    for (int i = 0; i < 12; i++)
        if (im.pixels[i] != (float)levels[i] / 255.0f)
            fail_msg("value %d became %g/255, not %d", i, (double)im.pixels[i] * 255, levels[i]);
    image again = make_image(4, 1, 3);
    memcpy(again.pixels, im.pixels, sizeof values);
    image_quantize(&again);
    assert_memory_equal(again.pixels, im.pixels, sizeof values);
    image_free(&im);
    image_free(&again);
}

static const int sizes[][2] = {{1, 1},   {1, 11},  {11, 1},  {2, 3},  {5, 5},
                               {10, 10}, {11, 11}, {12, 33}, {40, 17}};

static void ssim_equals_brute_force(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int channels = 1; channels <= 4; channels++) {
            image a = make_noise(sizes[i][0], sizes[i][1], channels, 1),
                  b = make_noise(sizes[i][0], sizes[i][1], channels, 2);
            const double got = ssim_of(&a, &b), want = brute_ssim(&a, &b);
            if (!(fabs(got - want) <= 1e-13))
                fail_msg("%d x %d x %d: %.17g, not %.17g", sizes[i][0], sizes[i][1], channels, got, want);
            assert_true(got > -1 && got < 1);
            assert_near(ssim_of(&b, &a), got, 1e-14);
            assert_true(ssim_of(&a, &a) == 1.0);
            for (int k = 0; k < sizes[i][0] * sizes[i][1] * channels; k++) {
                a.pixels[k] *= 255; /* bright, and b of other signs */
                b.pixels[k] = a.pixels[k] - 500 * b.pixels[k];
            }
            assert_near(ssim_of(&a, &b), brute_ssim(&a, &b), 1e-9);
            assert_true(ssim_of(&a, &a) == 1.0);
            image_free(&a);
            image_free(&b);
        }
}

static void ssim_of_constant_images(void **state)
{
    (void)state;
    static const float levels[] = {0.0f, 0.3f, 0.6f, 1.0f, 100.0f, 255.0f};
    enum { COUNT = sizeof levels / sizeof *levels };
    for (int i = 0; i < COUNT * COUNT; i++) {
        image a = make_constant(31, 29, levels[i / COUNT]), b = make_constant(31, 29, levels[i % COUNT]);
        const double got = ssim_of(&a, &b);
        assert_true(got <= 1 && got >= -1);
        /* 255^2 in double is good to 1e-11, which C2 = 9e-4 magnifies. */
        assert_near(got, brute_ssim(&a, &b),
                    levels[i / COUNT] > 1.0f || levels[i % COUNT] > 1.0f ? 1e-7 : 1e-12);
        if (i / COUNT == i % COUNT)
            assert_true(got == 1.0);
        image_free(&a);
        image_free(&b);
    }
    /* Away from the borders the variances vanish and only the mean term is left. */
    image a = make_constant(401, 397, 0.6f), b = make_constant(401, 397, 0.5f);
    const double p = (double)0.6f, q = 0.5, inner = (2 * p * q + 1e-4) / (p * p + q * q + 1e-4);
    /* One row less drops one of the inner rows, which are all alike, and so for columns: what is left is one
       inner pixel. */
    image a1 = make_constant(401, 396, 0.6f), b1 = make_constant(401, 396, 0.5f),
          a2 = make_constant(400, 397, 0.6f);
    image b2 = make_constant(400, 397, 0.5f), a3 = make_constant(400, 396, 0.6f),
          b3 = make_constant(400, 396, 0.5f);
    const double sum = ssim_of(&a, &b) * 401 * 397 - ssim_of(&a1, &b1) * 401 * 396 -
                       ssim_of(&a2, &b2) * 400 * 397 + ssim_of(&a3, &b3) * 400 * 396;
    assert_near(sum, inner, 1e-8);
    image *const all[] = {&a, &b, &a1, &b1, &a2, &b2, &a3, &b3};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        image_free(all[i]);
    image c = make_constant(20, 20, 0.6f), d = make_constant(20, 20, 0.6000001f);
    assert_true(ssim_of(&c, &d) <= 1 && ssim_of(&c, &d) > 1 - 1e-9);
    d.pixels[600] = NAN;
    assert_true(isnan(ssim_of(&c, &d)));
    image e = make_constant(20, 19, 0.6f);
    assert_true(isnan(ssim_of(&c, &e)));
    image_free(&c);
    image_free(&d);
    image_free(&e);
}

/* Of a picture of one whole window only the middle counts; of noise, what is left without five pixels
   around. */
static void ssim_inside(void **state)
{
    (void)state;
    double taps[121];
    brute_taps(taps);
    static const int shapes[][2] = {{11, 11}, {12, 33}, {40, 17}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
        for (int channels = 1; channels <= 4; channels += 2) {
            const int width = shapes[i][0], height = shapes[i][1];
            image a = make_noise(width, height, channels, 1), b = make_noise(width, height, channels, 2);
            double *x = widened(&a), *y = widened(&b), sum = 0;
            for (int row = 5; row < height - 5; row++)
                for (int column = 5; column < width - 5; column++)
                    for (int c = 0; c < channels; c++)
                        sum += brute_at(x, y, width, height, channels, column, row, c, taps).ssim;
            assert_near(ssim_interior_of(&a, &b), sum / ((width - 10) * (height - 10) * channels), 1e-13);
            assert_true(ssim_interior_of(&a, &a) == 1.0);
            free(x);
            free(y);
            image_free(&a);
            image_free(&b);
        }
    image small = make_constant(10, 30, 0.5f);
    assert_true(isnan(ssim_interior_of(&small, &small)));
    image_free(&small);
}

static void flip_properties(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        image a = make_noise(sizes[i][0], sizes[i][1], 3, 1), b = make_noise(sizes[i][0], sizes[i][1], 3, 2);
        image map = make_image(sizes[i][0], sizes[i][1], 1);
        double same, forth, back, sum = 0;
        assert_ok(metric_flip(&a, &a, &same, &map, &assert_ok_err_));
        assert_true(same == 0.0);
        assert_ok(metric_flip(&b, &a, &back, NULL, &assert_ok_err_));
        assert_ok(metric_flip(&a, &b, &forth, &map, &assert_ok_err_));
        assert_near(forth, back, 1e-14);
        for (int p = 0; p < sizes[i][0] * sizes[i][1]; p++) {
            assert_true(map.pixels[p] >= 0.0f && map.pixels[p] <= 1.0f);
            sum += (double)map.pixels[p];
        }
        assert_near(forth, sum / (sizes[i][0] * sizes[i][1]), 1e-7);
        assert_true(forth > 0);
        image_free(&a);
        image_free(&b);
        image_free(&map);
    }
    /* Green against blue is what the paper scales by, so their distance is 1; black against white is a large
       one. */
    image green = make_constant(9, 9, 0.0f), blue_image = make_constant(9, 9, 0.0f),
          odd = make_constant(9, 9, 0.0f);
    for (int p = 0; p < 81; p++) {
        green.pixels[3 * p + 1] = 1.0f;
        blue_image.pixels[3 * p + 2] = 1.0f;
        odd.pixels[3 * p] = NAN;
        odd.pixels[3 * p + 1] = 7.0f;
    }
    double mean;
    assert_ok(metric_flip(&green, &blue_image, &mean, NULL, &assert_ok_err_));
    assert_near(mean, 1.0, 1e-6);
    assert_ok(metric_flip(&green, &odd, &mean, NULL, &assert_ok_err_)); /* clamped, NaN as 0 */
    assert_true(mean == 0.0);
    image_free(&green);
    image_free(&blue_image);
    image_free(&odd);
}

static void flip_refusals(void **state)
{
    (void)state;
    image a = make_noise(9, 8, 3, 1), b = make_noise(8, 9, 3, 2), grey = make_noise(9, 8, 1, 1),
          map = make_image(9, 8, 3);
    double mean;
    gbt_error err = {0};
    assert_int_equal(metric_flip(&a, &b, &mean, NULL, &err), GBT_ERR_ARGUMENT);
    assert_true(err.text[0] != '\0');
    assert_int_equal(metric_flip(&grey, &grey, &mean, NULL, NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(metric_flip(&a, &a, &mean, &map, NULL), GBT_ERR_ARGUMENT);
    for (long n = 0; n < 2; n++) {
        mem_fail_after(n);
        assert_int_equal(metric_flip(&a, &a, &mean, NULL, NULL), GBT_ERR_NO_MEMORY);
        mem_fail_after(n);
        assert_int_equal(metric_ssim(&a, &a, &mean, NULL), GBT_ERR_NO_MEMORY);
        mem_fail_after(-1);
    }
    image_free(&a);
    image_free(&b);
    image_free(&grey);
    image_free(&map);
}

static void same_bits_for_threads_and_instructions(void **state)
{
    (void)state;
    image a = make_noise(67, 83, 3, 1), b = make_noise(67, 83, 3, 2);
    double ssim = 0, flip = 0;
    for (int threads = 1; threads <= 4; threads++)
        for (int isa = CPU_PLAIN; isa <= CPU_AVX512; isa++) {
            parallel_set_threads(threads);
            cpu_limit_isa((cpu_isa)isa);
            double flip_now;
            const double ssim_now = ssim_of(&a, &b);
            assert_ok(metric_flip(&a, &b, &flip_now, NULL, &assert_ok_err_));
            if (threads == 1 && isa == CPU_PLAIN) {
                ssim = ssim_now;
                flip = flip_now;
            }
            assert_true(ssim == ssim_now && flip == flip_now);
        }
    image_free(&a);
    image_free(&b);
}

/* PSNR by hand; SSIM and FLIP do not see what is masked, and equal the plain ones without a mask. */
static void masked_scores(void **state)
{
    (void)state;
    enum { WIDTH = 40, HEIGHT = 30, COUNT = WIDTH * HEIGHT };
    image a = make_noise(WIDTH, HEIGHT, 3, 1), b = make_noise(WIDTH, HEIGHT, 3, 2),
          map = make_image(WIDTH, HEIGHT, 1);
    unsigned char valid[COUNT], none[COUNT] = {0}, all[COUNT];
    memset(all, 1, COUNT);
    for (int i = 0; i < COUNT; i++)
        valid[i] = i % WIDTH >= 7 && (i / WIDTH) % 5 != 0;
    image_scores plain, whole, masked, again;
    assert_ok(image_score(&a, &b, NULL, NULL, &plain, NULL));
    assert_ok(image_score(&a, &b, all, NULL, &whole, NULL));
    assert_near(whole.psnr, plain.psnr, 0);
    assert_near(whole.ssim, plain.ssim, 1e-12);
    assert_near(whole.flip, plain.flip, 1e-7); /* the map is float */
    assert_ok(image_score(&a, &b, valid, &map, &masked, NULL));
    double square = 0, flip = 0;
    int count = 0;
    for (int i = 0; i < COUNT; i++) {
        for (int c = 0; c < 3 && valid[i]; c++)
            square += pow((double)a.pixels[3 * i + c] - (double)b.pixels[3 * i + c], 2);
        count += valid[i];
        flip += (double)map.pixels[i];
        assert_true(valid[i] ? map.pixels[i] > 0 : map.pixels[i] == 0);
    }
    assert_near(masked.psnr, -10 * log10(square / (3 * count)), 1e-12);
    assert_near(masked.flip, flip / count, 1e-12);
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3 && !valid[i]; c++) {
            a.pixels[3 * i + c] = 0.9f;
            b.pixels[3 * i + c] = 0.1f;
        }
    assert_ok(image_score(&a, &b, valid, NULL, &again, NULL));
    assert_memory_equal(&again, &masked, sizeof masked);
    assert_ok(image_score(&a, &b, none, &map, &masked, NULL));
    assert_true(isnan(masked.psnr) && isnan(masked.ssim) && isnan(masked.flip));
    image_free(&a);
    image_free(&b);
    image_free(&map);
}

int main(void)
{
    enum { GOLDEN_COUNT = sizeof golden_cases / sizeof *golden_cases };
    const struct CMUnitTest others[] = {
        cmocka_unit_test(psnr_by_hand),
        cmocka_unit_test(quantize_rounds_half_up),
        cmocka_unit_test(ssim_equals_brute_force),
        cmocka_unit_test(ssim_of_constant_images),
        cmocka_unit_test(ssim_inside),
        cmocka_unit_test(flip_properties),
        cmocka_unit_test(flip_refusals),
        cmocka_unit_test(same_bits_for_threads_and_instructions),
        cmocka_unit_test(masked_scores),
    };
    struct CMUnitTest tests[GOLDEN_COUNT + sizeof others / sizeof *others];
    size_t count = 0;
    for (; count < GOLDEN_COUNT; count++)
        tests[count] = (struct CMUnitTest){golden_cases[count].name, agrees_with_published_programs, NULL,
                                           NULL, &golden_cases[count]};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        tests[count++] = others[i];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
