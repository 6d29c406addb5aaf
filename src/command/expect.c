/* SPDX-License-Identifier: Apache-2.0 */
/* command/expect.c -- predict memory and time of a training run from the sizes of its data. */
#include "command/expect.h"

#include <math.h>

#include "train/def.h"
#include "train/photos.h"
#include "train/step_pixels.h"

/* Core-seconds of a step with AVX2, averaged over a run of usual_core_seconds: a part for the anchors in
   view, and a part per pixel. Longer runs have more anchors, so their steps take (core-seconds /
   usual)^growth times as long. Fitted to runs of 42, 84 and 120 s on plush, fox, castle, aerial and the demo,
   and of 4 minutes on photos of megapixels, with AVX-512 on two cores of a server CPU; the prediction is
   within 15 % of each. */
static const double anchors_core_seconds = 0.053, core_seconds_per_megapixel = 0.2, growth = 0.15,
                    usual_core_seconds = 280;
/* The same for scoring a held-out view and writing its pictures. */
static const double score_core_seconds = 0.13, score_core_seconds_per_megapixel = 1.05;

/* Run time relative to AVX2. AVX-512: from runs of 42 s on two such machines. NEON and plain C: from
   instruction counts and the tracer's time (docs/performance.md). */
static const double slower_than_avx2[CPU_ISA_COUNT] = {
    [CPU_PLAIN] = 8, [CPU_NEON] = 1.7, [CPU_AVX2] = 1, [CPU_AVX512] = 0.6};

expectation expect_training(const scene *s, double downscale, int threads, cpu_isa isa, double budget)
{
    const gbt_train_def def = gbt_train_def_default();
    const train_rules rules = train_rules_of(&def);
    double train_count = 0, seconds = 0, score_seconds = 0;
    for (size_t i = 0; i < s->view_count; i++) {
        const gbt_camera camera = photo_camera_divided(&s->views[i].camera, downscale);
        if (s->views[i].is_test) {
            score_seconds +=
                score_core_seconds + score_core_seconds_per_megapixel * camera.width * camera.height / 1e6;
            continue;
        }
        seconds +=
            anchors_core_seconds + core_seconds_per_megapixel * step_pixel_count(&camera, &rules) / 1e6;
        train_count++;
    }
    const double speed = slower_than_avx2[isa] / threads;
    return (expectation){.memory = memory_need_of(s, downscale, &rules),
                         .step_seconds = speed * seconds / fmax(train_count, 1) *
                                         pow(budget / speed / usual_core_seconds, growth),
                         .score_seconds = speed * score_seconds,
                         .threads = threads};
}

json_t *expect_to_json(const expectation *e)
{
    const memory_need *m = &e->memory;
    return json_pack("{s:f,s:{s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f},s:f,s:f,s:f,s:i}", "bytes", m->whole, "memory",
                     "program", m->program, "reading", m->reading, "decoding", m->decoding, "points",
                     m->points, "trees", m->trees, "photos", m->photos, "anchors", m->anchors, "view",
                     m->view, "least_bytes", m->least, "step_seconds", e->step_seconds, "score_seconds",
                     e->score_seconds, "threads", e->threads);
}

/* To two digits, which is already more than the accuracy. */
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
            rounded(e->memory.whole / 1e6), rounded(TRAIN_BUDGET_SECONDS / e->step_seconds), e->threads,
            e->threads == 1 ? "" : "s");
    if (e->score_seconds > 0)
        fprintf(out, ", then %.0f s for the scores", fmax(1, rounded(e->score_seconds)));
    const memory_need *m = &e->memory;
    fprintf(
        out,
        "\n  memory    parts, MB: program %.0f; reading files %.0f; after that points %.0f, photos %.0f, "
        "and in turn decoding photos %.0f, trees %.0f, anchors %.0f with one view %.0f; smallest possible "
        "limit %.0f MiB\n",
        rounded(m->program / 1e6), rounded(m->reading / 1e6), rounded(m->points / 1e6),
        rounded(m->photos / 1e6), rounded(m->decoding / 1e6), rounded(m->trees / 1e6),
        rounded(m->anchors / 1e6), rounded(m->view / 1e6), ceil(m->least / 0x1p20));
}
