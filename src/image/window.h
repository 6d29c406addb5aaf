/* SPDX-License-Identifier: Apache-2.0 */
/* image/window.h -- the inner loops of SSIM: one image row at a time, in double, for each
   instruction set.

   The window is the 11 x 11 Gaussian of sigma 1.5 with zero padding, not renormalised at borders, applied as
   a column pass and a row pass. Rows are [width][channels] as in `image`, so a row pass steps by `channels`
   and treats all channels at once. Doubles are needed: in float32, cancellation in E[x^2] - mu^2 compared
   with C2 = 9e-4 causes errors of 1e-4 of the gradient in uniform parts of a photo.

   Every variant does the same operations in the same order without fused multiply-add, so all give the same
   bits. */
#ifndef GBT_IMAGE_WINDOW_H
#define GBT_IMAGE_WINDOW_H

#include <stddef.h>

/* exp(-k^2 / (2 1.5^2)) / sum; the sum of all eleven is 1 to the last bit but one. */
#define WINDOW_TAP0 0.2660117248617943
#define WINDOW_TAP1 0.21300553771125366
#define WINDOW_TAP2 0.1093606895097
#define WINDOW_TAP3 0.03600077212843082
#define WINDOW_TAP4 0.007598758135239184
#define WINDOW_TAP5 0.0010283800844791099

enum { WINDOW_RADIUS = 5, WINDOW_TAPS = 2 * WINDOW_RADIUS + 1, WINDOW_MOMENTS = 5 };

typedef struct window_kernels {
    /** Column pass of x, y, x^2, y^2, x y over 11 rows of `count` values; rows outside the image are rows of
        zeros. */
    void (*moments)(const float *const x[WINDOW_TAPS], const float *const y[WINDOW_TAPS], size_t count,
                    double *const out[WINDOW_MOMENTS]);

    /** Row pass of the five, then the SSIM map. Each input is readable for 5 `step` zeros before and after
        its `count` values. */
    void (*map)(const double *const in[WINDOW_MOMENTS], size_t count, size_t step, double *map);
} window_kernels;

/** The widest set that cpu_best_isa() allows. */
const window_kernels *window_kernels_best(void);

/** Pointers to the 11 rows around `row`, of `count` values each; rows outside the image point to `zeros`. */
void window_rows(const float *pixels, size_t count, size_t height, size_t row, const float *zeros,
                 const float *rows[WINDOW_TAPS]);

/** Sum as eight interleaved partial sums in a fixed order: the same bits for every instruction set. */
double window_sum(const double *values, size_t count);

#endif
