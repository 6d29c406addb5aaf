/* SPDX-License-Identifier: Apache-2.0 */
/* command/evaluate.c -- score a run on its held-out views, and write metrics.json, the report page and
   TensorBoard events. */
#include "gbtrace/evaluate.h"

#include <jansson.h>
#include <math.h>

#include "base/choice.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "cluster/cluster.h"
#include "data/json_out.h"
#include "eval/score_files.h"
#include "eval/score_run.h"
#include "report/report.h"

gbt_evaluate_def gbt_evaluate_def_default(void)
{
    return (gbt_evaluate_def){.renderer = GBT_RENDERER_AS_TRAINED,
                              .report = true,
                              .preset = GBT_PRESET_AS_TRAINED,
                              .cookie_ = DEF_COOKIE};
}

/* A gain by fitted colours above this, in dB, is reported: photos of constant exposure stay below it. */
#define EXPOSURE_HINT 1.0

static void log_scores(const evaluation *e)
{
    char more[64] = "";
    if (e->lpips_network != NULL)
        snprintf(more, sizeof more, ", LPIPS (%s) %.4f, in [0, 1] %.4f", e->lpips_network, e->lpips.lpips,
                 e->lpips.lpips_01);
    if (e->view_count == 0 || isnan(e->psnr)) {
        const char *why =
            e->view_count == 0 ? "no held-out views" : "no held-out view has a pixel that counts";
        log_info("%s: scores are n/a", why);
        return;
    }
    log_info("%zu held-out views: PSNR %.3f dB, SSIM %.4f, FLIP %.4f%s%s", e->view_count, e->psnr, e->ssim,
             e->flip, more, e->exposure ? ", of their right halves" : "");
    if (!e->exposure && e->psnr_fitted > e->psnr + EXPOSURE_HINT)
        log_info(
            "with the colours of held-out photos fitted PSNR is %.2f dB: they may differ in exposure from "
            "the scene (docs/metrics.md)",
            e->psnr_fitted);
}

/**
 * @param own [out] whether the scores count as the run's own: with its renderer, size and cut-offs, and with
 * its data set, or with any other if it has none or its own is gone
 */
static gbt_status open_run(const char *run, const gbt_evaluate_def *def, loaded_run *r, bool *own,
                           gbt_error *err)
{
    char own_model[4096], own_scores[4096];
    GBT_TRY(file_join(own_scores, sizeof own_scores, run, "metrics.json", err));
    GBT_TRY(file_join(own_model, sizeof own_model, run, "model.gbt", err));
    if (def->json != NULL && file_is_same(def->json, own_model))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (`json` must be another file)",
                         def->json);
    if (!(def->downscale == 0 || (def->downscale >= 1 && def->downscale <= 64)))
        return base_fail(err, GBT_ERR_ARGUMENT, "downscale: %g (wanted 1 to 64)", def->downscale);
    GBT_TRY(loaded_run_open_model(run, r, err));
    r->data_is_known = def->after_training;
    GBT_TRY(loaded_run_open_views(run, def->data, def->downscale, r, err));
    GBT_TRY(loaded_run_preset(def->preset, &r->settings, err));
    const gbt_renderer trained = r->frame.draw.renderer;
    if (def->renderer != GBT_RENDERER_AS_TRAINED) {
        GBT_TRY(choice_check("renderer", GBT_RENDERER_TRAINING_NAMES, (int)def->renderer, err));
        r->frame.draw.renderer = def->renderer;
    }
    const char *data = r->data.place; /* where its own data set is now; empty: gone */
    *own = r->frame.draw.renderer == trained && (def->downscale <= 0 || def->downscale == r->def.downscale) &&
           (def->preset == GBT_PRESET_AS_TRAINED || def->preset == GBT_PRESET_DEFAULT) &&
           (def->data == NULL || data[0] == '\0' || file_is_same(def->data, data));
    if (!*own && def->json != NULL && file_is_one(def->json, own_scores))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (`json` must be another file)",
                         def->json);
    return GBT_OK;
}

/* Write the files that hold the run's own scores. */
static gbt_status write_own(const char *run, const gbt_evaluate_def *def, loaded_run *r, const evaluation *e,
                            const json_t *metrics, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "metrics.json", err));
    GBT_TRY(json_save(metrics, path, err));
    if (def->report)
        GBT_TRY(report_write(run, e, metrics, &(report_more){.open = r}, err));
    return def->tensorboard ? score_files_events(e, r->model.iterations, run, err) : GBT_OK;
}

gbt_status gbt_evaluate(const char *run, const gbt_evaluate_def *def, gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(def_check(def->cookie_, "gbt_evaluate_def_default", err));
    if (!file_is_folder(run))
        return base_fail(err, GBT_ERR_IO, "%s: not a run folder (wanted what gbtrace train wrote)", run);
    stop_signal_catch();
    evaluation e = {0};
    lpips *net = NULL;
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    bool own = false;
    gbt_status status = r == NULL ? GBT_ERR_NO_MEMORY : open_run(run, def, r, &own, err);
    if (status == GBT_OK && def->lpips != NULL)
        status = lpips_open(def->lpips, &net, err);
    status = cluster_agree(status, err);
    if (status == GBT_OK)
        status = score_run(r, run, own, net, &e, err);
    const bool writes = status == GBT_OK && cluster_leads(), scored = status == GBT_OK;
    if (writes) {
        json_t *metrics = score_files_json(&e, run);
        if (def->preset != GBT_PRESET_AS_TRAINED)
            json_object_set_new(metrics, "preset", json_string(CHOICE_NAME(GBT_PRESET_NAMES, def->preset)));
        if (def->data != NULL)
            json_object_set_new(metrics, "data", json_text(def->data));
        if (own)
            status = write_own(run, def, r, &e, metrics, err);
        if (status == GBT_OK && def->json != NULL)
            status = json_save(metrics, def->json, err);
        json_decref(metrics);
    }
    if (scored)
        status = cluster_follow(status, err);
    if (status == GBT_OK)
        log_scores(&e);
    if (status == GBT_OK && !own && def->json != NULL)
        log_info("other settings than the run's own: scores are only in %s; %s/metrics.json and report.html "
                 "are unchanged",
                 def->json, run);
    else if (status == GBT_OK && !own)
        log_info("other settings than the run's own: %s/metrics.json and report.html are unchanged; name a "
                 "JSON file to keep these scores",
                 run);
    lpips_close(net);
    mem_free(e.views);
    if (r != NULL)
        loaded_run_close(r);
    mem_free(r);
    stop_signal_release();
    return status;
}
