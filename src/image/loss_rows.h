/* SPDX-License-Identifier: Apache-2.0 */
/* image/loss_rows.h -- the inner loops of the training loss, over rows of a tile in lane layout, for each
   instruction set.

   A tile is LOSS_LANES segments of L pixels side by side, and each segment is one SIMD lane of a row: channel
   c of pixel lane * L + j is at index (3 j + c) LOSS_LANES + lane. The neighbours of a pixel in its row are
   then LOSS_STEP values away in the same lane, so the row pass reads whole vectors like the column pass. Both
   compute LOSS_GROUP results from LOSS_SPAN values, so a value is loaded 3.5 times for 11 taps.

   All arithmetic is in double: in float32, cancellation in E[x^2] - mu^2 compared with C2 = 9e-4 causes
   errors of 1e-4 of the gradient in uniform parts of a photo. Every variant does the same operations on each
   value in the same order, so all give the same bits. */
#ifndef GBT_IMAGE_LOSS_ROWS_H
#define GBT_IMAGE_LOSS_ROWS_H

#include <stddef.h>

#include "image/window.h"

enum {
    LOSS_CHANNELS = 3,
    LOSS_LANES = 8,
    LOSS_STEP = LOSS_CHANNELS * LOSS_LANES, /* values from a pixel to the next one in its row */
    LOSS_GROUP = 4,                         /* rows, or pixels, whose results are computed together */
    LOSS_SPAN = LOSS_GROUP + 2 * WINDOW_RADIUS,
    LOSS_MARGIN = WINDOW_RADIUS * LOSS_STEP,   /* values that a row pass reads beyond both ends of a row */
    LOSS_EDGE = WINDOW_RADIUS * LOSS_CHANNELS, /* values of the pixels beyond one end of a row */
    LOSS_MOMENTS = 4,                          /* x, y, x^2 + y^2, x y */
    LOSS_PARTIALS = 3                          /* of the map by mu_x (total), var_x, cov */
};

/* In all functions `count` is the number of values in a row of the tile, LOSS_STEP L, with L a multiple of
   LOSS_GROUP and at least LOSS_LANES. */
typedef struct loss_kernels {
    /** Convert pixels in image order, [count], to lane layout, and back. */
    void (*to_lanes)(const float *pixels, size_t count, float *lanes);
    void (*from_lanes)(const float *lanes, size_t count, float *pixels);

    /** x, y, x^2 + y^2 and x y of one row. */
    void (*products)(const float *x, const float *y, size_t count, double *const out[LOSS_MOMENTS]);

    /** Row pass; `in` is readable for LOSS_MARGIN values before and after. */
    void (*row_pass)(const double *in, size_t count, double *out);

    /** Fill the LOSS_MARGIN values before and after a row from the neighbouring lanes; beyond the outer lanes
        come `left` and `right`, LOSS_EDGE values each. */
    void (*margins)(double *row, size_t count, const double *left, const double *right);

    /**
     * Column pass of the moments, the SSIM map of LOSS_GROUP rows, and its partials.
     *
     * @param moments  [in] LOSS_SPAN rows of each after the row pass, from WINDOW_RADIUS above the first
     * @param counts   [in] 1 for pixels that count in the map, else 0; one row each
     * @param weight   [in] weight of each row in the sum
     * @param partials [out] LOSS_PARTIALS rows each; 0 where `counts` is 0
     * @param sum      [in,out] [count], weight times map is added to it
     */
    void (*map)(const double *const moments[LOSS_MOMENTS][LOSS_SPAN], const double *const counts[LOSS_GROUP],
                const double weight[LOSS_GROUP], size_t count,
                double *const partials[LOSS_GROUP][LOSS_PARTIALS], double *sum);

    /**
     * Column pass of the partials and the gradient of LOSS_GROUP rows:
     * d_x = l1 sign(x - y) + ssim (G*p0 + 2 x G*p1 + y G*p2).
     *
     * @param partials [in] LOSS_SPAN rows of each after the row pass, from WINDOW_RADIUS above the first
     * @param absolute, square [in,out] [count], weight times |x - y| and (x - y)^2 are added to them
     */
    void (*gradient)(const double *const partials[LOSS_PARTIALS][LOSS_SPAN], const float *const x[LOSS_GROUP],
                     const float *const y[LOSS_GROUP], const double weight[LOSS_GROUP], size_t count,
                     double l1, double ssim, float *const d_x[LOSS_GROUP], double *absolute, double *square);
} loss_kernels;

/** The widest set that cpu_best_isa() allows. */
const loss_kernels *loss_kernels_best(void);

#endif
