/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/test_loss.c -- the training loss and its gradient against differences and against a plain
   adjoint in double. */
#include "test_support.h"

#include "base/cpu.h"
#include "base/image.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "image/metrics.h"
#include "image_support.h"

/* L in double, and optionally dL/dx, straight from the definition: 121 terms per value, nothing separable,
   nothing folded. */
static double plain_loss(const double *source_x, const double *source_y, const unsigned char *valid,
                         int width, int height, double weight, double *d_x)
{
    const int count = width * height * 3;
    double *x = calloc((size_t)count, sizeof *x), *y = calloc((size_t)count, sizeof *y), taps[121];
    brute_point *points = calloc((size_t)count, sizeof *points);
    assert_true(x != NULL && y != NULL && points != NULL);
    brute_taps(taps);
    int values = 0;
    for (int i = 0; i < count; i++)
        if (valid == NULL || valid[i / 3]) {
            x[i] = source_x[i];
            y[i] = source_y[i];
            values++;
        }
    double l1 = 0, ssim = 0;
    for (int i = 0; i < count; i++) {
        if (valid != NULL && !valid[i / 3])
            continue; /* its partials stay 0 */
        points[i] = brute_at(x, y, width, height, 3, i / 3 % width, i / 3 / width, i % 3, taps);
        l1 += fabs(x[i] - y[i]);
        ssim += points[i].ssim;
    }
    for (int i = 0; d_x != NULL && i < count; i++) {
        d_x[i] = 0;
        if (valid != NULL && !valid[i / 3])
            continue;
        double sum = 0;
        for (int k = 0; k < 121; k++) {
            const int column = i / 3 % width + k % 11 - 5, row = i / 3 / width + k / 11 - 5;
            if (column < 0 || column >= width || row < 0 || row >= height)
                continue;
            const brute_point *p = &points[(row * width + column) * 3 + i % 3];
            sum += taps[k] * (p->by_mean + 2 * (x[i] - p->mean_x) * p->by_variance +
                              (y[i] - p->mean_y) * p->by_covariance);
        }
        d_x[i] = ((1 - weight) * (x[i] > y[i] ? 1 : x[i] < y[i] ? -1 : 0) - weight * sum) / values;
    }
    free(x);
    free(y);
    free(points);
    return values == 0 ? 0 : (1 - weight) * l1 / values + weight * (1 - ssim / values);
}

static double relative_error(const float *got, const double *want, int count)
{
    double error = 0, size = 0;
    for (int i = 0; i < count; i++) {
        const double difference = (double)got[i] - want[i];
        error += difference * difference;
        size += want[i] * want[i];
    }
    return sqrt(error / size);
}

typedef struct loss_case {
    const char *name;
    int width, height;
    double weight;
    float level; /* around which x and y vary */
    float spread;
    int mask; /* 0 none, n: every n-th pixel is left out */
} loss_case;

static loss_case loss_cases[] = {
    {"1 x 1", 1, 1, 0.2, 0.5f, 0.5f, 0},
    {"1 x 11", 1, 11, 0.2, 0.5f, 0.5f, 0},
    {"11 x 1", 11, 1, 0.2, 0.5f, 0.5f, 0},
    {"5 x 5", 5, 5, 0.2, 0.5f, 0.5f, 0},
    {"13 x 12", 13, 12, 0.2, 0.5f, 0.5f, 0},
    {"6 x 35", 6, 35, 0.2, 0.5f, 0.5f, 0},
    {"16 x 17, L1 alone", 16, 17, 0.0, 0.5f, 0.5f, 0},
    {"16 x 17, DSSIM alone", 16, 17, 1.0, 0.5f, 0.5f, 0},
    {"even 0.6", 14, 13, 0.2, 0.6f, 0.01f, 0},
    {"even 1.0, where float32 variances fail", 14, 13, 0.2, 1.0f, 0.002f, 0},
    {"black", 14, 13, 0.2, 0.0f, 0.002f, 0},
    {"unclamped render", 9, 14, 0.2, 1.5f, 3.0f, 0},
    {"every second pixel left out", 15, 14, 0.2, 0.5f, 0.5f, 2},
    {"every third pixel left out, DSSIM alone", 7, 34, 1.0, 0.5f, 0.5f, 3},
    {"one pixel, left out or not", 1, 1, 0.5, 0.5f, 0.5f, 3},
};

static void gradient_is_right(void **state)
{
    const loss_case *t = *state;
    const int count = t->width * t->height * 3;
    image x = make_noise(t->width, t->height, 3, 3), y = make_noise(t->width, t->height, 3, 4),
          d_x = make_noise(t->width, t->height, 3, 5);
    unsigned char *valid = t->mask > 0 ? malloc((size_t)count) : NULL;
    for (int i = 0; i < count; i++) {
        x.pixels[i] = t->level + t->spread * (2 * x.pixels[i] - 1);
        y.pixels[i] = t->level + t->spread * (2 * y.pixels[i] - 1);
        if (fabsf(x.pixels[i] - y.pixels[i]) < 0.01f * t->spread)
            y.pixels[i] =
                x.pixels[i] - 0.01f * t->spread; /* a difference across the kink of |x - y| means nothing */
    }
    for (int i = 0; valid != NULL && i < count / 3; i++)
        valid[i] = i % t->mask != t->mask - 1 ? (unsigned char)(1 + i % 200) : 0;

    loss_scratch scratch = {0};
    image_loss_result out;
    assert_ok(image_loss(&x, &y, valid, t->weight, &scratch, &d_x, &out, &assert_ok_err_));
    double *wide_x = widened(&x), *wide_y = widened(&y), *want = malloc((size_t)count * sizeof *want);
    float *got = calloc((size_t)count, sizeof *got);
    assert_true(want != NULL && got != NULL);
    const double loss = plain_loss(wide_x, wide_y, valid, t->width, t->height, t->weight, want);
    assert_near(out.loss, loss, 1e-12);
    assert_near(out.loss, (1 - t->weight) * out.l1 + t->weight * (1 - out.ssim), 1e-15);
    const double adjoint_error = relative_error(d_x.pixels, want, count);
    if (!(adjoint_error <= 1e-7))
        fail_msg("%s: gradient is off by %g from the plain adjoint", t->name, adjoint_error);

    /* Differences of fourth order, borders included: all values of the small images, every 11th of the
       others. */
    const double h = 1e-3 * fmin((double)t->spread, 0.1);
    const int stride = count <= 100 ? 1 : 11;
    int taken = 0;
    for (int i = 0; i < count; i += stride, taken++) {
        double at[4];
        static const int steps[4] = {-2, -1, 1, 2};
        const double keep = wide_x[i];
        for (int k = 0; k < 4; k++) {
            wide_x[i] = keep + steps[k] * h;
            at[k] = plain_loss(wide_x, wide_y, valid, t->width, t->height, t->weight, NULL);
        }
        wide_x[i] = keep;
        want[taken] = (8 * (at[2] - at[1]) - (at[3] - at[0])) / (12 * h);
        got[taken] = d_x.pixels[i];
    }
    const double difference_error = relative_error(got, want, taken);
    if (!(difference_error <= 1e-6))
        fail_msg("%s: gradient is off by %g from differences", t->name, difference_error);

    for (int i = 0; valid != NULL && i < count; i++)
        if (!valid[i / 3])
            assert_true(d_x.pixels[i] == 0.0f);
    free(wide_x);
    free(wide_y);
    free(want);
    free(got);
    free(valid);
    loss_scratch_free(&scratch);
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
}

/* Pictures of several tiles, across and down: the plain adjoint knows none. */
static void tiles_meet(void **state)
{
    (void)state;
    static const int sizes[][2] = {{500, 9}, {247, 5}, {492, 5}, {493, 5}, {8, 300}, {7, 129}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int width = sizes[k][0], height = sizes[k][1], count = 3 * width * height;
        image x = make_noise(width, height, 3, 1), y = make_noise(width, height, 3, 2),
              d_x = make_noise(width, height, 3, 3);
        double *wide_x = widened(&x), *wide_y = widened(&y), *want = malloc((size_t)count * sizeof *want);
        assert_non_null(want);
        for (int mask = 0; mask < 2; mask++) {
            unsigned char *valid = mask ? malloc((size_t)count) : NULL;
            for (int i = 0; mask && i < count / 3; i++)
                valid[i] = i % 9 != 4;
            loss_scratch scratch = {0};
            image_loss_result out;
            assert_ok(image_loss(&x, &y, valid, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
            assert_near(out.loss, plain_loss(wide_x, wide_y, valid, width, height, 0.2, want), 1e-12);
            const double error = relative_error(d_x.pixels, want, count);
            if (!(error <= 1e-7))
                fail_msg("%d x %d: gradient is off by %g", width, height, error);
            loss_scratch_free(&scratch);
            free(valid);
        }
        free(wide_x);
        free(wide_y);
        free(want);
        image_free(&x);
        image_free(&y);
        image_free(&d_x);
    }
}

static void parts_agree_with_the_metrics(void **state)
{
    (void)state;
    image x = make_noise(45, 37, 3, 1), y = make_noise(45, 37, 3, 2), d_x = make_image(45, 37, 3);
    loss_scratch scratch = {0};
    image_loss_result out;
    assert_ok(image_loss(&x, &y, NULL, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
    double ssim;
    assert_ok(metric_ssim(&x, &y, &ssim, NULL));
    assert_near(out.ssim, ssim, 1e-15);
    assert_near(-10 * log10(out.mse), metric_psnr(&x, &y), 1e-12);
    double l1 = 0;
    for (int i = 0; i < 45 * 37 * 3; i++)
        l1 += fabs((double)x.pixels[i] - (double)y.pixels[i]);
    assert_near(out.l1, l1 / (45 * 37 * 3), 1e-14);
    unsigned char all[45 * 37];
    memset(all, 1, sizeof all);
    image d_masked = make_image(45, 37, 3);
    image_loss_result masked;
    assert_ok(image_loss(&x, &y, all, 0.2, &scratch, &d_masked, &masked, &assert_ok_err_)); /* scratch grows
                                                                                             */
    assert_memory_equal(&masked, &out, sizeof out);
    assert_memory_equal(d_masked.pixels, d_x.pixels, 45 * 37 * 3 * sizeof(float));
    loss_scratch_free(&scratch);
    assert_null(scratch.buffer);
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
    image_free(&d_masked);
}

static void identical_images(void **state)
{
    (void)state;
    static const float levels[] = {-1.0f, 0.0f, 0.6f, 1.0f, 100.0f, 255.0f}; /* -1: noise */
    for (size_t k = 0; k < sizeof levels / sizeof *levels; k++) {
        image x = levels[k] < 0.0f ? make_noise(23, 19, 3, 1) : make_constant(23, 19, levels[k]),
              d_x = make_noise(23, 19, 3, 2);
        loss_scratch scratch = {0};
        image_loss_result out;
        assert_ok(image_loss(&x, &x, NULL, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
        assert_true(out.loss == 0.0 && out.l1 == 0.0 && out.ssim == 1.0 && out.mse == 0.0);
        for (int i = 0; i < 23 * 19 * 3; i++)
            assert_true(fabsf(d_x.pixels[i]) < (levels[k] > 1.0f ? 1e-9f : 1e-14f));
        loss_scratch_free(&scratch);
        image_free(&x);
        image_free(&d_x);
    }
}

static void what_is_left_out_does_not_matter(void **state)
{
    (void)state;
    image x = make_noise(19, 18, 3, 1), y = make_noise(19, 18, 3, 2), d_x = make_image(19, 18, 3),
          d_again = make_image(19, 18, 3);
    unsigned char valid[19 * 18];
    for (int i = 0; i < 19 * 18; i++)
        valid[i] = i % 7 != 0;
    loss_scratch scratch = {0};
    image_loss_result out, again;
    assert_ok(image_loss(&x, &y, valid, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
    for (int i = 0; i < 19 * 18; i += 7) {
        x.pixels[3 * i] = NAN;
        y.pixels[3 * i + 1] = INFINITY;
        x.pixels[3 * i + 2] = 1e30f;
    }
    assert_ok(image_loss(&x, &y, valid, 0.2, &scratch, &d_again, &again, &assert_ok_err_));
    assert_memory_equal(&out, &again, sizeof out);
    assert_memory_equal(d_x.pixels, d_again.pixels, 19 * 18 * 3 * sizeof(float));

    memset(valid, 0, sizeof valid);
    assert_ok(image_loss(&x, &y, valid, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
    assert_true(out.loss == 0.0 && out.l1 == 0.0 && out.ssim == 1.0 && isnan(out.mse));
    for (int i = 0; i < 19 * 18 * 3; i++)
        assert_true(d_x.pixels[i] == 0.0f);

    assert_ok(image_loss(&x, &y, NULL, 0.2, &scratch, &d_x, &out, &assert_ok_err_)); /* a NaN that counts
                                                                                        shows in the loss */
    assert_false(isfinite(out.loss));
    loss_scratch_free(&scratch);
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
    image_free(&d_again);
}

static void same_bits_for_threads_and_instructions(void **state)
{
    (void)state;
    enum { WIDTH = 261, HEIGHT = 140 }; /* several tiles */
    image x = make_noise(WIDTH, HEIGHT, 3, 1), y = make_noise(WIDTH, HEIGHT, 3, 2),
          d_first = make_image(WIDTH, HEIGHT, 3);
    image d_x = make_image(WIDTH, HEIGHT, 3);
    static unsigned char valid[WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        valid[i] = i % 5 != 0;
    image_loss_result first = {0}, out;
    for (int threads = 1; threads <= 4; threads++)
        for (int isa = CPU_PLAIN; isa <= CPU_AVX512; isa++) {
            parallel_set_threads(threads);
            cpu_limit_isa((cpu_isa)isa);
            loss_scratch scratch = {0};
            const int is_first = threads == 1 && isa == CPU_PLAIN;
            assert_ok(image_loss(&x, &y, valid, 0.2, &scratch, is_first ? &d_first : &d_x,
                                 is_first ? &first : &out, &assert_ok_err_));
            loss_scratch_free(&scratch);
            if (is_first)
                continue;
            assert_memory_equal(&out, &first, sizeof out);
            assert_memory_equal(d_x.pixels, d_first.pixels, WIDTH * HEIGHT * 3 * sizeof(float));
        }
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
    image_free(&d_first);
}

static void refusals(void **state)
{
    (void)state;
    image x = make_noise(8, 9, 3, 1), y = make_noise(9, 8, 3, 2), grey = make_noise(8, 9, 1, 1),
          d_x = make_image(8, 9, 3);
    loss_scratch scratch = {0};
    image_loss_result out;
    const struct {
        const image *x, *y;
        image *d_x;
        double weight;
    } cases[] = {
        {&x, &y, &d_x, 0.2},   {&grey, &grey, &grey, 0.2}, {&x, &x, &y, 0.2},
        {&x, &x, &d_x, -0.01}, {&x, &x, &d_x, 1.01},       {&x, &x, &d_x, (double)NAN},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        gbt_error err = {0};
        assert_int_equal(
            image_loss(cases[i].x, cases[i].y, NULL, cases[i].weight, &scratch, cases[i].d_x, &out, &err),
            GBT_ERR_ARGUMENT);
        assert_true(err.text[0] != '\0');
        assert_null(scratch.buffer);
    }
    mem_fail_after(0);
    assert_int_equal(image_loss(&x, &x, NULL, 0.2, &scratch, &d_x, &out, NULL), GBT_ERR_NO_MEMORY);
    mem_fail_after(-1);
    assert_null(scratch.buffer);
    image_free(&x);
    image_free(&y);
    image_free(&grey);
    image_free(&d_x);
}

static void real_photo(void **state)
{
    (void)state;
    const char *path = shared_path("data/castle/images/0000.jpg");
    if (path == NULL)
        skip();
    enum { WIDTH = 200, HEIGHT = 150 };
    image photo;
    assert_ok(image_read(path, &photo, &assert_ok_err_));
    assert_true(photo.width > WIDTH && photo.height > HEIGHT);
    image x = make_image(WIDTH, HEIGHT, 3), y = make_image(WIDTH, HEIGHT, 3),
          d_x = make_image(WIDTH, HEIGHT, 3);
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) { /* the top left corner, against itself moved by a pixel and
                                                      darkened */
        const int at = (i / 3 / WIDTH * photo.width + i / 3 % WIDTH) * 3 + i % 3;
        y.pixels[i] = photo.pixels[at];
        x.pixels[i] = 0.97f * photo.pixels[at + 3];
    }
    loss_scratch scratch = {0};
    image_loss_result out;
    assert_ok(image_loss(&x, &y, NULL, 0.2, &scratch, &d_x, &out, &assert_ok_err_));
    double *wide_x = widened(&x), *wide_y = widened(&y), *want = malloc(WIDTH * HEIGHT * 3 * sizeof *want);
    assert_near(out.loss, plain_loss(wide_x, wide_y, NULL, WIDTH, HEIGHT, 0.2, want), 1e-12);
    const double error = relative_error(d_x.pixels, want, WIDTH * HEIGHT * 3);
    if (!(error <= 1e-7))
        fail_msg("gradient is off by %g", error);
    free(wide_x);
    free(wide_y);
    free(want);
    loss_scratch_free(&scratch);
    image_free(&photo);
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
}

int main(void)
{
    enum { CASE_COUNT = sizeof loss_cases / sizeof *loss_cases };
    const struct CMUnitTest others[] = {
        cmocka_unit_test(tiles_meet),
        cmocka_unit_test(parts_agree_with_the_metrics),
        cmocka_unit_test(identical_images),
        cmocka_unit_test(what_is_left_out_does_not_matter),
        cmocka_unit_test(same_bits_for_threads_and_instructions),
        cmocka_unit_test(refusals),
        cmocka_unit_test(real_photo),
    };
    struct CMUnitTest tests[CASE_COUNT + sizeof others / sizeof *others];
    size_t count = 0;
    for (; count < CASE_COUNT; count++)
        tests[count] =
            (struct CMUnitTest){loss_cases[count].name, gradient_is_right, NULL, NULL, &loss_cases[count]};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        tests[count++] = others[i];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
