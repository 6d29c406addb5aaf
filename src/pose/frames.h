/* SPDX-License-Identifier: Apache-2.0 */
/* pose/frames.h -- which frames of a film are worth a photo: sharp ones, spread over time and movement. */
#ifndef GBT_POSE_FRAMES_H
#define GBT_POSE_FRAMES_H

#include <stddef.h>

#include "base/image.h"

typedef struct frame_measure {
    double sharpness; /* frames_sharpness() */
    double change;    /* from the frame before: mean difference of small pictures, grey levels; >= 0 */
    double place;     /* [0, 1] along the film, half time and half change; set by frames_choose() */
} frame_measure;

/** Variance of the Laplacian of a grey picture, [height][width]: large where edges are sharp. 0 below 3 x
    3. */
double frames_sharpness(const unsigned char *grey, int width, int height);

/**
 * Choose `wanted` of `count` frames, in their order.
 *
 * The film is cut into `wanted` parts that are equally long when half of the length is time and half is
 * change; of the middle of each part the sharpest frame is taken.
 *
 * @param chosen [out] at least min(wanted, count) places
 * @return how many: min(wanted, count)
 */
size_t frames_choose(frame_measure *frames, size_t count, size_t wanted, size_t *chosen);

/** frames_sharpness() of a photo, at a width of FRAMES_WIDTH. */
enum { FRAMES_WIDTH = 480 };
gbt_status frames_photo_sharpness(const char *path, double *out, gbt_error *err);

#endif
