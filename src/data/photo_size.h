/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_size.h -- exact area averaging of images. */
#ifndef GBT_DATA_PHOTO_SIZE_H
#define GBT_DATA_PHOTO_SIZE_H

#include <stdbool.h>

#include "base/image.h"

/**
 * Resample to `width` x `height`: each output pixel is the mean of `in`, taken as constant within each pixel,
 * over the output pixel's rectangle. Exact for every ratio, up or down; the mean of the image is kept; a
 * constant image stays constant to the bit.
 *
 * @param out [out] owned by the caller (image_free()); zeroed on failure; not `in`
 * Cost: O(width * in->height + width * height) times the ratio's pixels; float between the two passes, double
 * within each.
 */
gbt_status photo_resize(const image *in, int width, int height, image *out, gbt_error *err);

/**
 * True when two sizes have the same aspect: one scaled to the other's width or height misses the rest by at
 * most one pixel of the smaller.
 */
bool photo_same_aspect(int width0, int height0, int width1, int height1);

/**
 * The same for marks of valid pixels, [height][width] of 0 and not 0: an output pixel is valid (1) if its
 * whole rectangle is. `out` is owned.
 */
gbt_status photo_resize_valid(const unsigned char *in, int in_width, int in_height, int width, int height,
                              unsigned char **out, gbt_error *err);

#endif
