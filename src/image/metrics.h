/* SPDX-License-Identifier: Apache-2.0 */
/* image/metrics.h -- image metrics (PSNR, SSIM, FLIP), scores of a render against a photo, and the training
   loss with its gradient. */
#ifndef GBT_IMAGE_METRICS_H
#define GBT_IMAGE_METRICS_H

#include <stdbool.h>

#include "base/image.h"

#define METRIC_PSNR_MAX 100.0 /* dB, reported for images that are equal or nearly so */

/**
 * Peak signal to noise ratio, dB: 20 log10(1 / sqrt(mse)) over all values, in double, at most
 * METRIC_PSNR_MAX.
 *
 * @param a, b  equal width, height and channels (any number), values in [0, 1]
 * @return NaN when the sizes differ or a value is NaN
 * Threads: any.
 */
double metric_psnr(const image *a, const image *b);

/** The same over the pixels where `valid`, [height][width], is not 0 (NULL: all); NaN where there is none. */
double metric_psnr_valid(const image *a, const image *b, const unsigned char *valid);

/**
 * Mean SSIM over all pixels and channels, in double.
 *
 * 11 x 11 Gaussian of sigma 1.5, zero padding, window not renormalised at borders, C1 = 0.01^2, C2 = 0.03^2,
 * variances E[x^2] - mu^2. Identical images give exactly 1. Products of floats are exact in double, so
 * variances are accurate to 1e-15 of E[x^2]. (In float32 this one-pass form gives 1.00003 for constant
 * images, and -0.3 for constant 255.) Images may be smaller than the window: both are 0 beyond the border.
 *
 * @param a, b  equal width, height (from 1 x 1) and channels (any number)
 * @param ssim [out] (-1, 1]; NaN when the sizes differ, or a value is not finite
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: any; the same bits for every thread count and instruction set.
 */
gbt_status metric_ssim(const image *a, const image *b, double *ssim, gbt_error *err);

/** The mean over the pixels whose window is entirely inside the image, which does not depend on how borders
    are treated; NaN below 11 x 11 pixels. */
gbt_status metric_ssim_interior(const image *a, const image *b, double *ssim, gbt_error *err);

/**
 * Mean LDR-FLIP (Andersson 2020) at 67.02 pixels per degree (0.7 m from a screen of 3840 pixels in 0.7
 * m).
 *
 * @param a, reference  3 channels, equal size; sRGB values, clamped to [0, 1], NaN as 0
 * @param mean          [out] [0, 1], 0 for identical images
 * @param error_map     [out] optional: 1 channel, of a's size, allocated by the caller
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 * Threads: any; the same bits for every thread count. Cost: 24 bytes of scratch per pixel.
 */
gbt_status metric_flip(const image *a, const image *reference, double *mean, image *error_map,
                       gbt_error *err);

/** Round to 8 bit as the PNG writer does, in place: floor(clamp(x) * 255 + 0.5) / 255; NaN becomes 0. */
void image_quantize(image *im);

/** Scores of an image. NaN when no pixel is valid. */
typedef struct image_scores {
    double psnr, ssim, flip;
} image_scores;

/**
 * PSNR, SSIM and FLIP of the pixels where `valid` (NULL: all). Invalid pixels are 0 in both images for
 * windows and filters, and are excluded from the means.
 *
 * @param a, photo 3 channels, equal size; round them first (image_quantize()), as published scores do
 * @param flip_map  [out] optional: 1 channel, of their size, allocated by the caller; 0 where not valid
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes), GBT_ERR_NO_MEMORY
 */
gbt_status image_score(const image *a, const image *photo, const unsigned char *valid, image *flip_map,
                       image_scores *out, gbt_error *err);

/**
 * image_score() as every command scores a render against its photo: both are rounded to 8 bit; with
 * `exposure` only the right halves are scored, after affine_split().
 *
 * @param render, photo [in,out] rounded; the render is also multiplied by the matrix of affine_split()
 * @param flip_map      [out] optional, as in image_score(); always covers the whole images
 */
gbt_status image_score_photo(image *render, image *photo, const unsigned char *valid, bool exposure,
                             image *flip_map, image_scores *out, gbt_error *err);

/**
 * PSNR after applying to the render the 3 x 4 colour matrix that fits it best to the photo (affine_fit()):
 * the error that remains if the photo's exposure were known.
 *
 * @param first_column [in] the columns from here on are fitted and scored
 * @param psnr [out] dB; NaN when no pixel is valid
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status image_psnr_fitted(const image *render, const image *photo, const unsigned char *valid,
                             int first_column, double *psnr, gbt_error *err);

/** LPIPS (eval/lpips.h): with colours scaled to [-1, 1], as the network was trained, and left in [0, 1], as
    3DGS and its successors do. */
typedef struct lpips_scores {
    double lpips, lpips_01;
} lpips_scores;

/** Weight of 1 - SSIM in the image loss; L1 has the rest (Kerbl 2023, eq 7). */
#define IMAGE_DSSIM_WEIGHT 0.2

/** Scratch of image_loss(), reused from step to step. Start from {0}. */
typedef struct loss_scratch {
    double *buffer;
    size_t capacity; /* doubles */
} loss_scratch;

void loss_scratch_free(loss_scratch *s); /* zeroes the struct */

typedef struct image_loss_result {
    double loss, l1, ssim, mse; /* l1, ssim and mse are means over the valid pixels and their channels */
} image_loss_result;

/**
 * L = (1 - w) mean|x - y| + w (1 - SSIM(x, y)) and dL/dx, over the pixels where `valid` (NULL: all).
 *
 * SSIM is that of metric_ssim(). Invalid pixels are 0 in both images for its windows, are excluded from the
 * means, and have gradient 0. Without any valid pixel: loss 0, ssim 1, gradient 0, mse NaN. At x = y the
 * gradient of |x - y| is taken as 0. Non-finite values are not an error: they make `out->loss` NaN or
 * infinite, so check it before using d_x.
 *
 * @param x             [in]  render, unclamped, 3 channels
 * @param y             [in]  photo, the size of x
 * @param valid         [in]  optional, [height][width], 0 = leave out
 * @param dssim_weight  [in]  w, [0, 1]
 * @param scratch       [in,out] grows to 1 MB per thread
 * @param d_x           [out] the size of x, allocated by the caller, overwritten
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes, weight), GBT_ERR_NO_MEMORY
 * Threads: any with distinct `scratch`; the same bits for every thread count and instruction set. All sums
 * are in double, only d_x is rounded to float.
 * Cost: O(pixels); about 10 ns of one core per value with AVX-512, 11 with AVX2, 350 without (where a fused
 * multiply-add is a call): tests/image/bench_loss.
 */
gbt_status image_loss(const image *x, const image *y, const unsigned char *valid, double dssim_weight,
                      loss_scratch *scratch, image *d_x, image_loss_result *out, gbt_error *err);

#endif
