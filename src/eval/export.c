/* eval/export.c -- bake a run or read plain Gaussians, write them, and say what was lost. */
#include "gbtrace/export.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "bake/bake.h"
#include "bake/refine.h"
#include "base/clock.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/gaussian_file.h"
#include "eval/json_out.h"
#include "eval/loaded_run.h"
#include "image/metrics.h"

enum { OUTPUTS_MAX = 8, VIEWS_MAX = 16 };

gbt_export_def gbt_export_def_default(void)
{
    return (gbt_export_def){.sh_degree = 3, .refine_steps = 300};
}

/* Means over views; NaN where there is nothing to compare with. */
typedef struct loss_of_view {
    double to_model, to_photo; /* PSNR, dB, 8-bit images */
} loss_of_view;

typedef struct exporting {
    const gbt_export_def *def;
    loaded_run run; /* with `baked` */
    bool baked;
    gaussian_cloud cloud;
    size_t unseen;
    double origin[3], bake_seconds, refine_seconds, model_to_photo;
    size_t view_count, views[VIEWS_MAX]; /* that are compared */
    bool held_out;
    frame frame;
} exporting;

/* ---- from a run to Gaussians ------------------------------------------------------------------------------------------------------------ */

/* Held-out views, at most VIEWS_MAX evenly chosen; training views when there are none. */
static void choose_views(exporting *e)
{
    const scene *s = &e->run.scene;
    size_t count = 0;
    for (size_t i = 0; i < s->view_count; i++)
        count += s->views[i].is_test;
    e->held_out = count > 0;
    count = e->held_out ? count : s->view_count;
    const size_t wanted = count < VIEWS_MAX ? count : VIEWS_MAX;
    for (size_t i = 0, seen = 0; i < s->view_count && e->view_count < wanted; i++)
        if (s->views[i].is_test == e->held_out && seen++ == e->view_count * count / wanted)
            e->views[e->view_count++] = i;
}

static gbt_status training_cameras(const loaded_run *r, gbt_camera **out, size_t *count, gbt_error *err)
{
    *count = 0;
    *out = mem_alloc(r->scene.view_count + 1, sizeof **out, "cameras", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < r->scene.view_count; i++)
        if (!r->scene.views[i].is_test)
            (*out)[(*count)++] = photos_camera(&r->photos, i, 0);
    return GBT_OK;
}

static gbt_status open_run(exporting *e, const char *run, gbt_error *err)
{
    loaded_run *r = &e->run;
    GBT_TRY(loaded_run_open(run, e->def->data, 0, r, err));
    choose_views(e);
    memcpy(e->origin, r->model.origin, sizeof e->origin);
    e->frame.draw.footprint = r->frame.draw.footprint;
    return GBT_OK;
}

/* e->cloud, from the networks. */
static gbt_status bake_run(exporting *e, int sh_degree, gbt_error *err)
{
    loaded_run *r = &e->run;
    gbt_camera *cameras = NULL;
    size_t count;
    GBT_TRY(training_cameras(r, &cameras, &count, err));
    bake_def bake = bake_def_default();
    bake.sh_degree = sh_degree;
    bake_result result = {0};
    double clock = clock_wall();
    gbt_status status = bake_cloud(&r->frame, &r->model.anchors, &r->model.decoder, cameras, count, &r->settings, &bake, &result, err);
    e->cloud = result.cloud, e->unseen = result.unseen;
    e->bake_seconds = clock_wall() - clock;
    clock = clock_wall();
    refine_def refine = refine_def_default();
    refine.steps = e->def->refine_steps;
    if (status == GBT_OK)
        status = refine_cloud(&r->frame, &r->model.anchors, &r->model.decoder, cameras, count, &r->settings, &refine, &e->cloud, err);
    e->refine_seconds = clock_wall() - clock;
    mem_free(cameras);
    return status;
}

/* ---- what is lost ----------------------------------------------------------------------------------------------------------------------- */

static gbt_status compare_view(exporting *e, const gaussian_cloud *cloud, size_t view, loss_of_view *sum, double *model_to_photo, gbt_error *err)
{
    loaded_run *r = &e->run;
    const gbt_camera camera = photos_camera(&r->photos, view, 0);
    GBT_TRY(loaded_run_render(r, view, err));
    GBT_TRY(frame_render(&e->frame, frame_plain(cloud), &camera, &r->settings, false, err));
    image photo = {0};
    GBT_TRY(scene_read_photo(&r->scene.views[view], camera.width, camera.height, &photo, err));
    image_quantize(&photo);
    image_quantize(&r->frame.rgb);
    image_quantize(&e->frame.rgb);
    sum->to_model += metric_psnr(&e->frame.rgb, &r->frame.rgb) / (double)e->view_count;
    sum->to_photo += metric_psnr(&e->frame.rgb, &photo) / (double)e->view_count;
    *model_to_photo += metric_psnr(&r->frame.rgb, &photo) / (double)e->view_count;
    image_free(&photo);
    return GBT_OK;
}

static gbt_status compare(exporting *e, const gaussian_cloud *cloud, loss_of_view *out, gbt_error *err)
{
    *out = (loss_of_view){0};
    e->model_to_photo = 0;
    for (size_t i = 0; i < e->view_count; i++)
        GBT_TRY(compare_view(e, cloud, e->views[i], out, &e->model_to_photo, err));
    return GBT_OK;
}

/* What the file gives back, in the model's coordinates; the cloud itself where we cannot read the format, which has only floats then. */
static gbt_status compare_file(exporting *e, const char *path, loss_of_view *out, gbt_error *err)
{
    if (!gaussian_file_readable(path))
        return compare(e, &e->cloud, out, err);
    gaussian_cloud back;
    GBT_TRY(gaussian_file_read(path, &back, err));
    for (size_t i = 0; i < 3 * back.count; i++)
        back.mean[i] = (float)((double)back.mean[i] - e->origin[i % 3]);
    const gbt_status status = compare(e, &back, out, err);
    gaussian_cloud_free(&back);
    return status;
}

/* ---- entry -------------------------------------------------------------------------------------------------------------------------------- */

static gbt_status check(const char *input, const gbt_export_def *def, const char *const *outputs, size_t output_count, gbt_error *err)
{
    if (def->sh_degree < 0 || def->sh_degree > 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "--sh-degree: %d (wanted 0 to 3)", def->sh_degree);
    if (def->refine_steps < 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--refine: %d (wanted 0 or more)", def->refine_steps);
    if (output_count < 1 || output_count > OUTPUTS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %zu files to write (wanted 1 to %d)", input, output_count, (int)OUTPUTS_MAX);
    for (size_t i = 0; i < output_count; i++)
        GBT_TRY(gaussian_file_check_writable(outputs[i], err));
    return GBT_OK;
}

static void say_source(const exporting *e, const char *input, FILE *report)
{
    fprintf(report, "%s: %zu Gaussians, colours of degree %d", input, e->cloud.count, e->cloud.sh_degree);
    if (e->baked)
        fprintf(report, "; %zu that no training camera sees are left out; baked in %.1f s, refined in %.1f s", e->unseen, e->bake_seconds, e->refine_seconds);
    else if (e->cloud.dropped > 0)
        fprintf(report, "; %zu unusable rows dropped", e->cloud.dropped);
    fprintf(report, "\n");
}

static gbt_status write_file(exporting *e, const char *path, FILE *report, json_t *files, gbt_error *err)
{
    GBT_TRY(gaussian_file_write(path, &e->cloud, e->origin, err));
    struct stat info = {0};
    stat(path, &info);
    loss_of_view loss = {NAN, NAN};
    if (e->baked && e->view_count > 0)
        GBT_TRY(compare_file(e, path, &loss, err));
    json_t *row = json_pack("{s:s,s:I,s:i}", "file", path, "bytes", (json_int_t)info.st_size, "sh_degree", e->cloud.sh_degree);
    if (isfinite(loss.to_model)) {
        json_object_set_new(row, "psnr_to_model", json_real(loss.to_model));
        json_object_set_new(row, "psnr_to_photos", json_real(loss.to_photo));
        json_object_set_new(row, "model_psnr_to_photos", json_real(e->model_to_photo));
    }
    json_array_append_new(files, row);
    if (report == NULL)
        return GBT_OK;
    fprintf(report, "%s: %.2f MB", path, (double)info.st_size / 1e6);
    if (isfinite(loss.to_model)) {
        fprintf(report, "; %zu %s views: %.2f dB to the model", e->view_count, e->held_out ? "held-out" : "training", loss.to_model);
        if (!e->run.def.exposure)
            fprintf(report, ", %.2f dB to the photos (the model: %.2f)", loss.to_photo, e->model_to_photo);
    }
    fprintf(report, "\n");
    return GBT_OK;
}

/* All files whose format keeps colours of this degree, or only `flat` ones. Where a format keeps one colour, that colour is fitted: the first term of a
   longer series is not the best constant. */
static gbt_status write_kind(exporting *e, const char *input, bool flat, const char *const *outputs, size_t output_count, FILE *report, json_t *files,
                             gbt_error *err)
{
    bool any = false;
    for (size_t i = 0; i < output_count; i++)
        any = any || (gaussian_file_degree(outputs[i]) == 0) == flat;
    if (!any)
        return GBT_OK;
    const int degree = flat ? 0 : e->def->sh_degree;
    gaussian_cloud_free(&e->cloud);
    GBT_TRY(e->baked ? bake_run(e, degree, err) : gaussian_file_read(input, &e->cloud, err));
    if (e->cloud.sh_degree > degree)
        e->cloud.sh_degree = degree;
    if (report != NULL)
        say_source(e, input, report);
    for (size_t i = 0; i < output_count; i++)
        if ((gaussian_file_degree(outputs[i]) == 0) == flat)
            GBT_TRY(write_file(e, outputs[i], report, files, err));
    return GBT_OK;
}

gbt_status gbt_export(const char *input, const gbt_export_def *def, const char *const *outputs, size_t output_count, FILE *report, gbt_error *err)
{
    GBT_TRY(check(input, def, outputs, output_count, err));
    exporting *e = mem_calloc(1, sizeof *e, "export", err);
    if (e == NULL)
        return GBT_ERR_NO_MEMORY;
    e->def = def;
    e->baked = !gaussian_file_readable(input);
    gbt_status status = e->baked ? open_run(e, input, err) : GBT_OK;
    json_t *files = json_array();
    for (int flat = 0; flat < 2 && status == GBT_OK; flat++)
        status = write_kind(e, input, flat, outputs, output_count, report, files, err);
    if (status == GBT_OK && def->json != NULL)
        status = json_save(json_pack("{s:i,s:s,s:I,s:I,s:O}", "schema", 1, "input", input, "gaussians", (json_int_t)e->cloud.count, "unseen",
                                         (json_int_t)e->unseen, "files", files),
                               def->json, err);
    json_decref(files);
    gaussian_cloud_free(&e->cloud);
    frame_free(&e->frame);
    loaded_run_close(&e->run);
    mem_free(e);
    return status;
}
