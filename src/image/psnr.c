/* SPDX-License-Identifier: Apache-2.0 */
/* image/psnr.c -- PSNR of images with values in [0, 1], and rounding to 8 bit. */
#include "image/metrics.h"

#include <math.h>
#include <stdbool.h>

double metric_psnr(const image *a, const image *b) { return metric_psnr_valid(a, b, NULL); }

double metric_psnr_valid(const image *a, const image *b, const unsigned char *valid)
{
    if (a->width != b->width || a->height != b->height || a->channels != b->channels)
        return (double)NAN;
    const size_t channels = (size_t)a->channels, width = (size_t)a->width, row_values = width * channels;
    double sum = 0;
    size_t left_out = 0;
    for (int y = 0; y < a->height; y++) {
        const float *row_a = a->pixels + (size_t)y * row_values, *row_b = b->pixels + (size_t)y * row_values;
        double row_sum = 0; /* summing per row first keeps the rounding error of millions of terms small */
        for (size_t x = 0; x < width; x++) {
            const bool counts = valid == NULL || valid[(size_t)y * width + x] != 0;
            left_out += !counts;
            for (size_t i = x * channels; counts && i < (x + 1) * channels; i++) {
                const double difference = (double)row_a[i] - (double)row_b[i];
                row_sum += difference * difference;
            }
        }
        sum += row_sum;
    }
    const double mse =
        sum / ((double)a->height * (double)row_values - (double)(left_out * channels)); /* 0 / 0 is NaN */
    const double psnr = -10 * log10(mse);
    return psnr > METRIC_PSNR_MAX ? METRIC_PSNR_MAX : psnr; /* written so that NaN stays NaN */
}

void image_quantize(image *im)
{
    const size_t count = (size_t)im->width * (size_t)im->height * (size_t)im->channels;
    for (size_t i = 0; i < count; i++) {
        const float value = im->pixels[i];
        const float clamped = !(value > 0.0f) ? 0.0f : value >= 1.0f ? 1.0f : value; /* NaN becomes 0 */
        im->pixels[i] = floorf(clamped * 255.0f + 0.5f) / 255.0f;
    }
}
