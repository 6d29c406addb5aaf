/* SPDX-License-Identifier: Apache-2.0 */
/* command/expect.c -- memory and time of a training run from the sizes of its data. */
#include "command/expect.h"

#include <math.h>

#include "train/photos.h"
#include "train/rules.h"

/* Measured on fox, plush and castle: 42 s of training with the default settings on two cores of a server CPU
   with AVX-512 (docs/training.md). */
static const double step_core_seconds_per_megapixel = 0.29, score_core_seconds_per_megapixel = 3.3;
static const double default_budget_seconds = 600;

/* Of a photo's pixels, those that steps look at: a quarter as many for each factor of 4 beyond their budget.
 */
static double seen_by_steps(double pixels)
{
    while (pixels > 2 * TRAIN_STEP_PIXELS)
        pixels /= 4;
    return pixels;
}

expectation expect_training(const scene *s, double downscale, int threads)
{
    if (downscale <= 0)
        downscale = photos_usual_downscale(s);
    double train_pixels = 0, test_pixels = 0, train_count = 0;
    for (size_t i = 0; i < s->view_count; i++) {
        const gbt_camera *c = &s->views[i].camera;
        const double pixels = (double)c->width * (double)c->height / (downscale * downscale);
        train_count += !s->views[i].is_test;
        *(s->views[i].is_test ? &test_pixels : &train_pixels) += pixels;
    }
    const double photo_megapixels = seen_by_steps(train_pixels / fmax(train_count, 1)) / 1e6;
    return (expectation){.memory = memory_need_of(s, downscale),
                         .step_seconds = step_core_seconds_per_megapixel * photo_megapixels / threads,
                         .score_seconds = score_core_seconds_per_megapixel * test_pixels / 1e6 / threads,
                         .threads = threads};
}

json_t *expect_to_json(const expectation *e)
{
    const memory_need *m = &e->memory;
    return json_pack("{s:f,s:{s:f,s:f,s:f,s:f,s:f,s:f,s:f},s:f,s:f,s:f,s:i}", "bytes", m->whole, "memory",
                     "program", m->program, "reading", m->reading, "points", m->points, "trees", m->trees,
                     "photos", m->photos, "anchors", m->anchors, "view", m->view, "least_bytes", m->least,
                     "step_seconds", e->step_seconds, "score_seconds", e->score_seconds, "threads",
                     e->threads);
}

/* Two digits are more than is known. */
static double rounded(double value)
{
    const double unit = value > 0 ? pow(10, floor(log10(value)) - 1) : 1;
    return floor(value / unit + 0.5) * unit;
}

void expect_print(const expectation *e, FILE *out)
{
    fprintf(out,
            "  expect    training takes about %.0f MB; in 10 minutes (the default budget) %.0f "
            "iterations on %d thread%s",
            rounded(e->memory.whole / 1e6), rounded(default_budget_seconds / e->step_seconds), e->threads,
            e->threads == 1 ? "" : "s");
    if (e->score_seconds > 0)
        fprintf(out, ", then %.0f s for the scores", fmax(1, rounded(e->score_seconds)));
    const memory_need *m = &e->memory;
    fprintf(out,
            "\n  memory    of that, MB: program %.0f; at first files %.0f, then trees %.0f, then anchors "
            "%.0f and a "
            "view %.0f; all along points %.0f, photos %.0f; the least limit %.0f MiB\n",
            rounded(m->program / 1e6), rounded(m->reading / 1e6), rounded(m->trees / 1e6),
            rounded(m->anchors / 1e6), rounded(m->view / 1e6), rounded(m->points / 1e6),
            rounded(m->photos / 1e6), ceil(m->least / 0x1p20));
}
