/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.h -- how many of a photo's pixels a step looks at. */
#ifndef GBT_TRAIN_STEP_PIXELS_H
#define GBT_TRAIN_STEP_PIXELS_H

#include "train/rules.h"

/** 1 in 4^level of the pixels, or where that is 0 one of parts x parts parts of the photo. */
typedef struct step_pixels {
    int level, parts;
    double pixels; /* about */
} step_pixels;

/**
 * The schedule's level at `progress`, and as many more, each a factor of 4, as bring the photo nearest to
 * rules.step_pixels; but never fewer than 80 pixels across. At level 0 parts of about step_pixels; panoramas
 * are whole.
 *
 * @param camera [in] of the photo, of the size that it is trained at
 */
step_pixels step_pixels_of(const gbt_camera *camera, const train_rules *rules, double progress);

/** What a pixel's ray costs at `progress`, as a multiple of the loose rays' (rules.loose_rays): exact ones
   have twice the hits. */
double step_hits_per_pixel(const train_rules *rules, double progress);

#endif
