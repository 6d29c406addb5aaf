/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/image_support.h -- small pictures, and SSIM with its gradient as plain 121-term sums in
   double. */
#ifndef GBT_IMAGE_SUPPORT_H
#define GBT_IMAGE_SUPPORT_H

#include "base/image.h"
#include "base/rng.h"
#include "test_support.h"

/** |got - want| <= tolerance in double; NaN fails. cmocka's own assert_float_equal() rounds both to float
    first. */
#define assert_near(got, want, tolerance)                                                                    \
    do {                                                                                                     \
        const double near_got_ = (got), near_want_ = (want);                                                 \
        if (!(fabs(near_got_ - near_want_) <= (tolerance)))                                                  \
            fail_msg("%s is %.17g, not %.17g within %g", #got, near_got_, near_want_, (double)(tolerance));  \
    } while (0)

static inline image make_image(int width, int height, int channels)
{
    image im;
    assert_ok(image_alloc(&im, width, height, channels, &assert_ok_err_));
    memset(im.pixels, 0, (size_t)width * (size_t)height * (size_t)channels * sizeof *im.pixels);
    return im;
}

static inline image make_constant(int width, int height, float value)
{
    image im = make_image(width, height, 3);
    for (int i = 0; i < width * height * 3; i++)
        im.pixels[i] = value;
    return im;
}

static inline image make_noise(int width, int height, int channels, uint64_t seed)
{
    image im = make_image(width, height, channels);
    for (int i = 0; i < width * height * channels; i++)
        im.pixels[i] = rng_uniform(seed, 0, (uint64_t)i);
    return im;
}

static inline double brute_tap(int dx, int dy)
{
    double sum = 0;
    for (int k = -5; k <= 5; k++)
        sum += exp(-k * k / 4.5);
    return exp(-(dx * dx + dy * dy) / 4.5) / (sum * sum);
}

typedef struct brute_point {
    double ssim, by_mean, by_variance, by_covariance, mean_x, mean_y;
} brute_point;

/* The map at one value of x and y, which are [height][width][channels], and its partials by mu_x, var_x and
   cov. */
static inline brute_point brute_at(const double *x, const double *y, int width, int height, int channels,
                                   int column, int row, int c, const double taps[121])
{
    double a = 0, b = 0, xx = 0, yy = 0, xy = 0;
    for (int dy = -5; dy <= 5; dy++)
        for (int dx = -5; dx <= 5; dx++) {
            if (column + dx < 0 || column + dx >= width || row + dy < 0 || row + dy >= height)
                continue;
            const size_t i = (size_t)(((row + dy) * width + column + dx) * channels + c);
            const double w = taps[(dy + 5) * 11 + dx + 5];
            a += w * x[i];
            b += w * y[i];
            xx += w * x[i] * x[i];
            yy += w * y[i] * y[i];
            xy += w * x[i] * y[i];
        }
    const double n1 = 2 * a * b + 1e-4, n2 = 2 * (xy - a * b) + 9e-4, d1 = a * a + b * b + 1e-4,
                 d2 = xx - a * a + yy - b * b + 9e-4;
    const double ssim = n1 * n2 / (d1 * d2);
    return (brute_point){ssim, 2 * b * n2 / (d1 * d2) - 2 * a * ssim / d1, -ssim / d2, 2 * n1 / (d1 * d2), a,
                         b};
}

static inline void brute_taps(double taps[121])
{
    for (int i = 0; i < 121; i++)
        taps[i] = brute_tap(i % 11 - 5, i / 11 - 5);
}

static inline double *widened(const image *im)
{
    const size_t count = (size_t)im->width * (size_t)im->height * (size_t)im->channels;
    double *out = malloc(count * sizeof *out);
    assert_non_null(out);
    for (size_t i = 0; i < count; i++)
        out[i] = (double)im->pixels[i];
    return out;
}

static inline double brute_ssim(const image *a, const image *b)
{
    double *x = widened(a), *y = widened(b), taps[121], sum = 0;
    brute_taps(taps);
    for (int row = 0; row < a->height; row++)
        for (int column = 0; column < a->width; column++)
            for (int c = 0; c < a->channels; c++)
                sum += brute_at(x, y, a->width, a->height, a->channels, column, row, c, taps).ssim;
    free(x);
    free(y);
    return sum / (a->width * a->height * a->channels);
}

#endif
