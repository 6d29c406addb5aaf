/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.c -- the spacing of the pixels of a photo that a training step uses. */
#include "train/step_pixels.h"

#include <math.h>

int step_spacing(const gbt_camera *camera, double pixels)
{
    const double times = (double)camera->width * camera->height / pixels;
    const int smaller = camera->width < camera->height ? camera->width : camera->height;
    return (int)fmin(fmax(floor(sqrt(times) + 0.5), 1), smaller);
}

double step_pixel_share(const gbt_camera *camera, const train_rules *rules)
{
    const double spacing = step_spacing(camera, rules->step_pixels);
    return 1 / (spacing * spacing);
}

double step_pixel_count(const gbt_camera *camera, const train_rules *rules)
{
    return (double)camera->width * camera->height * step_pixel_share(camera, rules);
}
