/* SPDX-License-Identifier: Apache-2.0 */
/* data/mask.h -- which pixels of a photo are excluded by its mask image or its alpha channel. */
#ifndef GBT_DATA_MASK_H
#define GBT_DATA_MASK_H

#include "base/image.h"
#include "data/scene.h"

/**
 * Exclude pixels from `valid` by the view's mask image and, with GBT_ALPHA_MASK, by the photo's alpha
 * channel.
 *
 * The value of a mask pixel is the largest of its colour channels, times its alpha. The pixel is valid if
 * that is at least half the mask's largest value; masks of 0 and 1, of 0 and 255, and those with lossy
 * compression thus all work. A mask of another size must have the photo's aspect ratio within 1 px; a photo
 * pixel is then excluded if its area touches any excluded mask pixel.
 *
 * @param stored [in]     the photo as stored in its file
 * @param valid  [in,out] NULL (all valid), or [height][width] of the photo; allocated when a pixel is
 *                        excluded; the caller frees it, also after a failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT (the mask), GBT_ERR_NO_MEMORY
 */
gbt_status mask_apply(const scene_view *view, const image *stored, unsigned char **valid, gbt_error *err);

#endif
