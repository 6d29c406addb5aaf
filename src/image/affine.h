/* SPDX-License-Identifier: Apache-2.0 */
/* image/affine.h -- colours through a 3 x 4 matrix: a photo's exposure and white balance, learned, or fitted
   to a part of it. */
#ifndef GBT_IMAGE_AFFINE_H
#define GBT_IMAGE_AFFINE_H

#include "base/image.h"

/** Row-major [3][4]: out_r = m[4r] red + m[4r + 1] green + m[4r + 2] blue + m[4r + 3]. */
enum { AFFINE_NUMBERS = 12 };

void affine_identity(float m[AFFINE_NUMBERS]);

/** out = m(in), nothing clamped. Both 3 channels and of one size; `out` may be `in`. Threads: parallel
    inside. */
void affine_apply(const float m[AFFINE_NUMBERS], const image *in, image *out);

/**
 * Adjoint of affine_apply().
 *
 * @param in  [in]     what affine_apply() was given
 * @param d   [in,out] dL/dout; becomes dL/din
 * @param d_m [out]    dL/dm, summed in double
 * Threads: parallel inside; the same bits for every thread count.
 */
void affine_backward(const float m[AFFINE_NUMBERS], const image *in, image *d, double d_m[AFFINE_NUMBERS]);

/**
 * What a camera does to light beyond its range: where a channel of `photo` is white (>= 0.99) or black (<=
 * 0.01) and that of `shown` lies beyond it, `shown` becomes the photo, so that the difference asks nothing of
 * it.
 *
 * @param shown [in,out] a picture through the photo's matrix, 3 channels, the size of `photo`
 * Threads: parallel inside.
 */
void affine_cut(const image *photo, image *shown);

/** Adjoint of affine_cut(): d (dL/d shown) is 0 where it has cut `shown`. Threads: parallel inside. */
void affine_cut_backward(const image *photo, const image *shown, image *d);

/**
 * The matrix that brings the columns [begin, end) of `from` nearest to those of `to`, by least squares, over
 * the pixels where `valid` (NULL: all).
 *
 * Minimises mean |m(from) - to|^2 + 1e-6 |m - identity|^2, so that colours which tell nothing (a black or
 * one-coloured picture, no columns) leave the matrix as near to the identity as they allow. Values that are
 * not finite count as 0.
 */
void affine_fit(const image *from, const image *to, const unsigned char *valid, int begin, int end,
                float m[AFFINE_NUMBERS]);

/** The right halves of a render and its photo, and which of their pixels count. Free with
    affine_half_free(). */
typedef struct affine_half {
    image render, photo;
    unsigned char *valid; /* NULL: all */
} affine_half;

/**
 * How a picture is scored when every photo may have an exposure of its own: fit on its left half, score its
 * right half.
 *
 * The left half are columns [0, width / 2), the right half the rest.
 *
 * @param render       [in,out] 3 channels, not clamped; replaced by m(render), whole
 * @param photo        [in]     the size of render
 * @param valid        [in]     NULL (all) or [height][width]: 0 for pixels that are not fitted
 * @param out          [out]    free with affine_half_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes), GBT_ERR_NO_MEMORY
 */
gbt_status affine_split(image *render, const image *photo, const unsigned char *valid, affine_half *out,
                        gbt_error *err);

void affine_half_free(affine_half *half);

#endif
