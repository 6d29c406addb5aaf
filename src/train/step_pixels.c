/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_pixels.c -- the schedule's resolution, for a photo of any size. */
#include "train/step_pixels.h"

#include <math.h>

enum { LEAST_PIXELS_ACROSS = 80 /* with fewer a step would not be faster */ };

step_pixels step_pixels_of(const gbt_camera *camera, const train_rules *rules, double progress)
{
    const int across = camera->width < camera->height ? camera->width : camera->height;
    const double all = (double)camera->width * camera->height, budgets = all / rules->step_pixels;
    int level = schedule_level(progress, rules->start_level);
    if (level == 0) {
        gbt_camera shifted;
        const bool has_parts = budgets > 1 && gbt_camera_shifted(camera, 0, 0, &shifted);
        const int parts = has_parts ? (int)fmax(1, round(sqrt(budgets))) : 1;
        return (step_pixels){.parts = parts, .pixels = all / (parts * parts)};
    }
    for (double left = budgets; left > 2; left /= 4)
        level++;
    while (level > 0 && across >> level < LEAST_PIXELS_ACROSS)
        level--;
    return (step_pixels){.level = level, .parts = 1, .pixels = ldexp(all, -2 * level)};
}

double step_hits_per_pixel(const train_rules *rules, double progress)
{
    return train_rules_are_loose(rules, progress) ? 1 : 2;
}
