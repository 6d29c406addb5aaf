/* SPDX-License-Identifier: Apache-2.0 */
/* train/photo_pick.h -- selected pixels of a photo stored as bytes, converted to floats. */
#ifndef GBT_TRAIN_PHOTO_PICK_H
#define GBT_TRAIN_PHOTO_PICK_H

#include "base/image.h"

/** Which pixels: every step-th across and down. */
typedef struct photo_pick {
    int first[2]; /* x, y, [0, step) */
    int step;     /* >= 1 */
} photo_pick;

/**
 * @param bytes        [in]  RGB, rows of `full_width` pixels
 * @param transparency [in]  optional (NULL), of the same pixels: transparency, 255 is fully transparent
 * @param change       [in]  [3], with `transparency`: change of the colour behind the photo, added in
 *                           proportion to transparency
 * @param out          [out] 3 channels; its size is the number of pixels wanted
 * Threads: parallel inside.
 */
void photo_pick_pixels(const unsigned char *bytes, int full_width, const photo_pick *pick,
                       const unsigned char *transparency, const float *change, image *out);

/** The same selection from a mask of one byte per pixel: `out` is [height][width]. */
void photo_pick_marks(const unsigned char *marks, int full_width, const photo_pick *pick, int width,
                      int height, unsigned char *out);

#endif
