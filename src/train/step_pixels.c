/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.c -- the schedule's resolution, for a photo of any size. */
#include "train/step_pixels.h"

#include <math.h>

enum { LEAST_PIXELS_ACROSS = 80 /* with fewer a step would not be faster */ };

int step_level(const gbt_camera *camera, const train_rules *rules, double progress)
{
    const int across = camera->width < camera->height ? camera->width : camera->height;
    const double all = (double)camera->width * camera->height;
    int level = schedule_level(progress, rules->start_level) - (all < TRAIN_SMALL_PHOTO);
    for (double left = all / rules->step_pixels; left > 2; left /= 4)
        level++;
    while (level > 0 && across >> level < LEAST_PIXELS_ACROSS)
        level--;
    return level > 0 ? level : 0;
}

double step_pixel_count(const gbt_camera *camera, const train_rules *rules, double progress)
{
    return ldexp((double)camera->width * camera->height, -2 * step_level(camera, rules, progress));
}

double step_hits_per_pixel(const train_rules *rules, double progress)
{
    return train_rules_are_loose(rules, progress) ? 1 : 2;
}
