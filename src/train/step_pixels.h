/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.h -- how many pixels of a photo a training step uses. */
#ifndef GBT_TRAIN_STEP_PIXELS_H
#define GBT_TRAIN_STEP_PIXELS_H

#include "train/rules.h"

/**
 * Spacing n >= 1 of the pixels that a step uses, every n-th across and down: such that there are about
 * `pixels` of them, or n = 1 for a photo that has not many more.
 *
 * @param camera [in] of the photo at training resolution
 * @param pixels [in] approximate number; infinite: all
 */
int step_spacing(const gbt_camera *camera, double pixels);

/** The resulting share of the photo's pixels, approximately: 1 / n^2. */
double step_pixel_share(const gbt_camera *camera, const train_rules *rules);

/** The resulting number of pixels, approximately. */
double step_pixel_count(const gbt_camera *camera, const train_rules *rules);

#endif
