/* eval/evaluate.c -- score a run on its held-out views and write what is known of it: metrics.json, the page, events. */
#include "gbtrace/evaluate.h"

#include <jansson.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/json_out.h"
#include "eval/score_files.h"
#include "eval/score_run.h"
#include "report/report.h"

gbt_evaluate_def gbt_evaluate_def_default(void)
{
    return (gbt_evaluate_def){.report = 1};
}

static void log_scores(const evaluation *e)
{
    char more[64] = "";
    if (e->lpips_network != NULL)
        snprintf(more, sizeof more, ", LPIPS (%s) %.4f, in [0, 1] %.4f", e->lpips_network, e->lpips.lpips, e->lpips.lpips_01);
    if (e->view_count == 0)
        log_info("no held-out views: scores are n/a");
    else
        log_info("%zu held-out views: PSNR %.3f dB, SSIM %.4f, FLIP %.4f%s", e->view_count, e->psnr, e->ssim, e->flip, more);
}

static gbt_status open_run(const char *run, const gbt_evaluate_def *def, loaded_run *r, gbt_error *err)
{
    GBT_TRY(loaded_run_open(run, def->data, def->downscale, r, err));
    GBT_TRY(loaded_run_preset(def->preset, &r->settings, err));
    if (def->renderer != NULL && !frame_renderer_named(def->renderer, &r->frame.draw.renderer))
        return base_fail(err, GBT_ERR_ARGUMENT, "--renderer: \"%.40s\" (wanted trace, raster or per-ray)", def->renderer);
    return GBT_OK;
}

static gbt_status write_all(const char *run, const gbt_evaluate_def *def, loaded_run *r, const evaluation *e, const json_t *metrics,
                            gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "metrics.json", err));
    GBT_TRY(json_save(metrics, path, err));
    if (def->json != NULL)
        GBT_TRY(json_save(metrics, def->json, err));
    if (def->report)
        GBT_TRY(report_write(run, e, metrics, &(report_more){.open = r}, err));
    return def->tensorboard ? score_files_events(e, r->model.iterations, run, err) : GBT_OK;
}

gbt_status gbt_evaluate(const char *run, const gbt_evaluate_def *def, gbt_error *err)
{
    if (!file_is_folder(run))
        return base_fail(err, GBT_ERR_IO, "%s: not a run folder (wanted what gbtrace train wrote)", run);
    evaluation e = {0};
    lpips *net = NULL;
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = open_run(run, def, r, err);
    if (status == GBT_OK && def->lpips != NULL)
        status = lpips_open(def->lpips, &net, err);
    if (status == GBT_OK)
        status = score_run(r, run, net, &e, err);
    if (status == GBT_OK) {
        json_t *metrics = score_files_json(&e, run);
        if (def->preset != NULL)
            json_object_set_new(metrics, "preset", json_string(def->preset));
        status = write_all(run, def, r, &e, metrics, err);
        json_decref(metrics);
    }
    if (status == GBT_OK)
        log_scores(&e);
    lpips_close(net);
    mem_free(e.views);
    loaded_run_close(r);
    mem_free(r);
    return status;
}
