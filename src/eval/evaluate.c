/* eval/evaluate.c -- score a run on its held-out views: renders, metrics.json. */
#include "eval/evaluate.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "eval/json_out.h"
#include "eval/loaded_run.h"
#include "eval/report.h"
#include "gbtrace/evaluate.h"
#include "image/metrics.h"
#include "train/event_records.h"

enum { EVENTS_VIEWS = 8 };

#define PROTOCOL "8-bit images; SSIM 11x11 Gaussian, zero padding; FLIP 67 pixels per degree; means over held-out views"

gbt_evaluate_def gbt_evaluate_def_default(void)
{
    return (gbt_evaluate_def){.report = 1};
}

gbt_status view_score_paths(view_score *score, const char *folder, gbt_error *err)
{
    char name[1024], file[1100];
    loaded_run_file_name(score->name, name, sizeof name);
    const struct { const char *suffix; char *path; } outputs[] = {
        {".png", score->render_path}, {".photo.png", score->photo_path}, {".flip.png", score->error_path}};
    for (int i = 0; i < 3; i++) {
        snprintf(file, sizeof file, "%s%s", name, outputs[i].suffix);
        GBT_TRY(file_join(outputs[i].path, VIEW_PATH_SIZE, folder, file, err));
    }
    return GBT_OK;
}

static gbt_status score_view(loaded_run *r, size_t index, const lpips *net, const char *folder, view_score *score, gbt_error *err)
{
    const scene_view *view = &r->scene.views[index];
    const double start = clock_wall();
    GBT_TRY(loaded_run_render(r, index, err));
    score->seconds = clock_wall() - start;
    score->gaussians = r->frame.gaussians.count;
    snprintf(score->name, sizeof score->name, "%s", view->name);
    image photo = {0}, error_map = {0};
    image *render = &r->frame.rgb;
    unsigned char *valid = NULL;
    image_scores scores = {0};
    gbt_status status = scene_read_photo_valid(view, render->width, render->height, &photo, &valid, err);
    if (status == GBT_OK)
        status = image_alloc(&error_map, render->width, render->height, 1, err);
    if (status == GBT_OK)
        status = image_score_photo(render, &photo, valid, r->def.exposure, &error_map, &scores, err);
    score->psnr = scores.psnr, score->ssim = scores.ssim, score->flip = scores.flip;
    score->masked = valid != NULL;
    if (status == GBT_OK && net != NULL) /* of the half that is scored (image_score_photo()) */
        status = lpips_compare(net, render, &photo, valid, r->def.exposure ? render->width / 2 : 0, &score->lpips, err);
    if (status == GBT_OK)
        status = view_score_paths(score, folder, err);
    const image *const pictures[] = {render, &photo, &error_map};
    const char *const paths[] = {score->render_path, score->photo_path, score->error_path};
    for (int i = 0; i < 3 && status == GBT_OK; i++)
        status = image_write(paths[i], pictures[i], err);
    mem_free(valid);
    image_free(&photo);
    image_free(&error_map);
    return status;
}

static void add_lpips(json_t *to, const lpips_scores *scores)
{
    json_object_set_new(to, "lpips", json_number(scores->lpips));
    json_object_set_new(to, "lpips_01", json_number(scores->lpips_01));
}

static json_t *scores_to_json(const evaluation *e)
{
    json_t *root = json_object(), *views = json_array();
    json_object_set_new(root, "schema", json_integer(1));
    json_object_set_new(root, "psnr", json_number(e->psnr));
    json_object_set_new(root, "ssim", json_number(e->ssim));
    json_object_set_new(root, "flip", json_number(e->flip));
    if (e->lpips_network != NULL) {
        add_lpips(root, &e->lpips);
        json_object_set_new(root, "lpips_network", json_string(e->lpips_network));
    }
    json_object_set_new(root, "protocol",
                        json_string(e->lpips_network == NULL ? PROTOCOL
                                                             : PROTOCOL "; LPIPS 0.1 of colours in [-1, 1], lpips_01 in [0, 1]"));
    for (size_t i = 0; i < e->view_count; i++) {
        const view_score *v = &e->views[i];
        json_t *view = json_pack("{s:s,s:o,s:o,s:o,s:f,s:I}", "name", v->name, "psnr", json_number(v->psnr), "ssim",
                                 json_number(v->ssim), "flip", json_number(v->flip), "seconds", v->seconds, "gaussians",
                                 (json_int_t)v->gaussians);
        if (e->lpips_network != NULL)
            add_lpips(view, &v->lpips);
        json_array_append_new(views, view);
    }
    json_object_set_new(root, "renderer", json_string(e->renderer));
    json_object_set_new(root, "downscale", json_real(e->downscale));
    json_object_set_new(root, "exposure", json_boolean(e->exposure));
    char scored[128];
    snprintf(scored, sizeof scored, "%s%s", e->exposure ? "right half, with a colour matrix fitted to the left half" : "whole image",
             e->masked ? ", without masked pixels" : "");
    json_object_set_new(root, "scored", json_string(scored));
    json_object_set_new(root, "views", views);
    json_object_set_new(root, "anchors_final", json_integer((json_int_t)e->anchors));
    json_object_set_new(root, "gaussians_per_view", json_number(e->gaussians_per_view));
    json_object_set_new(root, "model_bytes", json_integer((json_int_t)e->model_bytes));
    return root;
}

/* What training left in train.json goes into metrics.json too: one file says everything about a run. */
static void add_training(json_t *root, const char *run)
{
    char path[4096];
    gbt_error ignored = {0};
    unsigned char *bytes = NULL;
    size_t count;
    if (file_join(path, sizeof path, run, "train.json", &ignored) != GBT_OK || file_read(path, &bytes, &count, &ignored) != GBT_OK)
        return;
    json_t *training = json_loadb((const char *)bytes, count, 0, NULL);
    if (json_is_object(training))
        json_object_update_missing(root, training);
    json_decref(training);
    mem_free(bytes);
}

static gbt_status write_json(const json_t *root, const char *path, gbt_error *err)
{
    char *text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    if (text == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    const gbt_status status = file_write_atomic(path, text, strlen(text), err);
    free(text);
    return status;
}

static gbt_status score_run(loaded_run *r, const char *run, const lpips *net, evaluation *e, gbt_error *err)
{
    char folder[4096];
    GBT_TRY(file_join(folder, sizeof folder, run, "renders/test", err));
    GBT_TRY(file_make_folder(folder, err));
    size_t scored = 0;
    e->views = mem_calloc(r->scene.view_count + 1, sizeof *e->views, "view scores", err);
    if (e->views == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t wanted = 0;
    for (size_t i = 0; i < r->scene.view_count; i++)
        wanted += r->scene.views[i].is_test;
    for (size_t i = 0; i < r->scene.view_count; i++) {
        if (!r->scene.views[i].is_test)
            continue;
        view_score *v = &e->views[e->view_count];
        GBT_TRY(score_view(r, i, net, folder, v, err));
        log_count("score", ++e->view_count, wanted, v->psnr);
        e->masked = e->masked || v->masked;
        e->gaussians_per_view += (double)v->gaussians;
        if (!isfinite(v->psnr)) /* every pixel is masked */
            continue;
        scored++;
        e->psnr += v->psnr, e->ssim += v->ssim, e->flip += v->flip;
        e->lpips.lpips += v->lpips.lpips, e->lpips.lpips_01 += v->lpips.lpips_01;
    }
    const double n = (double)scored; /* 0 / 0 = NaN here becomes null in JSON and "n/a" on the page */
    e->lpips.lpips /= n, e->lpips.lpips_01 /= n;
    e->lpips_network = net != NULL ? lpips_network(net) : NULL;
    e->psnr /= n, e->ssim /= n, e->flip /= n, e->gaussians_per_view /= (double)e->view_count;
    e->anchors = r->model.anchors.count, e->exposure = r->def.exposure;
    e->renderer = frame_renderer_name(r->frame.draw.renderer), e->downscale = r->photos.downscale;
    char model_path[4096];
    struct stat info;
    GBT_TRY(file_join(model_path, sizeof model_path, run, "model.gbt", err));
    e->model_bytes = stat(model_path, &info) == 0 ? (size_t)info.st_size : 0;
    return GBT_OK;
}

static gbt_status add_picture(event_records *r, uint64_t step, const char *group, const char *name, const char *path, gbt_error *err)
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

/* Scores and the first pictures for TensorBoard, in place of what an earlier call wrote. */
static gbt_status write_events(const loaded_run *loaded, const char *run, const evaluation *e, gbt_error *err)
{
    char path[4096];
    event_records r = {0};
    const uint64_t step = loaded->model.iterations;
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

static void log_scores(const evaluation *e)
{
    char more[64] = "";
    if (e->lpips_network != NULL)
        snprintf(more, sizeof more, ", LPIPS (%s) %.4f, in [0, 1] %.4f", e->lpips_network, e->lpips.lpips, e->lpips.lpips_01);
    log_info("%zu held-out views: PSNR %.3f dB, SSIM %.4f, FLIP %.4f%s", e->view_count, e->psnr, e->ssim, e->flip, more);
}

gbt_status gbt_evaluate(const char *run, const gbt_evaluate_def *def, gbt_error *err)
{
    if (!file_is_folder(run))
        return base_fail(err, GBT_ERR_IO, "%s: not a run folder (wanted what gbtrace train wrote)", run);
    evaluation e = {0};
    json_t *root = NULL;
    lpips *net = NULL;
    loaded_run *r = mem_alloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = loaded_run_open(run, def->data, def->downscale, r, err);
    if (status == GBT_OK && def->lpips != NULL)
        status = lpips_open(def->lpips, &net, err);
    if (status == GBT_OK)
        status = loaded_run_preset(def->preset, &r->settings, err);
    if (status == GBT_OK && def->renderer != NULL && !frame_renderer_named(def->renderer, &r->frame.draw.renderer))
        status = base_fail(err, GBT_ERR_ARGUMENT, "--renderer: \"%.40s\" (wanted trace, raster or per-ray)", def->renderer);
    if (status == GBT_OK)
        status = score_run(r, run, net, &e, err);
    if (status != GBT_OK)
        goto done;
    char path[4096];
    root = scores_to_json(&e);
    if (def->preset != NULL)
        json_object_set_new(root, "preset", json_string(def->preset));
    add_training(root, run);
    status = file_join(path, sizeof path, run, "metrics.json", err);
    if (status == GBT_OK)
        status = write_json(root, path, err);
    if (status == GBT_OK && def->json != NULL)
        status = write_json(root, def->json, err);
    if (status == GBT_OK && def->report)
        status = report_write(run, &e, root, &(report_more){.open = r}, err);
    if (status == GBT_OK && def->tensorboard)
        status = write_events(r, run, &e, err);
    if (status == GBT_OK && e.view_count == 0)
        log_info("no held-out views: scores are n/a");
    else if (status == GBT_OK)
        log_scores(&e);
done:
    lpips_close(net);
    json_decref(root);
    mem_free(e.views);
    loaded_run_close(r);
    mem_free(r);
    return status;
}
