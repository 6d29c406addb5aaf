/* SPDX-License-Identifier: Apache-2.0 */
/* train/trainer.c -- one training step, readable from top to bottom. */
#include "train/trainer.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "train/gradient_check.h"
#include "train/growing.h"
#include "train/loss.h"
#include "train/camera_sees.h"
#include "train/near.h"

static const float raised_opacity = 0.1f;
enum { MAX_SKIPPED_IN_ROW = 10 };
enum {
    STREAM_VIEWS = 1,
    STREAM_PIXELS = 4,
    STREAM_PARTS = 6,
    LEAST_PIXELS_ACROSS = 80, /* with fewer a step would not be faster */
    REASON_SIZE = 384,
    EMPTY_STEPS = 5
};

/* ---- which view ---- */

/* An index into train_views: every view once per epoch, in an order that depends on (seed, epoch) only, so
   that there is no state to save. */
static size_t pick_view(trainer *t)
{
    const uint64_t epoch = t->step / t->train_count;
    if (!t->order_ready || t->order_epoch != epoch) {
        for (size_t i = 0; i < t->train_count; i++)
            t->order[i] = (uint32_t)i;
        for (size_t i = t->train_count; i > 1; i--) { /* Durstenfeld 1964 */
            uint32_t words[4];
            rng_philox(t->def.seed, STREAM_VIEWS, epoch << 32 | i, words);
            const size_t j = (size_t)(((uint64_t)words[0] * i) >> 32);
            const uint32_t swap = t->order[i - 1];
            t->order[i - 1] = t->order[j];
            t->order[j] = swap;
        }
        t->order_epoch = epoch;
        t->order_ready = true;
    }
    return t->order[t->step % t->train_count];
}

step_size trainer_step_size(const trainer *t, size_t view, double progress)
{
    const gbt_camera camera = photos_camera(&t->photos, view, 0);
    const int across = camera.width < camera.height ? camera.width : camera.height;
    const double budgets = (double)camera.width * camera.height / t->rules.step_pixels;
    int level = schedule_level(progress, t->rules.start_level);
    if (level == 0) {
        gbt_camera shifted;
        const bool has_parts = budgets > 1 && gbt_camera_shifted(&camera, 0, 0, &shifted);
        return (step_size){.parts = has_parts ? (int)fmax(1, round(sqrt(budgets))) : 1};
    }
    for (double left = budgets; left > 2; left /= 4)
        level++;
    while (level > 0 && across >> level < LEAST_PIXELS_ACROSS)
        level--;
    return (step_size){.level = level, .parts = 1};
}

double trainer_step_pixels(const trainer *t, size_t view, double progress)
{
    const step_size size = trainer_step_size(t, view, progress);
    const gbt_camera camera = photos_camera(&t->photos, view, size.level);
    return (double)camera.width * camera.height / (size.parts * size.parts);
}

/* The first of every 2^level-th pixel: at most four places along a side, so that what is known of the lens at
   these pixels (RAY_LENSES) serves other steps too. */
static int random_phase(uint32_t word, int level)
{
    const int places = level < 2 ? 1 << level : 4, apart = (1 << level) / places;
    return (int)(word % (uint32_t)places) * apart + apart / 2;
}

/* Which pixels of the photo: random ones of every 2^level-th; or a part, another one whenever the photo comes
   up, so that all have their turn. */
static photo_sample pick_pixels(const trainer *t, step_size size, size_t slot)
{
    uint32_t words[4];
    rng_philox(t->def.seed, STREAM_PIXELS, t->step, words);
    if (size.level > 0)
        return (photo_sample){
            .level = size.level,
            .phase = {random_phase(words[0], size.level), random_phase(words[1], size.level)}};
    rng_philox(t->def.seed, STREAM_PARTS, slot, words);
    const uint64_t parts = (uint64_t)size.parts,
                   turn = (words[0] + t->step / t->train_count) % (parts * parts);
    return (photo_sample){.parts = size.parts, .part = {(int)(turn % parts), (int)(turn / parts)}};
}

/* Splats teach a model that is still rough in half the time of rays, which have the last word. */
static gbt_renderer renderer_of_step(const trainer *t, const gbt_camera *camera, double progress)
{
    const bool rays =
        t->renderer != GBT_RENDERER_TRACE || progress >= t->rules.splats_until || !raster_takes(camera);
    return rays ? t->renderer : GBT_RENDERER_RASTER;
}

/* ---- optimizer ---- */

static learning_model model_of(trainer *t)
{
    return (learning_model){.anchors = &t->anchors,
                            .created = t->created,
                            .decoder = &t->decoder,
                            .gradient = &t->gradient,
                            .moment1 = &t->moment1,
                            .moment2 = &t->moment2,
                            .scale_log_min = t->scale_log_min,
                            .scale_log_max = t->scale_log_max};
}

/* ---- one step ---- */

/* Count a step that teaches nothing; nothing may have changed yet but the gradients, which are cleared.
   `what` names the reason. */
static gbt_status skip_step(trainer *t, step_report *out, const char *what, gbt_error *err)
{
    learnables_zero(&t->gradient, t->decoder.param_count);
    out->skipped = true;
    t->skipped_steps++;
    if (++t->skipped_in_row >= MAX_SKIPPED_IN_ROW)
        return base_fail(err, GBT_ERR_FORMAT, "train: %d steps in a row taught nothing, last step %llu: %s",
                         MAX_SKIPPED_IN_ROW, (unsigned long long)t->step, what);
    log_warn("step %llu skipped: %s", (unsigned long long)t->step, what);
    t->step++;
    return GBT_OK;
}

/* After the last render: is the scene empty, and for good? And in the first: is one offset of all anchors?
   The networks begin at random, and an offset that begins below 0 everywhere would hardly ever be used. */
static void raise_opacities_when_empty(trainer *t)
{
    const frame *f = &t->frame;
    if (t->step == 0 && t->rules.raises_first_opacity)
        decode_raise_opacity(&f->tape, 0, raised_opacity, &t->decoder);
    const bool empty = f->visible_count > 0 && f->gaussians.count == 0;
    t->empty_in_row = empty ? t->empty_in_row + 1 : 0;
    if (t->empty_in_row < EMPTY_STEPS)
        return;
    decode_raise_opacity(&f->tape, raised_opacity, raised_opacity, &t->decoder);
    decoder_part parts[DECODER_PARTS];
    decoder_parts(&t->decoder, parts);
    const decoder_part *opacity = &parts[DECODER_OPACITY];
    learnables *const moments[] = {&t->moment1, &t->moment2};
    for (int i = 0; i < 2; i++) /* what pulled the opacities down must not go on */
        memset(moments[i]->networks + opacity->begin, 0, (opacity->end - opacity->begin) * sizeof(float));
    t->empty_in_row = 0;
    if (t->opacity_raises++ == 0)
        log_info("step %llu: no anchor makes a Gaussian; opacities are raised", (unsigned long long)t->step);
}

/* The loss of the last render as the photo's exposure shows it; d_image becomes dL/drender, d_exposure
   dL/dmatrix. */
static gbt_status compare(trainer *t, size_t slot, const unsigned char *valid, image_loss_result *loss,
                          double d_exposure[AFFINE_NUMBERS], gbt_error *err)
{
    const image *shown = &t->frame.rgb;
    image *fitted[] = {&t->d_image, &t->exposed};
    for (int i = 0; i < (t->exposures.count > 0 ? 2 : 1); i++)
        GBT_TRY(image_fit(fitted[i], shown->width, shown->height, 3, err));
    if (t->exposures.count == 0)
        return loss_of_image(shown, &t->photo, valid, &t->loss_scratch, &t->d_image, loss, err);
    const float *matrix = t->exposures.matrix + slot * AFFINE_NUMBERS;
    affine_apply(matrix, shown, &t->exposed);
    GBT_TRY(loss_of_image(&t->exposed, &t->photo, valid, &t->loss_scratch, &t->d_image, loss, err));
    affine_backward(matrix, shown, &t->d_image, d_exposure);
    return GBT_OK;
}

gbt_status trainer_step(trainer *t, step_report *out, gbt_error *err)
{
    stage_clock start = stage_begin();
    memset(out, 0, sizeof *out);
    const double progress = pace_progress(&t->pace, t->step), next = pace_progress(&t->pace, t->step + 1);
    const bool learns = t->rules.last_step_learns || next < 1;
    const learning_rates rates =
        learning_rates_at(train_rules_progress(&t->rules, &t->pace, t->step), t->rules.own_rates, t->extent,
                          t->def.learning_rate_factor, schedule_rate_end(pace_expected(&t->pace, t->step)));

    /* A view, and as many of its pixels as the model can already use. */
    const size_t slot = pick_view(t), view = t->train_views[slot];
    const step_size size = trainer_step_size(t, view, progress);
    out->level = size.level;
    out->parts = size.parts;
    stage_clock clock = stage_begin();
    const photo_sample sample = pick_pixels(t, size, slot);
    gbt_camera camera;
    const unsigned char *valid;
    frame *f = &t->frame;
    GBT_TRY(
        photos_get_sample(&t->photos, view, &sample, &t->photo, &camera, &valid, &f->draw.pixel_step, err));
    out->photo = stage_lap(&clock);
    out->width = camera.width;
    out->height = camera.height;

    /* Render, compare. */
    f->draw.renderer = renderer_of_step(t, &camera, progress);
    trace_settings settings = t->settings;
    settings.t_near = view_near(t->settings.t_near, &t->def, &t->scene.views[view]);
    if (t->rules.loose_cutoffs && progress < SCHEDULE_WHOLE_FROM) {
        settings.alpha_min = SCHEDULE_ALPHA_MIN;
        settings.transmittance_min = SCHEDULE_T_MIN;
    }
    GBT_TRY(frame_render(f, frame_neural(&t->anchors, &t->decoder), &camera, &settings, true, err));
    out->gaussians = f->gaussians.count;
    out->visible = f->visible_count;
    raise_opacities_when_empty(t);
    clock = stage_begin();
    image_loss_result loss;
    double d_exposure[AFFINE_NUMBERS];
    GBT_TRY(frame_valid(f, valid, &valid, err));
    GBT_TRY(compare(t, slot, valid, &loss, d_exposure, err));
    out->loss = loss.loss + loss_of_gaussians(&f->gaussians);
    out->l1 = loss.l1;
    out->ssim = loss.ssim;
    out->psnr = loss.mse > 0 ? -10 * log10(loss.mse) : 100;
    out->compare = stage_lap(&clock);

    char reason[REASON_SIZE];
    if (!isfinite(out->loss)) {
        snprintf(reason, sizeof reason, "the loss is not finite (photo %.200s)", t->scene.views[view].name);
        return skip_step(t, out, reason, err);
    }

    /* Gradients, then parameters. */
    GBT_TRY(frame_backward_gaussians(f, &t->d_image, err));
    loss_add_gradient(&f->gaussians, &f->d_gaussians);
    GBT_TRY(
        frame_backward_anchors(f, &t->anchors, &t->decoder, &t->gradient.anchors, t->gradient.networks, err));
    clock = stage_begin();
    char where[80];
    if (gradient_is_bad(t, t->exposures.count > 0 ? d_exposure : NULL, where, sizeof where)) {
        snprintf(reason, sizeof reason, "the gradient is not finite (%s; photo %.200s)", where,
                 t->scene.views[view].name);
        return skip_step(t, out, reason, err);
    }
    t->skipped_in_row = 0;
    if (t->exposures.count > 0 && learns)
        exposures_step(&t->exposures, slot, d_exposure,
                       t->def.learning_rate_factor *
                           exposures_rate(t->train_count, progress, next - progress));
    const bool adjust = growing_is_due(t);
    const learning_model model = model_of(t);
    if (learns)
        learn_networks(&model, &rates, t->step + 1);
    if (learns && (!adjust || t->rules.anchors_learn_when_adjusted))
        learn_anchors(&model, &rates, ++t->anchor_t);
    out->optimizer = stage_lap(&clock);

    /* Anchors. */
    clock = stage_begin();
    if (growing_gathers(t))
        growth_stats_gather(&t->stats, f, t->rules.importance, t->rules.gradient_counting, settings.t_near);
    if (adjust)
        GBT_TRY(growing_round(t, err));
    out->adjust = stage_lap(&clock);
    t->step++;
    out->all = stage_lap(&start);
    return GBT_OK;
}

gbt_status trainer_held_out_psnr(trainer *t, double *psnr, gbt_error *err)
{
    double sum = 0;
    size_t count = 0;
    image photo = {0};
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < t->scene.view_count && status == GBT_OK; i++) {
        if (!t->scene.views[i].is_test)
            continue;
        unsigned char *marks = NULL;
        const unsigned char *valid = NULL;
        const gbt_camera camera = photos_camera(&t->photos, i, 0);
        t->frame.draw.pixel_step = 1;
        t->frame.draw.renderer = t->renderer;
        trace_settings settings = t->settings;
        settings.t_near = view_near(t->settings.t_near, &t->def, &t->scene.views[i]);
        status =
            frame_render(&t->frame, frame_neural(&t->anchors, &t->decoder), &camera, &settings, false, err);
        if (status == GBT_OK)
            status =
                scene_read_photo_valid(&t->scene.views[i], camera.width, camera.height, &photo, &marks, err);
        if (status == GBT_OK)
            status = frame_valid(&t->frame, marks, &valid, err);
        image_scores scores = {0};
        if (status == GBT_OK)
            status =
                image_score_photo(&t->frame.rgb, &photo, valid, t->exposures.count > 0, NULL, &scores, err);
        if (status == GBT_OK && isfinite(scores.psnr)) { /* else every pixel is masked */
            sum += scores.psnr;
            count++;
        }
        image_free(&photo);
        mem_free(marks);
    }
    *psnr = count > 0 ? sum / (double)count : (double)NAN;
    return status;
}

void trainer_free(trainer *t)
{
    anchors_free(&t->anchors);
    learnables *const kept[] = {&t->gradient, &t->moment1, &t->moment2};
    for (int i = 0; i < 3; i++)
        learnables_free(kept[i]);
    mem_free(t->created);
    decoder_free(&t->decoder);
    growth_stats_free(&t->stats);
    frame_free(&t->frame);
    image_free(&t->photo);
    image_free(&t->d_image);
    image_free(&t->exposed);
    exposures_free(&t->exposures);
    loss_scratch_free(&t->loss_scratch);
    mem_free(t->order);
    mem_free(t->train_views);
    if (t->photos.source != NULL)
        photos_close(&t->photos);
    scene_free(&t->scene);
    memset(t, 0, sizeof *t);
}
