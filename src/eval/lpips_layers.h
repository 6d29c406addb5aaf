/* SPDX-License-Identifier: Apache-2.0 */
/* eval/lpips_layers.h -- pictures of features, and what an image network makes of them: convolutions with
   ReLU, and maxima. */
#ifndef GBT_EVAL_LPIPS_LAYERS_H
#define GBT_EVAL_LPIPS_LAYERS_H

#include <stddef.h>

#include "gbtrace/status.h"

/** [height + 2 pad][width + 2 pad][channels], zeros around the picture. Start from {0}; free with
    feature_plane_free(). */
typedef struct feature_plane {
    int width, height, channels, pad;
    float *values; /* owned */
} feature_plane;

/** Zeros. GBT_ERR_ARGUMENT when there would be no pixel: the picture was too small for the network. */
gbt_status feature_plane_make(int width, int height, int channels, int pad, feature_plane *out,
                              gbt_error *err);
void feature_plane_free(feature_plane *p);

/** The features of pixel (x, y), which may lie up to `pad` outside. */
static inline float *feature_plane_at(const feature_plane *p, int x, int y)
{
    const size_t row = (size_t)(p->width + 2 * p->pad);
    return p->values + ((size_t)(y + p->pad) * row + (size_t)(x + p->pad)) * (size_t)p->channels;
}

typedef struct convolution {
    int in, out, kernel, stride, pad; /* channels; pixels. `out` is a multiple of 16 */
    float *weights;                   /* [kernel][kernel][in][out], owned */
    float *bias;                      /* [out], owned */
} convolution;

void convolution_free(convolution *c);

/**
 * out = max(0, bias + sum of weights x pixels of `in` around stride x (x, y)).
 *
 * @param in  [in]  channels and pad of the convolution
 * @param pad [in]  that `out` gets, for what comes next
 * @return GBT_OK, GBT_ERR_ARGUMENT (too small), GBT_ERR_NO_MEMORY
 * Threads: parallel inside, by rows; the same bits for every number of threads and every instruction set.
 * Cost: width x height x kernel^2 x in x out multiply-adds, at the speed of the decoder's matrix product.
 */
gbt_status convolve(const convolution *c, const feature_plane *in, int pad, feature_plane *out,
                    gbt_error *err);

/** The largest of each window of size x size pixels, every second pixel, where the whole window is in the
    picture. Errors: convolve(). */
gbt_status pool_max(const feature_plane *in, int size, int pad, feature_plane *out, gbt_error *err);

#endif
