/* SPDX-License-Identifier: Apache-2.0 */
/* study/rate.c -- the study "rate": compress a model at a series of qualities, read each file back, and score
   it on the held-out views. */
#include "study/rate.h"

#include <math.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "run/run_sensitivity.h"
#include "image/metrics.h"
#include "lab/lab.h"
#include "study/model.h"

static const double ladder[] = {48, 50, 52, 54, 55, 56, 58, 60, 65, 0};

_Static_assert(sizeof ladder / sizeof *ladder <= RATE_ROWS_MAX, "every quality has a row");

/* ---- scores ---- */

static gbt_status score_view(loaded_run *r, size_t view, image_scores *scores, gbt_error *err)
{
    GBT_TRY(loaded_run_render(r, view, err));
    image photo = {0};
    const unsigned char *valid = NULL;
    gbt_status status = frame_read_photo(&r->frame, &r->scene.views[view], &photo, &valid, err);
    if (status == GBT_OK)
        status = image_score_photo(&r->frame.rgb, &photo, valid, r->def.exposure, NULL, scores, err);
    image_free(&photo);
    return status;
}

/* As gbtrace eval: means over the held-out views that are not masked completely; NaN without any. */
static gbt_status score_model(loaded_run *r, size_t *views, double *psnr, double *ssim, gbt_error *err)
{
    image_scores sum = {0}, scores = {0};
    *views = 0;
    for (size_t view = 0; view < r->scene.view_count; view++) {
        if (!r->scene.views[view].is_test)
            continue;
        GBT_TRY(score_view(r, view, &scores, err));
        if (!isfinite(scores.psnr))
            continue;
        sum.psnr += scores.psnr;
        sum.ssim += scores.ssim;
        ++*views;
    }
    *psnr = sum.psnr / (double)*views;
    *ssim = sum.ssim / (double)*views;
    return GBT_OK;
}

/* ---- one model ---- */

static gbt_status measure_row(loaded_run *r, const model_sensitivity *s, double quality, const char *path,
                              rate_row *row, gbt_error *err)
{
    model_steps steps = {0};
    model back = {0};
    *row = (rate_row){.quality = quality};
    const bool coarse = quality > 0;
    gbt_status status = coarse ? model_steps_at(&r->model, s, quality, &steps, err) : GBT_OK;
    const double start = clock_wall();
    if (status == GBT_OK)
        status = model_save_coded(path, &r->model, coarse ? &steps : NULL, &row->sizes, err);
    const double coded = clock_wall();
    if (status == GBT_OK)
        status = model_load(path, &back, err);
    row->encode_seconds = coded - start;
    row->decode_seconds = clock_wall() - coded;
    model_steps_free(&steps);
    if (status != GBT_OK)
        return status;
    const model whole = r->model;
    size_t views;
    r->model = back;
    r->frame.draw.anchor_pixel = back.anchor_pixel;
    status = score_model(r, &views, &row->psnr, &row->ssim, err);
    r->model = whole;
    r->frame.draw.anchor_pixel = whole.anchor_pixel;
    model_free(&back);
    return status;
}

static gbt_status measure_run(loaded_run *r, const char *path, rate_model *out, gbt_error *err)
{
    model_sensitivity s = {0};
    out->anchors = r->model.anchors.count;
    gbt_status status = score_model(r, &out->views, &out->psnr, &out->ssim, err);
    const double start = clock_wall();
    if (status == GBT_OK)
        status = run_sensitivity(r, &s, err);
    if (status == GBT_OK)
        status = model_transform_features(&r->model, &s, err);
    out->probe_seconds = clock_wall() - start;
    int left_out = 0;
    for (size_t i = 0; i < sizeof ladder / sizeof *ladder && status == GBT_OK; i++) {
        if (ladder[i] > 0 && !model_positions_fit(&r->model, &s, ladder[i])) { /* as in gbt_compress() */
            left_out++;
            continue;
        }
        char name[32];
        rate_row *row = &out->rows[out->row_count];
        status = measure_row(r, &s, ladder[i], path, row, err);
        if (status == GBT_OK)
            log_info("%s: %s: %zu bytes, PSNR %.3f dB (%.3f before)", out->name,
                     rate_row_name(row, name, sizeof name), row->sizes.total, row->psnr, out->psnr);
        out->row_count += status == GBT_OK;
    }
    if (left_out > 0)
        log_warn("%s: an anchor is so far from the others that their positions would be rounded too much: "
                 "qualities left out: %d (sparse points far outside the scene?)",
                 out->name, left_out);
    model_sensitivity_free(&s);
    return status;
}

static gbt_status measure_model(const char *run, const char *path, rate_model *out, gbt_error *err)
{
    study_model_name(run, out->name, sizeof out->name);
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = loaded_run_open_model(run, r, err);
    if (status == GBT_OK)
        status = loaded_run_need_anchors(r, run, err);
    if (status == GBT_OK)
        status = loaded_run_open_own_views(run, r, err);
    if (status == GBT_OK)
        status = model_save(path, &r->model, err);
    if (status == GBT_OK) {
        unsigned char *bytes = NULL;
        status = file_read(path, &bytes, &out->plain_bytes, err);
        mem_free(bytes);
    }
    if (status == GBT_OK)
        status = measure_run(r, path, out, err);
    loaded_run_close(r);
    mem_free(r);
    return status;
}

gbt_status lab_study_rate(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err)
{
    char path[4096];
    if (def->models == NULL || def->model_count < 1 || def->model_count > RATE_MODELS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "study: wanted 1 to %d runs", (int)RATE_MODELS_MAX);
    GBT_TRY(study_models_differ(def->models, def->model_count, err));
    GBT_TRY(file_make_folder(folder, err));
    GBT_TRY(file_join(path, sizeof path, folder, "rate.model.gbt", err));
    rate_study *study = mem_calloc(1, sizeof *study, "study", err);
    if (study == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = GBT_OK;
    for (; study->model_count < def->model_count && status == GBT_OK; study->model_count++)
        status =
            measure_model(def->models[study->model_count], path, &study->models[study->model_count], err);
    unlink(path); /* every row was written to this one file */
    if (status == GBT_OK)
        status = study_output_save(&rate_output, study, folder, out, err);
    mem_free(study);
    return status;
}
