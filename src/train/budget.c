/* SPDX-License-Identifier: Apache-2.0 */
/* train/budget.c -- the clock of a run with a time budget. */
#include "train/budget.h"

#include <math.h>

#include "train/step_size.h"

void budget_follow(step_speed *s, const train_rules *rules, const step_report *r, double progress)
{
    const frame_times *f = &r->times;
    const double pixels = (double)r->width * (double)r->height;
    const double per_pixel =
        (f->rays.wall + f->trace.wall + f->adjoint.wall + r->compare.wall) / r->beside / pixels;
    const double fixed = fmax(0, r->all.wall - per_pixel * pixels);
    const double keep = s->known ? 0.95 : 0;
    s->fixed_seconds = keep * s->fixed_seconds + (1 - keep) * fixed;
    s->pixel_seconds =
        keep * s->pixel_seconds + (1 - keep) * per_pixel / step_hits_per_pixel(rules, progress);
    s->known = true;
}

/* Seconds of a step in this part of the schedule: resolutions may change inside the part, and photos have
   different sizes. */
static double expected_step(const trainer *t, const step_speed *s, int part)
{
    enum { PLACES = 8 };
    double sum = 0;
    for (size_t v = 0; v < t->train_count; v++) {
        const gbt_camera camera = photos_camera(&t->photos, t->train_views[v], 0);
        for (int i = 0; i < PLACES; i++) {
            const double progress = (part + (i + 0.5) / PLACES) / PACE_SEGMENTS;
            sum += s->fixed_seconds + s->pixel_seconds * step_hits_per_pixel(&t->rules, progress) *
                                          step_size_of(&camera, &t->rules, progress).pixels;
        }
    }
    return sum / (double)(PLACES * t->train_count);
}

void budget_extend(trainer *t, const step_speed *s)
{
    const int part = t->pace.known;
    const double seconds = fmax(0, t->def.budget_seconds - t->seconds) / (PACE_SEGMENTS - part);
    const double per_step = s->known ? expected_step(t, s, part) : 0;
    /* Before anything has been measured: what the run's steps took before it was resumed, or a few steps, and
       the rest of the first part's time goes to the next. */
    const double steps = per_step > 0  ? seconds / per_step
                         : t->step > 0 ? seconds * (double)t->step / t->seconds
                                       : 20.0 / t->def.views;
    t->pace.steps[part] = (uint64_t)fmin(fmax(steps, 1), 1e7);
    t->pace.known++;
}
