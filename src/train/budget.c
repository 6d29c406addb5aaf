/* SPDX-License-Identifier: Apache-2.0 */
/* train/budget.c -- the clock of a run with a time budget. */
#include "train/budget.h"

#include <math.h>

/* Cost of a pixel's ray relative to a loose one (rules.loose_rays): exact rays have twice the hits. */
static double hits_of_rays(const train_rules *rules, double progress)
{
    return train_rules_are_loose(rules, progress) ? 1 : 2;
}

void budget_follow(step_speed *s, const trainer *t, uint64_t step, const step_report *r)
{
    const frame_times *f = &r->times;
    const double of_pixels =
        (f->rays.wall + f->trace.wall + f->adjoint.wall + r->compare.wall) / r->views_at_once;
    const double fixed = fmax(0, r->all.wall - of_pixels);
    const double hits = hits_of_rays(&t->rules, pace_progress(&t->pace, step));
    /* The mean covers so many steps that the few slow ones weigh in it as they do in the whole part. */
    const double part = (double)t->pace.steps[pace_segment(&t->pace, step)];
    const double rate = fmax(1 / (double)++s->steps, 1 / fmax(20, part / 4));
    s->fixed_seconds += rate * (fixed - s->fixed_seconds);
    s->pixel_seconds += rate * (of_pixels / hits - s->pixel_seconds);
}

/* Seconds of a step in this part of the schedule: exact rays may begin inside it. */
static double expected_step(const trainer *t, const step_speed *s, int part)
{
    enum { PLACES = 8 };
    double sum = 0;
    for (int i = 0; i < PLACES; i++) {
        const double progress = (part + (i + 0.5) / PLACES) / PACE_SEGMENTS;
        sum += s->fixed_seconds + s->pixel_seconds * hits_of_rays(&t->rules, progress);
    }
    return sum / PLACES;
}

void budget_extend(trainer *t, const step_speed *s)
{
    const int part = t->pace.known;
    const double seconds = fmax(0, t->def.budget_seconds - t->seconds) / (PACE_SEGMENTS - part);
    const double per_step = s->steps > 0 ? expected_step(t, s, part) : 0;
    /* Before anything has been measured: use the speed from before the run was resumed, or make a few steps;
       the time that the first part leaves over goes to the next. */
    const double steps = per_step > 0  ? seconds / per_step
                         : t->step > 0 ? seconds * (double)t->step / t->seconds
                                       : 20.0 / t->def.views;
    t->pace.steps[part] = (uint64_t)fmin(fmax(steps, 1), 1e7);
    t->pace.known++;
}
