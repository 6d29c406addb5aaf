/* SPDX-License-Identifier: Apache-2.0 */
/* train/trainer.c -- one training step, from choosing views to growth. */
#include "train/trainer.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "cluster/cluster.h"
#include "train/growing.h"
#include "train/step_exchange.h"
#include "train/step_rows.h"

static const float raised_opacity = 0.1f;
enum { MAX_SKIPPED_IN_ROW = 10 };
enum { EMPTY_STEPS = 5 };

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

/* Skip a step with a non-finite loss or gradient: count it and clear the gradients. Nothing else may have
   changed yet. `what` is the reason. */
static gbt_status skip_step(trainer *t, step_report *out, const char *what, gbt_error *err)
{
    learnables_zero(&t->gradient, t->decoder.param_count);
    out->skipped = true;
    t->skipped_steps++;
    if (++t->skipped_in_row >= MAX_SKIPPED_IN_ROW) {
        base_fail(err, GBT_ERR_FORMAT, "train: %d steps in a row were skipped, the last is step %llu: %s",
                  MAX_SKIPPED_IN_ROW, (unsigned long long)t->step, what);
        return cluster_agree(GBT_ERR_FORMAT, err);
    }
    log_warn("step %llu skipped: %s", (unsigned long long)t->step, what);
    t->step++;
    return GBT_OK;
}

/* Raise opacities when no Gaussian was made for EMPTY_STEPS steps; until anchors grow, also those of each
   offset whose mean opacity is below 0. The networks start with random weights, and while colours are wrong
   all opacities fall together; an offset below 0 everywhere has no gradient and hardly ever recovers. Means
   are taken over the step's first view. */
static void raise_opacities(trainer *t, const step_report *r, double progress)
{
    const bool early = progress < t->rules.raises_until;
    const bool empty = r->visible > 0 && r->gaussians == 0;
    t->empty_in_row = empty ? t->empty_in_row + 1 : 0;
    const bool lasts = t->empty_in_row >= EMPTY_STEPS;
    if (!early && !lasts)
        return;
    if (cluster_leads())
        decode_raise_opacity(&t->views[0].frame.tape, lasts ? raised_opacity : 0, raised_opacity,
                             &t->decoder);
    cluster_broadcast(t->decoder.params, t->decoder.param_count * sizeof *t->decoder.params);
    if (!lasts)
        return;
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(&t->decoder, networks);
    const decoder_network *opacity = &networks[DECODER_OPACITY];
    learnables *const moments[] = {&t->moment1, &t->moment2};
    for (int i = 0; i < 2; i++) /* clear the momentum that pulled opacities down */
        memset(moments[i]->networks + opacity->begin, 0, (opacity->end - opacity->begin) * sizeof(float));
    t->empty_in_row = 0;
    if (t->opacity_raises++ == 0)
        log_info("step %llu: no anchor makes a Gaussian; opacities are raised", (unsigned long long)t->step);
}

static void run_view(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    trainer *t = context;
    for (size_t i = begin; i < end; i++)
        step_view_run(t, &t->views[i]);
}

/* Run this process's views of the step: photos are read one after the other, because they share the cache;
   the rest runs in parallel. Then exchange the outcomes of all processes. */
static gbt_status run_views(trainer *t, step_report *out, gbt_error *err)
{
    step_photos_pick(t);
    for (size_t i = 0; i < t->view_count; i++)
        step_view_pick(t, &t->views[i], t->first_view + i);
    double clock = clock_wall();
    parallel_blocks(t->view_count, 1, run_view, t);
    const double wall = clock_wall() - clock;
    double views = 0;
    for (size_t i = 0; i < t->view_count; i++) {
        const step_view *v = &t->views[i];
        frame_times_add(&out->times, &v->frame.times);
        stage_add(&out->photo, v->photo_time);
        stage_add(&out->compare, v->compare_time);
        views += v->seconds;
    }
    out->views_at_once = fmax(1, views / wall);
    clock = clock_wall();
    step_exchange_outcomes(t);
    out->wait_seconds = clock_wall() - clock;
    for (int i = 0; i < t->def.views; i++)
        if (t->outcomes[i].status != GBT_OK) {
            base_fail(err, t->outcomes[i].status, "%s", t->outcomes[i].text);
            return cluster_agree(t->outcomes[i].status, err);
        }
    return GBT_OK;
}

/* Means over the views; those of losses only over views with a valid pixel. The size is that of the first
   view. */
static void report_views(const trainer *t, step_report *out)
{
    const view_outcome *first = &t->outcomes[0];
    double n = 0;
    for (int i = 0; i < t->def.views; i++)
        n += !isnan(t->outcomes[i].psnr);
    if (n == 0)
        out->loss = out->l1 = out->ssim = out->psnr = (double)NAN;
    out->width = first->width;
    out->height = first->height;
    for (int i = 0; i < t->def.views; i++) {
        const view_outcome *v = &t->outcomes[i];
        if (!isnan(v->psnr)) {
            out->loss += v->loss / n;
            out->l1 += v->l1 / n;
            out->ssim += v->ssim / n;
            out->psnr += v->psnr / n;
        }
        out->gaussians += v->gaussians;
        out->visible += v->visible;
        out->rays += v->rays;
        out->hits += v->hits;
        out->blended += v->blended;
    }
    out->gaussians /= (size_t)t->def.views;
    out->visible /= (size_t)t->def.views;
}

/* One Adam step of the colour matrix of each photo of the step. */
static void learn_exposures(trainer *t, double progress, double next)
{
    const double rate = t->def.learning_rate_factor *
                        exposures_rate(t->train_count, progress, (next - progress) / t->def.views);
    for (int i = 0; t->exposures.count > 0 && i < t->def.views; i++)
        exposures_step(&t->exposures, t->slots[i], t->outcomes[i].d_exposure, rate);
}

/* One Adam step of the pose of each photo of the step; the mean of all poses stays. */
static void learn_poses(trainer *t, double progress, double next)
{
    const double rate =
        t->def.learning_rate_factor * poses_rate(t->train_count, progress, (next - progress) / t->def.views);
    for (int i = 0; t->poses.count > 0 && i < t->def.views; i++)
        poses_step(&t->poses, &t->scene, t->train_views, t->slots[i], t->outcomes[i].d_pose, rate);
}

/* One Adam step of the background with the mean gradient of the views. */
static void learn_sky(trainer *t, double rate)
{
    double sum[SH_COUNT][3] = {0};
    if (!t->settings.sky.varies)
        return;
    for (int i = 0; i < t->def.views; i++)
        for (int k = 0; k < 3 * SH_COUNT; k++)
            sum[k / 3][k % 3] += t->outcomes[i].d_sky[k / 3][k % 3];
    sky_step(&t->settings, &t->sky, sum, adam_rates_of_views(rate, t->step + 1, t->def.views));
}

/* With one view per step, its statistics go straight into the trainer's. */
static void gather_alone(trainer *t)
{
    const step_view *v = &t->views[0];
    growth_stats_gather(&t->stats, &v->frame, t->rules.importance, t->rules.gradient_counting,
                        step_view_near(t, v));
}

static bool has_begun(const trainer *t) { return t->rules.begins_at == 0 || t->began > 0; }

static gbt_status begin_when_due(trainer *t, double progress, gbt_error *err)
{
    if (has_begun(t) || progress < t->rules.begins_at)
        return GBT_OK;
    t->began = t->step;
    return trainer_begin_again(t, err);
}

gbt_status trainer_step(trainer *t, step_report *out, gbt_error *err)
{
    stage_clock start = stage_begin();
    memset(out, 0, sizeof *out);
    const double progress = pace_progress(&t->pace, t->step), next = pace_progress(&t->pace, t->step + 1),
                 views = t->def.views, all_views = views * pace_expected(&t->pace, t->step);
    const bool learns = t->rules.last_step_learns || next < 1,
               leaves_out = t->rules.leaves_out && train_rules_are_loose(&t->rules, progress);
    GBT_TRY(begin_when_due(t, progress, err));
    const learning_rates rates = learning_rates_at(
        &(learning_rates_def){.progress = train_rules_progress(&t->rules, &t->pace, t->step),
                              .uses_own_rates = t->rules.own_rates,
                              .geometry_stays = !has_begun(t),
                              .extent = t->extent,
                              .factor = t->def.learning_rate_factor * sqrt(views),
                              .end = schedule_rate_end(all_views),
                              .views = t->def.views});
    t->left_out = leaves_out ? schedule_left_out(all_views / (double)t->train_count * t->pixel_share) : 0;

    /* Views, with some pixels of each: render, loss, gradient. */
    GBT_TRY(run_views(t, out, err));
    report_views(t, out);
    for (int i = 0; i < t->def.views; i++)
        if (t->outcomes[i].bad)
            return skip_step(t, out, t->outcomes[i].text, err);
    t->skipped_in_row = 0;
    raise_opacities(t, out, progress);

    /* Sum the gradients, then update the parameters. */
    stage_clock clock = stage_begin();
    if (t->def.views > 1)
        GBT_TRY(step_rows_add_up(t, out, err));
    if (learns) {
        learn_exposures(t, progress, next);
        learn_poses(t, progress, next);
        learn_sky(t, t->def.learning_rate_factor * sqrt(views) * sky_rate(progress));
    }
    const bool adjust = growing_is_due(t);
    const learning_model model = model_of(t);
    if (learns)
        learn_networks(&model, &rates, t->step + 1 - t->began);
    if (learns && (!adjust || t->rules.anchors_learn_when_adjusted))
        learn_anchors(&model, &rates, ++t->anchor_t);
    else
        anchors_zero_learned(&t->gradient.anchors); /* this gradient is dropped, as in the reference */
    out->optimizer = stage_lap(&clock);

    /* Growth and pruning of anchors. */
    clock = stage_begin();
    if (t->def.views == 1 && growing_gathers(t))
        gather_alone(t);
    if (adjust)
        GBT_TRY(growing_round(t, err));
    out->adjust = stage_lap(&clock);
    t->step++;
    out->all = stage_lap(&start);
    return GBT_OK;
}

void trainer_free(trainer *t)
{
    anchors_free(&t->anchors);
    learnables *const kept[] = {&t->gradient, &t->moment1, &t->moment2};
    for (int i = 0; i < 3; i++)
        learnables_free(kept[i]);
    mem_free(t->created);
    mem_free(t->scale_log_max);
    decoder_free(&t->decoder);
    growth_stats_free(&t->stats);
    for (size_t i = 0; t->views != NULL && i < t->view_count; i++)
        step_view_free(&t->views[i]);
    mem_free(t->views);
    row_list *const rows[] = {&t->own_rows, &t->rows, &t->received, &t->owned};
    for (int i = 0; i < 4; i++)
        row_list_free(rows[i]);
    exposures_free(&t->exposures);
    poses_free(&t->poses);
    mem_free(t->order);
    mem_free(t->train_views);
    if (t->photos.source != NULL)
        photos_close(&t->photos);
    scene_free(&t->scene);
    memset(t, 0, sizeof *t);
}
