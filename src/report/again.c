/* SPDX-License-Identifier: Apache-2.0 */
/* report/again.c -- write the page of a finished run again, from the files that the run left. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "data/json_fields.h"
#include "gbtrace/evaluate.h"
#include "report/metrics.h"
#include "report/report.h"
#include "report/studies.h"

static size_t count_or_zero(double value) { return value >= 1 && value < 1e15 ? (size_t)value : 0; }

/** Read the scores back from metrics.json, with the pictures that scoring left. */
static gbt_status read_scores(const char *run, const json_t *metrics, evaluation *e, gbt_error *err)
{
    char folder[4096];
    const json_t *views = json_object_get(metrics, "views");
    *e = (evaluation){.psnr = metrics_number(metrics, "psnr"),
                      .psnr_fitted = metrics_number(metrics, "psnr_fitted"),
                      .ssim = metrics_number(metrics, "ssim"),
                      .flip = metrics_number(metrics, "flip"),
                      .lpips = {metrics_number(metrics, "lpips"), metrics_number(metrics, "lpips_01")},
                      .lpips_network = metrics_text(metrics, "lpips_network"),
                      .gaussians_per_view = metrics_number(metrics, "gaussians_per_view"),
                      .anchors = count_or_zero(metrics_number(metrics, "anchors_final")),
                      .model_bytes = count_or_zero(metrics_number(metrics, "model_bytes"))};
    GBT_TRY(file_join(folder, sizeof folder, run, "renders/test", err));
    e->views = mem_calloc(json_array_size(views) + 1, sizeof *e->views, "view scores", err);
    if (e->views == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < json_array_size(views); i++) {
        const json_t *view = json_array_get(views, i);
        view_score *v = &e->views[e->view_count];
        const char *name = metrics_text(view, "name");
        if (name == NULL)
            continue;
        snprintf(v->name, sizeof v->name, "%s", name);
        const char *picture = metrics_text(view, "picture");
        if (picture != NULL && strchr(picture, '/') == NULL)
            snprintf(v->file, sizeof v->file, "%s", picture);
        else /* as older versions named it */
            loaded_run_file_name(name, v->file);
        v->psnr = metrics_number(view, "psnr");
        v->ssim = metrics_number(view, "ssim");
        v->flip = metrics_number(view, "flip");
        v->lpips = (lpips_scores){metrics_number(view, "lpips"), metrics_number(view, "lpips_01")};
        v->seconds = metrics_number(view, "seconds");
        v->gaussians = count_or_zero(metrics_number(view, "gaussians"));
        GBT_TRY(view_score_paths(v, folder, err));
        e->view_count++;
    }
    return GBT_OK;
}

gbt_status gbt_report(const char *run, const char *const *studies, size_t study_count, gbt_error *err)
{
    PLAIN_NUMBERS;
    char path[4096];
    json_t *metrics = NULL;
    evaluation e = {0};
    gbt_error why = {0};
    for (size_t i = 0; i < study_count; i++)
        if (!file_exists(studies[i]))
            return base_fail(err, GBT_ERR_IO, "%s: no such file or folder (wanted what gbtrace study wrote)",
                             studies[i]);
        else if (!file_is_folder(studies[i]) && !report_is_chart(studies[i]))
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: no chart (wanted .svg, or a folder of them)",
                             studies[i]);
    GBT_TRY(file_join(path, sizeof path, run, "metrics.json", err));
    if (file_is_folder(run) && !file_exists(path))
        return base_fail(err, GBT_ERR_IO,
                         "%s: not there: the run has no scores yet (gbtrace eval makes them)", path);
    GBT_TRY(json_read(path, &metrics, err));
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    gbt_status status = r == NULL ? GBT_ERR_NO_MEMORY : read_scores(run, metrics, &e, err);
    if (status == GBT_OK) {
        const gbt_status opened = loaded_run_open(run, NULL, 0, r, &why);
        loaded_run_cut_hint(why.text);
        if (opened != GBT_OK)
            log_warn("no maps and layers: %s", why.text);
        status = report_write(run, &e, metrics,
                              &(report_more){.open = opened == GBT_OK ? r : NULL,
                                             .studies = studies,
                                             .study_count = study_count},
                              err);
    }
    if (status == GBT_OK)
        log_info("%s/report.html: %zu held-out views", run, e.view_count);
    if (r != NULL)
        loaded_run_close(r);
    mem_free(r);
    mem_free(e.views);
    json_decref(metrics);
    return status;
}
