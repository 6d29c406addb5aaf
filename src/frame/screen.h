/* SPDX-License-Identifier: Apache-2.0 */
/* frame/screen.h -- which Gaussians touch a pinhole image, by the reference's test: the square of three
   std-devs around the projected Gaussian overlaps a tile of 16 x 16 pixels. */
#ifndef GBT_FRAME_SCREEN_H
#define GBT_FRAME_SCREEN_H

#include <stdbool.h>

#include "gbtrace/camera.h"

typedef struct screen_view {
    double rotation[9], center[3], near;
    double focal[2], principal[2]; /* px; the centre of the first pixel is 0 */
    double low[2], high[2];        /* raster_limits() */
    int tiles[2];
} screen_view;

/** @param camera [in] one that raster_takes() accepts */
screen_view screen_of(const gbt_camera *camera, double near);

/** Is the mean beyond the near depth, and does the splat of the Gaussian, dilated by 0.3 px^2, touch a tile?
    `quat`: w, x, y, z, of length 1. False for NaN. */
bool screen_touches(const screen_view *s, const float mean[3], const float quat[4], const float scale[3]);

#endif
