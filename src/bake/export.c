/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export.c -- exports a run, or converts plain Gaussians: bakes or reads, writes the files, reads them
   back, and reports the loss in dB. */
#include "gbtrace/export.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "bake/backdrop.h"
#include "bake/bake.h"
#include "bake/export_def.h"
#include "bake/export_folder.h"
#include "bake/refine.h"
#include "base/clock.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "data/gaussian_file.h"
#include "data/json_out.h"
#include "eval/lpips.h"
#include "image/metrics.h"
#include "run/loaded_run.h"
#include "train/near_distance.h"

enum { VIEWS_MAX = 16 };

static const double near_loss_db = 0.5; /* a larger loss gives a warning */

/* One output, and how well it reproduces the model: PSNR in dB of 8-bit images, means over views. */
typedef struct exported {
    const char *path;
    gaussian_cloud back;         /* the file read back, if we can read its format */
    const gaussian_cloud *shown; /* in the model's coordinates: `back`, or `baked` for formats that store
                                    floats unchanged */
    const gaussian_cloud *baked; /* what was written */
    float near;                  /* near distance with which readers of the file draw it */
    double to_baked;             /* PSNR between `back` and `baked` */
    double to_model, to_photo;
    double with_near; /* to_model, had the file stored the near distance */
    long long bytes;
} exported;

typedef struct exporting {
    const gbt_export_def *def;
    loaded_run run; /* valid if `baked` */
    bool baked, backdrop;
    trace_settings viewer;    /* how other programs draw files: on black */
    gaussian_cloud clouds[2]; /* with the requested SH degree, and with degree 0 */
    exported files[EXPORT_OUTPUTS_MAX];
    size_t file_count;
    size_t unseen, thinned;
    double origin[3], bake_seconds, refine_seconds, model_to_photo;
    size_t view_count, *views; /* views to compare */
    size_t photo_count;        /* number of these that have a photo with valid pixels */
    bool held_out;
    frame frame, baked_frame; /* render `shown` and `baked` of an output */
    const char *folder;       /* the output that is a result folder, or NULL */
    image_scores *scores;     /* [view_count], for the result folder */
    lpips *net;               /* for the folder, or NULL */
    lpips_scores *lpips;      /* [view_count], likewise */
} exporting;

/* ---- from a run to Gaussians ---- */

/* Choose held-out views to compare: at most VIEWS_MAX, evenly spaced; all for a result folder. Training views
   when there are no held-out ones. */
static gbt_status choose_views(exporting *e, gbt_error *err)
{
    const scene *s = &e->run.scene;
    size_t count = 0;
    for (size_t i = 0; i < s->view_count; i++)
        count += s->views[i].is_test;
    e->held_out = count > 0;
    count = e->held_out ? count : s->view_count;
    const size_t wanted = count < VIEWS_MAX || (e->folder != NULL && e->held_out) ? count : VIEWS_MAX;
    e->views = mem_alloc(wanted + 1, sizeof *e->views, "views", err);
    e->scores = mem_calloc(wanted + 1, sizeof *e->scores, "scores", err);
    e->lpips = mem_calloc(wanted + 1, sizeof *e->lpips, "scores", err);
    if (e->views == NULL || e->scores == NULL || e->lpips == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0, seen = 0; i < s->view_count && e->view_count < wanted; i++)
        if (s->views[i].is_test == e->held_out && seen++ == e->view_count * count / wanted)
            e->views[e->view_count++] = i;
    return GBT_OK;
}

/* The cameras of the training photos, and how each is drawn. The caller frees both, also after a failure. */
static gbt_status training_cameras(const loaded_run *r, gbt_camera **cameras, trace_settings **settings,
                                   size_t *count, gbt_error *err)
{
    *count = 0;
    *cameras = mem_alloc(r->scene.view_count + 1, sizeof **cameras, "cameras", err);
    *settings = mem_alloc(r->scene.view_count + 1, sizeof **settings, "cameras", err);
    if (*cameras == NULL || *settings == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < r->scene.view_count; i++)
        if (!r->scene.views[i].is_test) {
            (*cameras)[*count] = photos_camera(&r->photos, i, 0);
            (*settings)[(*count)++] = loaded_run_settings(r, i);
        }
    return GBT_OK;
}

static gbt_status open_run(exporting *e, const char *run, gbt_error *err)
{
    loaded_run *r = &e->run;
    GBT_TRY(loaded_run_open(run, e->def->data, 0, r, err));
    GBT_TRY(choose_views(e, err));
    memcpy(e->origin, r->model.origin, sizeof e->origin);
    e->frame.draw.footprint = e->baked_frame.draw.footprint = r->frame.draw.footprint;
    /* The colour behind photos with an alpha channel is not part of the scene: it gets no backdrop. */
    e->viewer = r->settings;
    float laid_on[3];
    if (scene_background(&r->scene, laid_on))
        return GBT_OK;
    const float *behind = r->model.background;
    e->backdrop =
        e->def->backdrop && (r->model.sky.varies || behind[0] > 0 || behind[1] > 0 || behind[2] > 0);
    if (e->backdrop && e->def->gaussians > 0 && e->def->gaussians <= BACKDROP_COUNT)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "gaussians: %d (wanted more than the %d of the background, or no background)",
                         e->def->gaussians, (int)BACKDROP_COUNT);
    memset(e->viewer.background, 0, sizeof e->viewer.background);
    e->viewer.sky.varies = false;
    return GBT_OK;
}

/* Bake the neural Gaussians of the run. */
static gbt_status bake_run(exporting *e, int sh_degree, gaussian_cloud *out, gbt_error *err)
{
    loaded_run *r = &e->run;
    gbt_camera *cameras;
    trace_settings *settings;
    size_t count;
    gbt_status status = training_cameras(r, &cameras, &settings, &count, err);
    bake_def bake = bake_def_default();
    bake.sh_degree = sh_degree;
    if (e->def->gaussians > 0)
        bake.count_max = (size_t)e->def->gaussians - (e->backdrop ? BACKDROP_COUNT : 0);
    bake_result result = {0};
    double clock = clock_wall();
    if (status == GBT_OK)
        status = bake_cloud(&r->frame, &r->model.anchors, &r->model.decoder, cameras, count, settings, &bake,
                            &result, err);
    *out = result.cloud;
    e->unseen = result.unseen;
    e->thinned = result.thinned;
    e->bake_seconds = clock_wall() - clock;
    clock = clock_wall();
    refine_def refine = refine_def_default();
    refine.steps = e->def->refine_steps;
    if (status == GBT_OK)
        status = refine_cloud(&r->frame, &r->model.anchors, &r->model.decoder, cameras, count, settings,
                              &refine, out, err);
    e->refine_seconds = clock_wall() - clock;
    if (status == GBT_OK && e->backdrop)
        status = backdrop_add(out, cameras, count, r->model.background, &r->model.sky, err);
    out->antialiased = r->frame.draw.footprint > 0;
    out->near = r->settings.t_near;
    mem_free(settings);
    mem_free(cameras);
    return status;
}

/* ---- measuring the loss ---- */

/* How other programs draw the view at `index`, with a given near distance. */
static trace_settings viewer_at(const exporting *e, size_t index, float near)
{
    trace_settings s = e->viewer;
    s.t_near = near_of_view(near, &e->run.def, &e->run.scene.views[e->views[index]]);
    return s;
}

/* Compare one view of the model with that view of every output. */
static gbt_status compare_view(exporting *e, size_t index, const gbt_camera *camera, image *photo,
                               const unsigned char *valid, gbt_error *err)
{
    const double share = 1 / (double)e->view_count;
    image *neural = &e->run.frame.rgb, *shown = &e->frame.rgb, *baked = &e->baked_frame.rgb;
    const gaussian_cloud *drawn = NULL; /* the cloud that `baked` shows */
    const trace_settings viewer = viewer_at(e, index, e->run.settings.t_near);
    image_quantize(photo);
    image_quantize(neural);
    const double of_model = metric_psnr_valid(neural, photo, valid);
    const bool scored = !isnan(of_model); /* false where a mask excludes the whole photo */
    e->photo_count += scored;
    e->model_to_photo += scored ? of_model : 0;
    for (size_t i = 0; i < e->file_count; i++) {
        exported *f = &e->files[i];
        GBT_TRY(frame_render(&e->frame, frame_plain(f->shown), camera, &viewer, false, err));
        image_quantize(shown);
        if (f->shown != f->baked && drawn != f->baked) {
            GBT_TRY(frame_render(&e->baked_frame, frame_plain(f->baked), camera, &viewer, false, err));
            image_quantize(baked);
            drawn = f->baked;
        }
        f->to_baked += f->shown != f->baked ? share * metric_psnr(shown, baked) : 0;
        f->with_near += share * metric_psnr(shown, neural);
        if (f->near != e->run.settings.t_near) { /* the file cannot store the model's near distance */
            const trace_settings own = viewer_at(e, index, f->near);
            GBT_TRY(frame_render(&e->frame, frame_plain(f->shown), camera, &own, false, err));
            image_quantize(shown);
        }
        f->to_model += share * metric_psnr(shown, neural);
        f->to_photo += scored ? metric_psnr_valid(shown, photo, valid) : 0;
        if (f->path != e->folder || !e->held_out)
            continue;
        GBT_TRY(image_score(shown, photo, valid, NULL, &e->scores[index], err));
        if (e->net != NULL)
            GBT_TRY(lpips_compare(e->net, shown, photo, valid, 0, &e->lpips[index], err));
        GBT_TRY(export_folder_picture(e->folder, &e->run, index, shown, photo, err));
    }
    return GBT_OK;
}

/* The outer loop is over views, so the model is rendered only once per view. */
static gbt_status compare(exporting *e, gbt_error *err)
{
    for (size_t i = 0; i < e->view_count; i++) {
        const gbt_camera camera = photos_camera(&e->run.photos, e->views[i], 0);
        image photo = {0};
        const unsigned char *valid = NULL;
        GBT_TRY(loaded_run_render(&e->run, e->views[i], err));
        gbt_status status =
            frame_read_photo(&e->run.frame, &e->run.scene.views[e->views[i]], &photo, &valid, err);
        if (status == GBT_OK)
            status = compare_view(e, i, &camera, &photo, valid, err);
        image_free(&photo);
        GBT_TRY(status);
    }
    e->model_to_photo /= (double)e->photo_count;
    for (size_t i = 0; i < e->file_count; i++)
        e->files[i].to_photo /= (double)e->photo_count;
    return GBT_OK;
}

/* ---- entry ---- */

static void say_source(const exporting *e, const gaussian_cloud *cloud, const char *input, FILE *report)
{
    fprintf(report, "%s: %zu Gaussians, colours of degree %d", input, cloud->count, cloud->sh_degree);
    if (e->baked) {
        if (e->backdrop)
            fprintf(report, "; %d of them the background", (int)BACKDROP_COUNT);
        fprintf(report, "; %zu that no training camera sees are left out", e->unseen);
        if (e->thinned > 0)
            fprintf(report, ", and %zu that are blended least", e->thinned);
        fprintf(report, "; baked in %.1f s, refined in %.1f s", e->bake_seconds, e->refine_seconds);
    }
    if (!e->baked && cloud->dropped > 0)
        fprintf(report, "; %zu unusable rows dropped", cloud->dropped);
    fprintf(report, "\n");
}

/* Write an output, and read it back. */
static gbt_status write_one(exporting *e, exported *f, const gaussian_cloud *cloud, gbt_error *err)
{
    const char *path = f->path;
    if (export_folder_is(path))
        return export_folder_write(path, &e->run, cloud, &f->bytes, err);
    GBT_TRY(gaussian_file_write(path, cloud, e->origin, err));
    struct stat info = {0};
    stat(path, &info);
    f->bytes = (long long)info.st_size;
    if (!e->baked || !gaussian_file_readable(path))
        return GBT_OK;
    GBT_TRY(gaussian_file_read(path, &f->back, err));
    for (size_t i = 0; i < 3 * f->back.count; i++)
        f->back.mean[i] = (float)((double)f->back.mean[i] + (f->back.origin[i % 3] - e->origin[i % 3]));
    f->shown = &f->back;
    return GBT_OK;
}

static gbt_status write_file(exporting *e, const char *path, const gaussian_cloud *cloud, gbt_error *err)
{
    exported *f = &e->files[e->file_count++];
    *f = (exported){.path = path, .shown = cloud, .baked = cloud};
    GBT_TRY(write_one(e, f, cloud, err));
    f->near = f->shown->near > 0 ? f->shown->near : trace_settings_default().t_near;
    return GBT_OK;
}

static json_t *file_to_json(const exporting *e, const exported *f)
{
    json_t *row = json_pack("{s:o,s:I,s:i}", "file", json_text(f->path), "bytes", (json_int_t)f->bytes,
                            "sh_degree", f->shown->sh_degree);
    if (e->baked && e->view_count > 0) {
        if (f->shown != f->baked)
            json_object_set_new(row, "psnr_to_bake", json_number(f->to_baked));
        json_object_set_new(row, "psnr_to_model", json_real(f->to_model));
        if (!e->run.def.exposure) {
            json_object_set_new(row, "psnr_to_photos", json_number(f->to_photo));
            json_object_set_new(row, "model_psnr_to_photos", json_number(e->model_to_photo));
        }
    }
    return row;
}

static void say_file(const exporting *e, const exported *f, FILE *report)
{
    fprintf(report, "%s: %.2f MB", f->path, (double)f->bytes / 1e6);
    if (e->baked && e->view_count > 0) {
        fprintf(report, "; %zu %s views: %.2f dB to the model", e->view_count,
                e->held_out ? "held-out" : "training", f->to_model);
        if (!e->run.def.exposure && e->photo_count > 0)
            fprintf(report, ", %.2f dB to the photos (the model: %.2f)", f->to_photo, e->model_to_photo);
        fprintf(report, ", drawn on %s", e->viewer.background[0] > 0 ? "white" : "black");
    }
    fprintf(report, "\n");
}

/* Write all outputs whose format stores this SH degree, or with `flat` those of degree 0. For these the
   colours are fitted separately, because degree 0 of a longer fit is not the best constant. */
static gbt_status write_kind(exporting *e, const char *input, bool flat, const char *const *outputs,
                             size_t output_count, FILE *report, gbt_error *err)
{
    bool any = false;
    for (size_t i = 0; i < output_count; i++)
        any = any || (gaussian_file_degree(outputs[i]) == 0) == flat;
    if (!any)
        return GBT_OK;
    const int degree = flat ? 0 : e->def->sh_degree;
    gaussian_cloud *cloud = &e->clouds[flat];
    GBT_TRY(e->baked ? bake_run(e, degree, cloud, err) : gaussian_file_read(input, cloud, err));
    if (cloud->sh_degree > degree)
        cloud->sh_degree = degree;
    if (report != NULL)
        say_source(e, cloud, input, report);
    for (size_t i = 0; i < output_count; i++)
        if ((gaussian_file_degree(outputs[i]) == 0) == flat)
            GBT_TRY(write_file(e, outputs[i], cloud, err));
    return GBT_OK;
}

static gbt_status report_all(const exporting *e, const char *input, FILE *report, gbt_error *err)
{
    json_t *files = json_array();
    for (size_t i = 0; i < e->file_count; i++) {
        const exported *f = &e->files[i];
        json_array_append_new(files, file_to_json(e, f));
        if (report != NULL)
            say_file(e, f, report);
        if (f->with_near - f->to_model > near_loss_db)
            log_warn(
                "%s: the format does not keep the near distance (%.3g): PSNR to the model is %.2f dB instead "
                "of %.2f",
                f->path, (double)e->run.settings.t_near, f->to_model, f->with_near);
    }
    gbt_status status = GBT_OK;
    if (e->def->json != NULL) {
        const size_t count = e->file_count > 0 ? e->files[e->file_count - 1].shown->count : 0;
        json_t *root = json_pack("{s:i,s:o,s:I,s:I,s:I,s:O}", "schema", 1, "input", json_text(input),
                                 "gaussians", (json_int_t)count, "unseen", (json_int_t)e->unseen, "thinned",
                                 (json_int_t)e->thinned, "files", files);
        status = json_save(root, e->def->json, err);
        json_decref(root);
    }
    json_decref(files);
    return status;
}

static void exporting_free(exporting *e)
{
    for (size_t i = 0; i < e->file_count; i++)
        gaussian_cloud_free(&e->files[i].back);
    for (int i = 0; i < 2; i++)
        gaussian_cloud_free(&e->clouds[i]);
    mem_free(e->views);
    mem_free(e->scores);
    mem_free(e->lpips);
    lpips_close(e->net);
    frame_free(&e->frame);
    frame_free(&e->baked_frame);
    loaded_run_close(&e->run);
    mem_free(e);
}

gbt_status gbt_export(const char *input, const gbt_export_def *def, const char *const *outputs,
                      size_t output_count, FILE *report, gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(def_check(def->cookie_, "gbt_export_def_default", err));
    GBT_TRY(export_check(input, def, outputs, output_count, err));
    exporting *e = mem_calloc(1, sizeof *e, "export", err);
    if (e == NULL)
        return GBT_ERR_NO_MEMORY;
    e->def = def;
    e->baked = !gaussian_file_readable(input);
    for (size_t i = 0; i < output_count; i++)
        if (export_folder_is(outputs[i]))
            e->folder = outputs[i];
    gbt_status status = GBT_OK;
    if (def->lpips != NULL)
        status = e->folder != NULL
                     ? lpips_open(def->lpips, &e->net, err)
                     : base_fail(err, GBT_ERR_ARGUMENT, "lpips: only for result folders (wanted OUT/)");
    if (status == GBT_OK && e->baked)
        status = open_run(e, input, err);
    if (status == GBT_OK && e->folder != NULL)
        status = export_folder_check(e->folder, &e->run, err);
    if (status == GBT_OK && e->folder != NULL)
        status = file_make_folder(e->folder, err);
    for (int flat = 0; flat < 2 && status == GBT_OK; flat++)
        status = write_kind(e, input, flat, outputs, output_count, report, err);
    if (status == GBT_OK && e->baked)
        status = compare(e, err);
    if (status == GBT_OK && e->folder != NULL && e->held_out)
        status = export_folder_scores(e->folder, &e->run, e->scores, e->net != NULL ? e->lpips : NULL,
                                      e->view_count, err);
    if (status == GBT_OK)
        status = report_all(e, input, report, err);
    exporting_free(e);
    return status;
}
