/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_view.c -- a view of a step: choose photo and pixels, render, compare, and make the gradient
   rows. */
#include "train/step_view.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"
#include "train/gradient_check.h"
#include "train/growing.h"
#include "train/loss.h"
#include "train/near_distance.h"
#include "train/step_pixels.h"
#include "train/step_rows.h"
#include "train/trainer.h"

/* ---- which photo ---- */

/* Number of views of the run before view `index` of the next step. */
static uint64_t views_before(const trainer *t, size_t index)
{
    return t->step * (uint64_t)t->def.views + index;
}

/* An index into train_views: every view once per epoch, in an order that depends on (seed, epoch) only, so
   that there is no state to save. */
static size_t pick_photo(trainer *t, uint64_t before)
{
    const uint64_t epoch = before / t->train_count;
    if (!t->order_ready || t->order_epoch != epoch) {
        for (size_t i = 0; i < t->train_count; i++)
            t->order[i] = (uint32_t)i;
        for (size_t i = t->train_count; i > 1; i--) { /* Durstenfeld 1964 */
            uint32_t words[4];
            rng_philox(t->def.seed, RNG_STREAM_PHOTO_ORDER, epoch << 32 | i, words);
            const size_t j = (size_t)(((uint64_t)words[0] * i) >> 32);
            const uint32_t swap = t->order[i - 1];
            t->order[i - 1] = t->order[j];
            t->order[j] = swap;
        }
        t->order_epoch = epoch;
        t->order_ready = true;
    }
    return t->order[before % t->train_count];
}

/* Random choice of the first pixel of the grid. */
static photo_pick pick_pixels(const trainer *t, size_t view, uint64_t before)
{
    uint32_t words[4];
    const gbt_camera camera = photos_camera(&t->photos, view, 0);
    const int step = step_spacing(&camera, t->rules.step_pixels);
    rng_philox(t->def.seed, RNG_STREAM_PIXELS, before, words);
    return (photo_pick){.first = {(int)(words[0] % (unsigned)step), (int)(words[1] % (unsigned)step)},
                        .step = step};
}

/* Late in a run half of the views get a random background colour, or below a sky a random ground: only opaque
   surfaces then give the right image on all backgrounds. Returns true for a random colour. */
static bool pick_background(const trainer *t, uint64_t before, float out[3])
{
    const trace_settings *s = &t->settings;
    uint32_t words[4];
    memcpy(out, s->sky.has_horizon ? s->sky.ground : s->background, sizeof s->background);
    if (pace_progress(&t->pace, t->step) < t->rules.opaque_from)
        return false;
    rng_philox(t->def.seed, RNG_STREAM_BACKGROUND, before, words);
    if (words[3] >> 31 != 0) /* chosen at random, not alternately, because photos come in turn */
        return false;
    for (int c = 0; c < 3; c++)
        out[c] = rng_unit(words[c]);
    return true;
}

/* The colour matrix of a photo's exposure; NULL: none. */
static const float *exposure_of(const trainer *t, size_t slot)
{
    return t->exposures.count > 0 ? t->exposures.matrix + slot * AFFINE_NUMBERS : NULL;
}

void step_photos_pick(trainer *t)
{
    for (int i = 0; i < t->def.views; i++)
        t->slots[i] = pick_photo(t, views_before(t, (size_t)i));
}

static gbt_status pick(trainer *t, step_view *v, uint64_t before, gbt_error *err)
{
    const size_t view = t->train_views[v->slot];
    v->frame.draw.dropout = (visible_dropout){
        .share = t->left_out, .seed = t->def.seed, .draw = (uint64_t)RNG_STREAM_LEFT_OUT << 48 | before};
    photo_sample sample = {.pick = pick_pixels(t, view, before)};
    v->frame.draw.pixel_step = sample.pick.step;
    float backdrop[3];
    if (pick_background(t, before, v->background)) {
        memcpy(backdrop, v->background, sizeof backdrop);
        if (exposure_of(t, v->slot) != NULL) { /* the photo shows the backdrop through its exposure, too */
            image pixel = {.width = 1, .height = 1, .channels = 3, .pixels = backdrop};
            affine_apply(exposure_of(t, v->slot), &pixel, &pixel);
        }
        sample.backdrop = backdrop;
    }
    GBT_TRY(photos_get_sample(&t->photos, view, &sample, &v->photo, &v->camera, &v->valid, err));
    v->outcome.width = v->camera.width;
    v->outcome.height = v->camera.height;
    if (v->valid == NULL || t->view_count == 1)
        return GBT_OK;
    const size_t pixels = (size_t)v->camera.width * (size_t)v->camera.height; /* a copy, because the next
                                                                                 photo overwrites the mask */
    GBT_TRY(mem_reserve((void **)&v->marks, &v->marks_capacity, 0, pixels, 1, "valid pixels", err));
    memcpy(v->marks, v->valid, pixels);
    v->valid = v->marks;
    return GBT_OK;
}

static void keep_failure(view_outcome *r, gbt_status status, const gbt_error *err)
{
    if (status == GBT_OK)
        return;
    r->status = status;
    snprintf(r->text, sizeof r->text, "%s", err->text);
}

void step_view_pick(trainer *t, step_view *v, size_t index)
{
    stage_clock start = stage_begin();
    gbt_error err = {0};
    memset(&v->outcome, 0, sizeof v->outcome);
    v->slot = t->slots[index];
    keep_failure(&v->outcome, pick(t, v, views_before(t, index), &err), &err);
    v->photo_time = stage_lap(&start);
}

/* ---- its render ---- */

static gbt_renderer renderer_of_step(const trainer *t, const gbt_camera *camera, double progress)
{
    const bool rays =
        t->def.renderer != GBT_RENDERER_TRACE || progress >= t->rules.splats_until || !raster_takes(camera);
    return rays ? t->def.renderer : GBT_RENDERER_RASTER;
}

float step_view_near(const trainer *t, const step_view *v)
{
    return near_of_view(t->settings.t_near, &t->def, &t->scene.views[t->train_views[v->slot]]);
}

gbt_status step_view_draw(const trainer *t, step_view *v, size_t view, const gbt_camera *camera, bool adjoint,
                          gbt_error *err)
{
    trace_settings settings = t->settings;
    settings.t_near = near_of_view(t->settings.t_near, &t->def, &t->scene.views[view]);
    v->frame.draw.pixel_step = 1;
    v->frame.draw.renderer = t->def.renderer;
    v->frame.draw.one_start = false;
    v->frame.draw.dropout.share = 0;
    return frame_render(&v->frame, frame_neural(&t->anchors, &t->decoder), camera, &settings, adjoint, err);
}

static trace_settings settings_of(const trainer *t, const step_view *v, double progress)
{
    trace_settings settings = t->settings;
    settings.t_near = step_view_near(t, v);
    memcpy(settings.sky.has_horizon ? settings.sky.ground : settings.background, v->background,
           sizeof v->background);
    if (train_rules_are_loose(&t->rules, progress)) {
        settings.alpha_min = SCHEDULE_ALPHA_MIN;
        settings.transmittance_min = SCHEDULE_T_MIN;
        settings.packet_order = true;
        settings.spread = (float)(t->rules.spread / ((double)v->camera.width * v->camera.height));
    }
    return settings;
}

gbt_status step_view_compare(step_view *v, const unsigned char *valid, const float *matrix,
                             image_loss_result *loss, double d_matrix[AFFINE_NUMBERS], gbt_error *err)
{
    const image *shown = &v->frame.rgb;
    GBT_TRY(image_fit(&v->d_image, shown->width, shown->height, 3, err));
    if (matrix == NULL)
        return loss_of_image(shown, &v->photo, valid, &v->loss_scratch, &v->d_image, loss, err);
    GBT_TRY(image_fit(&v->exposed, shown->width, shown->height, 3, err));
    affine_apply(matrix, shown, &v->exposed);
    affine_cut(&v->photo, &v->exposed);
    GBT_TRY(loss_of_image(&v->exposed, &v->photo, valid, &v->loss_scratch, &v->d_image, loss, err));
    affine_cut_backward(&v->photo, &v->exposed, &v->d_image);
    affine_backward(matrix, shown, &v->d_image, d_matrix);
    return GBT_OK;
}

/* Compare the render, through the photo's exposure, with the photo. */
static gbt_status compare(const trainer *t, step_view *v, image_loss_result *loss, gbt_error *err)
{
    const unsigned char *valid;
    GBT_TRY(frame_valid(&v->frame, v->valid, &valid, err));
    return step_view_compare(v, valid, exposure_of(t, v->slot), loss, v->outcome.d_exposure, err);
}

/* ---- and back ---- */

/* Make a row of zeros for each visible anchor. */
static gbt_status make_rows(const trainer *t, step_view *v, gbt_error *err)
{
    const size_t count = v->frame.visible_count;
    learnables *g = &v->gradient;
    if (g->networks == NULL) {
        g->anchors.offset_count = t->anchors.offset_count;
        g->networks = mem_alloc(t->decoder.param_count, sizeof *g->networks, "networks", err);
        if (g->networks == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    GBT_TRY(anchors_resize(&g->anchors, count, err));
    learnables_zero(g, t->decoder.param_count);
    GBT_TRY(growth_stats_resize(&v->stats, 0, t->anchors.offset_count, err));
    return growth_stats_resize(&v->stats, count, t->anchors.offset_count, err);
}

static gbt_status run(trainer *t, step_view *v, gbt_error *err)
{
    const double progress = pace_progress(&t->pace, t->step);
    const char *photo = t->scene.views[t->train_views[v->slot]].name;
    view_outcome *r = &v->outcome;
    frame *f = &v->frame;
    const trace_settings settings = settings_of(t, v, progress);
    f->draw.renderer = renderer_of_step(t, &v->camera, progress);
    f->draw.one_start = train_rules_are_loose(&t->rules, progress);
    GBT_TRY(frame_render(f, frame_neural(&t->anchors, &t->decoder), &v->camera, &settings, true, err));
    r->gaussians = f->gaussians.count;
    r->visible = f->visible_count;
    r->rays = f->counters.rays;
    r->hits = f->counters.hits;
    r->blended = f->counters.blended;

    stage_clock clock = stage_begin();
    image_loss_result loss;
    const double volume_weight = loss_volume_weight(&t->rules, &t->decoder);
    GBT_TRY(compare(t, v, &loss, err));
    r->loss = loss.loss + loss_of_gaussians(&f->gaussians, volume_weight);
    r->l1 = loss.l1;
    r->ssim = loss.ssim;
    r->psnr = loss.mse <= 0 ? 100 : -10 * log10(loss.mse); /* written so that NaN stays NaN */
    v->compare_time = stage_lap(&clock);
    if (!isfinite(r->loss)) {
        r->bad = true;
        snprintf(r->text, sizeof r->text, "the loss is not finite (photo %.200s)", photo);
        return GBT_OK;
    }

    const bool alone = t->def.views == 1;
    if (!alone)
        GBT_TRY(make_rows(t, v, err));
    learnables *gradient = alone ? &t->gradient : &v->gradient;
    GBT_TRY(frame_backward_gaussians(f, &v->d_image, err));
    if (t->settings.sky.varies)
        GBT_TRY(frame_backward_sky(f, &settings.sky, &v->d_image, r->d_sky, err));
    if (t->poses.count > 0)
        GBT_TRY(frame_backward_pose(f, frame_neural(&t->anchors, &t->decoder), r->d_pose, err));
    loss_add_gradient(&f->gaussians, volume_weight, &f->d_gaussians);
    GBT_TRY(frame_backward_anchors(f, &t->anchors, &t->decoder, &gradient->anchors, gradient->networks, err));
    char where[80];
    if (gradient_is_bad(gradient, f, &t->decoder, t->exposures.count > 0 ? r->d_exposure : NULL, where,
                        sizeof where)) {
        r->bad = true;
        snprintf(r->text, sizeof r->text, "the gradient is not finite (%s; photo %.200s)", where, photo);
        return GBT_OK;
    }
    if (t->poses.count > 0 && !pose_is_finite(r->d_pose)) {
        r->bad = true;
        snprintf(r->text, sizeof r->text, "the gradient is not finite (pose; photo %.200s)", photo);
        return GBT_OK;
    }
    if (alone)
        return GBT_OK;
    if (growing_gathers(t))
        growth_stats_gather(&v->stats, f, t->rules.importance, t->rules.gradient_counting, settings.t_near);
    return step_rows_take(t, v, err);
}

void step_view_run(trainer *t, step_view *v)
{
    const double start = clock_wall();
    gbt_error err = {0};
    v->rows.count = 0;
    v->compare_time = (stage_time){0};
    if (v->outcome.status == GBT_OK)
        keep_failure(&v->outcome, run(t, v, &err), &err);
    v->seconds = clock_wall() - start;
}

void step_view_free(step_view *v)
{
    frame_free(&v->frame);
    image_free(&v->photo);
    image_free(&v->d_image);
    image_free(&v->exposed);
    mem_free(v->marks);
    loss_scratch_free(&v->loss_scratch);
    learnables_free(&v->gradient);
    growth_stats_free(&v->stats);
    row_list_free(&v->rows);
    memset(v, 0, sizeof *v);
}
