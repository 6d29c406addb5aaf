/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.h -- how many of a photo's pixels a step looks at. */
#ifndef GBT_TRAIN_STEP_PIXELS_H
#define GBT_TRAIN_STEP_PIXELS_H

#include "train/rules.h"

/**
 * Steps look at every n-th pixel across and down: at about rules.step_pixels, or at all of a photo that is
 * not much larger. Returned is n, at least 1.
 *
 * @param camera [in] of the photo, of the size that it is trained at
 * @param pixels [in] how many, about; infinite: all
 */
int step_spacing(const gbt_camera *camera, double pixels);

/** How many pixels that is, about. */
double step_pixel_count(const gbt_camera *camera, const train_rules *rules);

#endif
