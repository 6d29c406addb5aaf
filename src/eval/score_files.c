/* SPDX-License-Identifier: Apache-2.0 */
/* eval/score_files.c -- write scores as JSON and as TensorBoard events. */
#include "eval/score_files.h"

#include <stdio.h>

#include "base/choice.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/json_fields.h"
#include "data/json_out.h"
#include "train/event_records.h"

enum { EVENTS_VIEWS = 8 };

#define PROTOCOL                                                                                             \
    "8-bit images; SSIM 11x11 Gaussian, zero padding; FLIP 67 pixels per degree; means over held-out views"

static void add_lpips(json_t *to, const lpips_scores *scores)
{
    json_object_set_new(to, "lpips", json_number(scores->lpips));
    json_object_set_new(to, "lpips_01", json_number(scores->lpips_01));
}

static json_t *from_scores(const evaluation *e)
{
    json_t *root = json_object(), *views = json_array();
    json_object_set_new(root, "schema", json_integer(1));
    json_object_set_new(root, "psnr", json_number(e->psnr));
    json_object_set_new(root, "psnr_fitted", json_number(e->psnr_fitted));
    json_object_set_new(root, "ssim", json_number(e->ssim));
    json_object_set_new(root, "flip", json_number(e->flip));
    if (e->lpips_network != NULL) {
        add_lpips(root, &e->lpips);
        json_object_set_new(root, "lpips_network", json_string(e->lpips_network));
    }
    json_object_set_new(root, "protocol",
                        json_string(e->lpips_network == NULL ? PROTOCOL
                                                             : PROTOCOL
                                        "; LPIPS 0.1 of colours in [-1, 1], lpips_01 in [0, 1]"));
    for (size_t i = 0; i < e->view_count; i++) {
        const view_score *v = &e->views[i];
        json_t *view =
            json_pack("{s:o,s:o,s:o,s:o,s:o,s:o,s:f,s:I}", "name", json_text(v->name), "picture",
                      json_text(v->file), "psnr", json_number(v->psnr), "psnr_fitted",
                      json_number(v->psnr_fitted), "ssim", json_number(v->ssim), "flip", json_number(v->flip),
                      "seconds", v->seconds, "gaussians", (json_int_t)v->gaussians);
        if (e->lpips_network != NULL)
            add_lpips(view, &v->lpips);
        json_array_append_new(views, view);
    }
    json_object_set_new(root, "renderer", json_string(CHOICE_NAME(GBT_RENDERER_NAMES, e->renderer)));
    json_object_set_new(root, "downscale", json_real(e->downscale));
    json_object_set_new(root, "exposure", json_boolean(e->exposure));
    char scored[128];
    snprintf(scored, sizeof scored, "%s%s%s",
             e->exposure ? "right half, with a colour matrix fitted to the left half" : "whole image",
             e->masked ? ", without masked pixels" : "", e->aligned ? ", from aligned poses" : "");
    json_object_set_new(root, "scored", json_string(scored));
    json_object_set_new(root, "views", views);
    json_object_set_new(root, "anchors_final", json_integer((json_int_t)e->anchors));
    json_object_set_new(root, "gaussians_per_view", json_number(e->gaussians_per_view));
    json_object_set_new(root, "model_bytes", json_integer((json_int_t)e->model_bytes));
    return root;
}

/* Copy the contents of train.json into metrics.json, so that one file has everything about a run. */
static void add_training(json_t *root, const char *run)
{
    char path[4096];
    gbt_error ignored = {0};
    json_t *training;
    if (file_join(path, sizeof path, run, "train.json", &ignored) != GBT_OK ||
        json_read(path, &training, &ignored) != GBT_OK)
        return;
    json_object_update_missing(root, training);
    json_decref(training);
}

json_t *score_files_json(const evaluation *e, const char *run)
{
    json_t *root = from_scores(e);
    if (root != NULL)
        add_training(root, run);
    return root;
}

static gbt_status add_picture(event_records *r, uint64_t step, const char *group, const char *name,
                              const char *path, gbt_error *err)
{
    char tag[VIEW_PATH_SIZE];
    unsigned char *bytes = NULL;
    size_t count;
    GBT_TRY(file_read(path, &bytes, &count, err));
    snprintf(tag, sizeof tag, "%s/%s", group, name);
    event_add_png(r, step, tag, bytes, count);
    mem_free(bytes);
    return GBT_OK;
}

gbt_status score_files_events(const evaluation *e, uint64_t step, const char *run, gbt_error *err)
{
    char path[4096];
    event_records r = {0};
    const event_scalar scores[] = {{"eval/psnr", e->psnr}, {"eval/ssim", e->ssim}, {"eval/flip", e->flip}};
    event_add_version(&r);
    if (e->view_count > 0)
        event_add_scalars(&r, step, scores, sizeof scores / sizeof *scores);
    gbt_status status = file_join(path, sizeof path, run, EVENTS_EVAL_NAME, err);
    for (size_t i = 0; i < e->view_count && i < EVENTS_VIEWS && status == GBT_OK; i++) {
        const view_score *v = &e->views[i];
        status = add_picture(&r, step, "render", v->name, v->render_path, err);
        if (status == GBT_OK)
            status = add_picture(&r, step, "photo", v->name, v->photo_path, err);
    }
    if (status == GBT_OK && r.status != GBT_OK)
        status = base_fail(err, r.status, "%s: no memory", path);
    if (status == GBT_OK)
        status = file_write_atomic(path, r.bytes, r.count, err);
    event_records_free(&r);
    return status;
}
