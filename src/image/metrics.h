/* image/metrics.h -- how far an image is from a photo: PSNR, SSIM, FLIP; and the training loss with its gradient. */
#ifndef GBT_IMAGE_METRICS_H
#define GBT_IMAGE_METRICS_H

#include "base/image.h"

/** 3-channel images of equal size, values in [0, 1]. 20 log10(1 / sqrt(mse)) over all values, in double; 100 for identical images (stated cap). */
double metric_psnr(const image *a, const image *b);

/** Mean SSIM: 11x11 Gaussian (sigma 1.5), zero padding, C1 = 0.01^2, C2 = 0.03^2, variances from centred differences (two-pass), in double. Identical images give 1. */
double metric_ssim(const image *a, const image *b);

/** Mean LDR-FLIP (Andersson et al. 2020), 67 pixels per degree. `error_map` optional: 1-channel image of a's size, caller allocated. */
gbt_status metric_flip(const image *a, const image *reference, double *mean, image *error_map, gbt_error *err);

/** Round to 8 bit as the PNG writer does, in place: floor(clamp(x) * 255 + 0.5) / 255. */
void image_quantize(image *im);

/** Scratch of image_loss(), reused from step to step. Start from {0}. */
typedef struct loss_scratch { float *buffer; size_t capacity; } loss_scratch;
void loss_scratch_free(loss_scratch *s);

typedef struct image_loss_result { double loss, l1, ssim, mse; } image_loss_result;

/**
 * L = (1 - w) mean|x - y| + w (1 - SSIM(x, y)) and dL/dx, over the pixels where valid (NULL: all).
 *
 * @param x       [in]  render, unclamped;  @param y [in] photo;  3 channels, equal size
 * @param d_x     [out] 3 channels, overwritten
 * Threads: same bits for every thread count. float32 SIMD inside; agrees with the double form to 1e-5 relative.
 */
gbt_status image_loss(const image *x, const image *y, const unsigned char *valid, double dssim_weight, loss_scratch *scratch, image *d_x,
                      image_loss_result *out, gbt_error *err);

#endif
