/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.h -- how many of a photo's pixels a step looks at. */
#ifndef GBT_TRAIN_STEP_PIXELS_H
#define GBT_TRAIN_STEP_PIXELS_H

#include "train/rules.h"

/**
 * Steps look at 1 in 4^level of the pixels: the schedule's level at `progress`, and as many more as bring the
 * photo nearest to rules.step_pixels, or one less below TRAIN_SMALL_PHOTO; but never fewer than 80 pixels
 * across.
 *
 * @param camera [in] of the photo, of the size that it is trained at
 */
int step_level(const gbt_camera *camera, const train_rules *rules, double progress);

/** How many pixels that is, about. */
double step_pixel_count(const gbt_camera *camera, const train_rules *rules, double progress);

/** What a pixel's ray costs at `progress`, as a multiple of the loose rays' (rules.loose_rays): exact ones
   have twice the hits. */
double step_hits_per_pixel(const train_rules *rules, double progress);

#endif
