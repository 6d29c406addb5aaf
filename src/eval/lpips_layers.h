/* SPDX-License-Identifier: Apache-2.0 */
/* eval/lpips_layers.h -- feature maps, and the layers of an image network: convolution with ReLU, and
   max-pooling. */
#ifndef GBT_EVAL_LPIPS_LAYERS_H
#define GBT_EVAL_LPIPS_LAYERS_H

#include <stddef.h>

#include "gbtrace/status.h"

/** [height + 2 pad][width + 2 pad][channels], with zeros around the image. Start from {0}; free with
    feature_plane_free(). */
typedef struct feature_plane {
    int width, height, channels, pad;
    float *values; /* owned */
} feature_plane;

/** Make a feature map of zeros. GBT_ERR_ARGUMENT when it would have no pixel: the image was too small for the
    network. */
gbt_status feature_plane_make(int width, int height, int channels, int pad, feature_plane *out,
                              gbt_error *err);
void feature_plane_free(feature_plane *p);

/** The features of pixel (x, y), which may be up to `pad` pixels outside the image. */
static inline float *feature_plane_at(const feature_plane *p, int x, int y)
{
    const size_t row = (size_t)(p->width + 2 * p->pad);
    return p->values + ((size_t)(y + p->pad) * row + (size_t)(x + p->pad)) * (size_t)p->channels;
}

typedef struct convolution {
    int in, out, kernel, stride, pad; /* in, out: channels, `out` a multiple of 16; the others: pixels */
    float *weights;                   /* [kernel][kernel][in][out], owned */
    float *bias;                      /* [out], owned */
} convolution;

void convolution_free(convolution *c);

/**
 * out = max(0, bias + sum of weights x pixels of `in` around stride x (x, y)).
 *
 * @param in  [in]  has the channels and padding that the convolution needs
 * @param pad [in]  padding of `out`, for the next layer
 * @return GBT_OK, GBT_ERR_ARGUMENT (too small), GBT_ERR_NO_MEMORY
 * Threads: parallel inside, by rows; the same bits for every number of threads and every instruction set.
 * Cost: width x height x kernel^2 x in x out multiply-adds, at the speed of the decoder's matrix product.
 */
gbt_status convolve(const convolution *c, const feature_plane *in, int pad, feature_plane *out,
                    gbt_error *err);

/** Max-pooling with windows of size x size pixels and stride 2; only windows entirely inside the image.
    Errors: convolve(). */
gbt_status pool_max(const feature_plane *in, int size, int pad, feature_plane *out, gbt_error *err);

#endif
