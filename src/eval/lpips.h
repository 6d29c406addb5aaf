/* SPDX-License-Identifier: Apache-2.0 */
/* eval/lpips.h -- LPIPS (Zhang 2018, version 0.1): distance of two images in the features of a network that
   was trained on photos.

   The user provides the network: a .safetensors file with the state_dict of the Python package `lpips`
   (docs/metrics.md says how to make one). */
#ifndef GBT_EVAL_LPIPS_H
#define GBT_EVAL_LPIPS_H

#include "base/image.h"
#include "image/metrics.h"

typedef struct lpips lpips; /* a network; const use from any thread */

/**
 * Read a network: VGG16 or AlexNet, told apart by their first layer, with the weights of the five distances.
 *
 * @param out [out] NULL on failure; close with lpips_close()
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT (an array is missing or has another shape), GBT_ERR_NO_MEMORY
 */
gbt_status lpips_open(const char *path, lpips **out, gbt_error *err);
void lpips_close(lpips *net); /* NULL is fine */

const char *lpips_network(const lpips *net); /* "vgg" or "alex" */

/**
 * Both scores of a render. For each of five layers, features are normalised to unit length per pixel, their
 * squared differences are weighted per channel and averaged over the pixels; the score is the sum over the
 * layers. 0 for equal images.
 *
 * @param render, photo [in] 3 channels, equal size, values in [0, 1]
 * @param valid         [in] optional (NULL), [height][width]: where 0, the render is replaced by the photo
 * @param first_column  [in] columns left of it are cut off; the rest must have at least 16 (VGG16) or 31
 *                           (AlexNet) pixels on each side
 * @return GBT_OK, GBT_ERR_ARGUMENT (sizes), GBT_ERR_NO_MEMORY
 * Threads: parallel inside; the same bits for every number of threads and every instruction set.
 * Cost: VGG16 1.2 million multiply-adds (two images, each evaluated twice) and up to 1 kB per pixel; AlexNet
 * 60 thousand multiply-adds.
 */
gbt_status lpips_compare(const lpips *net, const image *render, const image *photo,
                         const unsigned char *valid, int first_column, lpips_scores *out, gbt_error *err);

#endif
