/* SPDX-License-Identifier: Apache-2.0 */
/* data/mask.h -- which pixels of a photo mean nothing: by its mask, by its alpha channel. */
#ifndef GBT_DATA_MASK_H
#define GBT_DATA_MASK_H

#include "base/image.h"
#include "data/scene.h"

/**
 * Take pixels out of `valid` by the view's mask picture and, with GBT_ALPHA_MASK, by the photo's alpha
 * channel.
 *
 * The value of a mask's pixel is the largest of its colours, times its opacity. It counts when it has at
 * least half the mask's largest value, so that masks of 0 and 1 do as well as those of 0 and 255, and lossy
 * ones. A mask of another size must have the photo's aspect within 1 px; a pixel that touches a dark one of
 * the mask is out.
 *
 * @param stored [in]     the photo as the file has it
 * @param valid  [in,out] NULL (all count) or [height][width] of it; made when something is left out; the
 *                        caller's to free, also after a failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT (the mask), GBT_ERR_NO_MEMORY
 */
gbt_status mask_apply(const scene_view *view, const image *stored, unsigned char **valid, gbt_error *err);

#endif
