/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_size.h -- resamples images by exact area averaging, and compares aspect ratios. */
#ifndef GBT_DATA_PHOTO_SIZE_H
#define GBT_DATA_PHOTO_SIZE_H

#include <stdbool.h>

#include "base/image.h"

/**
 * Resample to `width` x `height`. Each output pixel is the mean of `in`, taken as constant within each pixel,
 * over the output pixel's rectangle. This is exact for every ratio, up or down, preserves the mean of the
 * image, and keeps a constant image constant to the bit.
 *
 * @param out [out] owned by the caller (image_free()); zeroed on failure; must not be `in`
 * Cost: O(width * in->height + width * height) times the number of input pixels per output pixel. Sums are in
 * double, the intermediate image between the two passes in float.
 */
gbt_status photo_resize(const image *in, int width, int height, image *out, gbt_error *err);

/**
 * True when two sizes have the same aspect ratio: if one is scaled to the width or height of the other, the
 * other dimension differs by at most one pixel of the smaller.
 */
bool photo_same_aspect(int width0, int height0, int width1, int height1);

/**
 * Resample an array of valid pixels, [height][width] of 0 and not 0, to another size: an output pixel is
 * valid (1) only if its whole rectangle is. `out` is owned by the caller.
 */
gbt_status photo_resize_valid(const unsigned char *in, int in_width, int in_height, int width, int height,
                              unsigned char **out, gbt_error *err);

#endif
