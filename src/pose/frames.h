/* SPDX-License-Identifier: Apache-2.0 */
/* pose/frames.h -- chooses frames of a film: sharp ones, evenly spread over time and camera movement. */
#ifndef GBT_POSE_FRAMES_H
#define GBT_POSE_FRAMES_H

#include <stddef.h>

#include "gbtrace/status.h"

typedef struct frame_measure {
    double sharpness; /* frames_sharpness() */
    double change;    /* mean difference from the previous frame, as small pictures, in grey levels; >= 0 */
    double place; /* [0, 1] along the film, where time and change count half each; set by frames_choose() */
} frame_measure;

/** Variance of the Laplacian of a grey picture, [height][width]; large where edges are sharp. 0 for pictures
    smaller than 3 x 3. */
double frames_sharpness(const unsigned char *grey, int width, int height);

/**
 * Choose `wanted` of `count` frames, in order.
 *
 * The film is divided into `wanted` parts of equal length, where length is half time and half change. From
 * the middle of each part the sharpest frame is taken.
 *
 * @param chosen [out] room for min(wanted, count) indices
 * @return the number of chosen frames, min(wanted, count)
 */
size_t frames_choose(frame_measure *frames, size_t count, size_t wanted, size_t *chosen);

/** frames_sharpness() of a photo, scaled to the width FRAMES_WIDTH, as frames are. */
enum { FRAMES_WIDTH = 480 };
gbt_status frames_photo_sharpness(const char *path, double *out, gbt_error *err);

#endif
