/* SPDX-License-Identifier: Apache-2.0 */
/* report/report.c -- write the page of a run, section by section.

     evaluation (scores, PNG files) --+
     metrics (the object)           --+
     RUN/log.csv                    --+--> one HTML text --> RUN/report.html
     the open run: model, cameras   --+
     charts of studies (SVG files)  --+ */
#include "report/report.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "report/facts.h"
#include "report/metrics.h"
#include "report/scene.h"
#include "report/studies.h"
#include "report/style.h"
#include "report/text.h"
#include "report/training.h"
#include "report/views.h"

/** The last component of a path, without trailing slashes: the name of a data set. */
static void base_name(const char *path, char *out, size_t size)
{
    size_t end = strlen(path);
    while (end > 1 && path[end - 1] == '/')
        end--;
    size_t start = end;
    while (start > 0 && path[start - 1] != '/')
        start--;
    snprintf(out, size, "%.*s", (int)(end - start < size ? end - start : size - 1), path + start);
}

static void open_tile(text *out, const char *name)
{
    text_format(out, "<div class=\"tile card\"><dt>%s</dt><dd>", name);
}

static void close_tile(text *out, const char *unit)
{
    text_format(out, "%s%s%s</dd></div>\n", unit[0] != '\0' ? " <small>" : "", unit,
                unit[0] != '\0' ? "</small>" : "");
}

static void add_tiles(text *out, const evaluation *e, const json_t *metrics)
{
    text_add(out, "<dl class=\"tiles\">\n");
    open_tile(out, "Held-out PSNR");
    text_number(out, e->psnr, 2);
    close_tile(out, isnan(e->psnr) ? "" : "dB");
    if (isfinite(e->psnr_fitted)) {
        open_tile(out, "PSNR, colours fitted");
        text_number(out, e->psnr_fitted, 2);
        close_tile(out, "dB");
    }
    open_tile(out, "SSIM");
    text_number(out, e->ssim, 4);
    close_tile(out, "");
    open_tile(out, "FLIP (0 is best)");
    text_number(out, e->flip, 4);
    close_tile(out, "");
    if (e->lpips_network != NULL) {
        open_tile(out, strcmp(e->lpips_network, "vgg") == 0 ? "LPIPS, VGG" : "LPIPS, AlexNet");
        text_number(out, e->lpips.lpips, 4);
        close_tile(out, "");
    }
    open_tile(out, "Training time");
    text_duration(out, metrics_number(metrics, "train_seconds"));
    close_tile(out, "");
    open_tile(out, "Anchors");
    text_count(out, (double)e->anchors);
    close_tile(out, "");
    open_tile(out, "Gaussians per view");
    text_count(out, e->gaussians_per_view);
    close_tile(out, "");
    open_tile(out, "Model file");
    text_bytes(out, e->model_bytes > 0 ? (double)e->model_bytes : (double)NAN);
    close_tile(out, "");
    open_tile(out, "Iterations");
    text_count(out, metrics_number(metrics, "iterations"));
    close_tile(out, "");
    text_add(out, "</dl>\n");
}

static void add_contents(text *out, bool has_scene, bool has_layers, bool has_studies)
{
    const struct {
        const char *id, *name;
        bool there;
    } parts[] = {{"views", "Held-out views", true},
                 {"scene", "The scene", has_scene},
                 {"layers", "From points to a picture", has_layers},
                 {"training", "Training", true},
                 {"time", "Time", true},
                 {"studies", "Studies", has_studies},
                 {"facts", "Facts", true},
                 {"again", "Make it again", true}};
    text_add(out, "<nav>");
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (parts[i].there)
            text_format(out, "<a href=\"#%s\">%s</a>", parts[i].id, parts[i].name);
    text_add(out, "</nav>\n");
}

static void add_head(text *out, const char *run, const evaluation *e, const json_t *metrics, bool has_scene,
                     bool has_layers, bool has_studies)
{
    char name[256];
    const char *data = metrics_text(metrics, "data"), *command = metrics_text(metrics, "command");
    base_name(data != NULL ? data : run, name, sizeof name);
    text_add(out, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta "
                  "name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                  "<title>");
    text_escaped(out, name);
    text_add(out, " \xc2\xb7 gbtrace</title>\n<style>\n");
    text_add(out, report_css);
    text_add(out, "</style>\n</head>\n<body>\n<header>\n<h1>");
    text_escaped(out, name);
    const char *renderer = metrics_text(metrics, "renderer");
    const bool splats = renderer != NULL && strcmp(renderer, "trace") != 0;
    text_format(out, "</h1>\n<p class=\"lead\">A neural Gaussian scene, %s. Data: ",
                splats ? "rendered by splats on the CPU" : "rendered by CPU ray tracing");
    text_escaped(out, data);
    text_format(out, " \xc2\xb7 %zu held-out view%s</p>\n", e->view_count, e->view_count == 1 ? "" : "s");
    add_contents(out, has_scene, has_layers, has_studies);
    text_add(out, "</header>\n<main>\n");
    add_tiles(out, e, metrics);
    text_add(out, command != NULL ? "<pre class=\"card\">$ " : "<p class=\"note\">command: ");
    text_escaped(out, command);
    text_add(out, command != NULL ? "</pre>\n" : "</p>\n");
}

gbt_status report_write(const char *run, const evaluation *e, const json_t *metrics, const report_more *more,
                        gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "report.html", err));
    text out = {.err = err}, place = {.err = err}, layers = {.err = err}, studies = {.err = err};
    loaded_run *open = more != NULL ? more->open : NULL;
    report_studies(&studies, run, more != NULL ? more->studies : NULL, more != NULL ? more->study_count : 0);
    if (open != NULL) {
        report_scene(&place, open, e);
        report_layers(&layers, open, e);
    }
    add_head(&out, run, e, metrics, place.length > 0, layers.length > 0, studies.length > 0);
    report_views(&out, run, e, metrics_text(metrics, "protocol"), metrics_text(metrics, "scored"));
    text_append(&out, &place);
    text_append(&out, &layers);
    report_training(&out, run, e, metrics);
    text_append(&out, &studies);
    report_facts(&out, e, metrics, open != NULL ? open->model.config : NULL);
    report_again(&out, run, metrics);
    text_add(&out, "<script>\n");
    text_add(&out, report_script);
    text_add(&out, "</script>\n</body>\n</html>\n");
    gbt_status status = out.status;
    if (status == GBT_OK)
        status = file_write_atomic(path, out.bytes, out.length, err);
    text_free(&out);
    return status;
}
