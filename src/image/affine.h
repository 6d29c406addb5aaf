/* SPDX-License-Identifier: Apache-2.0 */
/* image/affine.h -- 3 x 4 colour matrices that model the exposure and white balance of a photo: apply,
   differentiate, fit by least squares. */
#ifndef GBT_IMAGE_AFFINE_H
#define GBT_IMAGE_AFFINE_H

#include "base/image.h"

/** Row-major [3][4]: out_r = m[4r] red + m[4r + 1] green + m[4r + 2] blue + m[4r + 3]. */
enum { AFFINE_NUMBERS = 12 };

void affine_identity(float m[AFFINE_NUMBERS]);

/** out = m(in), without clamping. Both have 3 channels and equal size; `out` may be `in`. Threads: parallel
    inside. */
void affine_apply(const float m[AFFINE_NUMBERS], const image *in, image *out);

/**
 * Adjoint of affine_apply().
 *
 * @param in  [in]     the input of affine_apply()
 * @param d   [in,out] dL/dout; becomes dL/din
 * @param d_m [out]    dL/dm, summed in double
 * Threads: parallel inside; the same bits for every thread count.
 */
void affine_backward(const float m[AFFINE_NUMBERS], const image *in, image *d, double d_m[AFFINE_NUMBERS]);

/**
 * Model the camera's clipping: where a channel of `photo` is white (>= 0.99) or black (<= 0.01) and `shown`
 * is beyond it, `shown` is set to the photo's value, so that the pixel contributes no loss.
 *
 * @param shown [in,out] a render after the photo's matrix, 3 channels, the size of `photo`
 * Threads: parallel inside.
 */
void affine_cut(const image *photo, image *shown);

/** Adjoint of affine_cut(): d (dL/d shown) becomes 0 where `shown` was clipped. Threads: parallel inside. */
void affine_cut_backward(const image *photo, const image *shown, image *d);

/**
 * The least-squares matrix from the columns [begin, end) of `from` to those of `to`, over the pixels where
 * `valid` is not 0 (NULL: all).
 *
 * Minimises mean |m(from) - to|^2 + 1e-6 |m - identity|^2, so that where the colours do not determine the
 * matrix (a black or single-coloured image, no columns) it stays as near to the identity as possible.
 * Non-finite values are treated as 0.
 */
void affine_fit(const image *from, const image *to, const unsigned char *valid, int begin, int end,
                float m[AFFINE_NUMBERS]);

/** The right halves of a render and its photo, and the mask of their valid pixels. Free with
    affine_half_free(). */
typedef struct affine_half {
    image render, photo;
    unsigned char *valid; /* NULL: all */
} affine_half;

/**
 * Prepare the scoring of photos with individual exposures: fit the colour matrix on the left half, score the
 * right half.
 *
 * The left half is columns [0, width / 2), the right half the rest.
 *
 * @param render       [in,out] 3 channels, not clamped; completely replaced by m(render)
 * @param photo        [in]     the size of render
 * @param valid        [in]     NULL (all) or [height][width]: 0 for pixels that are excluded from the fit
 * @param out          [out]    free with affine_half_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes), GBT_ERR_NO_MEMORY
 */
gbt_status affine_split(image *render, const image *photo, const unsigned char *valid, affine_half *out,
                        gbt_error *err);

void affine_half_free(affine_half *half);

#endif
