/* SPDX-License-Identifier: Apache-2.0 */
/* study/crosscheck.c -- the study "crosscheck": measure how far the tracer, the rasterizer and their
   double-precision references differ, and which step from one renderer to the other causes how much. */
#include "study/crosscheck.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "benchmark/bench_scene.h"
#include "lab/lab.h"
#include "raster/raster.h"
#include "reference/raster_ref.h"
#include "study/model.h"
#include "trace/rounding_band.h"
#include "trace/trace.h"

enum { REFERENCE_STEP = 8 }; /* as in bench_reference: every 8th pixel in both directions */

/* ---- pictures ---- */

static raster_settings settings_of_step(const trace_settings *s, cross_step step)
{
    raster_settings r = frame_splat_settings(s, step < CROSS_PROJECTION ? RASTER_PER_RAY : RASTER_EWA);
    r.order_by_center = step >= CROSS_ORDER;
    r.dilation = step < CROSS_DILATION ? 0 : r.dilation;
    r.exact_cut = step < CROSS_CUTS;
    r.near = step < CROSS_CUTS ? r.near : raster_settings_default().near;
    return r;
}

/* The Gaussians to draw at a step. Once splats are dilated, the run's footprint is taken off, since dilation
   has the same purpose. */
static const gaussians *gaussians_of_step(const bench_scene *s, cross_step step)
{
    return step >= CROSS_DILATION ? &s->run.frame.gaussians : s->gaussians;
}

static gbt_status trace_picture(const bench_scene *s, const trace_settings *settings, image *out,
                                gbt_error *err)
{
    trace_scene traced = {0};
    gbt_status status = trace_build(&traced, s->gaussians, settings, ray_image_reach(&s->rays), err);
    if (status == GBT_OK)
        status = trace_forward(&traced, &s->rays, false, &(trace_outputs){.rgb = out}, NULL, err);
    trace_scene_free(&traced);
    return status;
}

static gbt_status splat_picture(const bench_scene *s, const trace_settings *settings, cross_step step,
                                image *out, gbt_error *err)
{
    raster_scene drawn = {0};
    const raster_settings r = settings_of_step(settings, step);
    const gbt_status status = raster_forward(&drawn, gaussians_of_step(s, step), &s->camera.shot.camera, &r,
                                             false, out, NULL, NULL, err);
    raster_scene_free(&drawn);
    return status;
}

static bench_error compare(const image *a, const image *b)
{
    const size_t count = 3 * (size_t)a->width * (size_t)a->height;
    double sum = 0, max = 0;
    for (size_t i = 0; i < count; i++) {
        const double off = fabs((double)a->pixels[i] - (double)b->pixels[i]);
        sum += off * off;
        max = larger_or_nan(max, off);
    }
    return bench_error_of(sum, max, count);
}

/* Compare the per-ray form with the tracer, both in float32. Pixels that differ by more than 1e-5 are
   examined in double: in the rounding band either may be right, so these are left out. `kept` is the share of
   the remaining pixels. */
static gbt_status compare_outside_band(const bench_scene *s, const trace_settings *settings,
                                       const image *traced, const image *splatted, double *psnr, double *kept,
                                       gbt_error *err)
{
    const size_t pixels = ray_image_count(&s->rays);
    size_t left_out = 0;
    double sum = 0;
    reference_scene exact = {0};
    bool *in_band = mem_alloc(pixels, sizeof *in_band, "rounding band", err);
    gbt_status status = in_band == NULL ? GBT_ERR_NO_MEMORY : reference_scene_make(s->gaussians, &exact, err);
    for (size_t i = 0; i < pixels && status == GBT_OK; i++) {
        double max = 0;
        for (size_t k = 3 * i; k < 3 * i + 3; k++)
            max = larger_or_nan(max, fabs((double)traced->pixels[k] - (double)splatted->pixels[k]));
        in_band[i] = !(max <= 1e-5);
    }
    if (status == GBT_OK)
        status = rounding_band_find(&exact, settings, &s->rays, in_band, err);
    for (size_t i = 0; i < pixels && status == GBT_OK; i++) {
        left_out += in_band[i];
        for (size_t k = 3 * i; k < 3 * i + 3 && !in_band[i]; k++) {
            const double off = (double)traced->pixels[k] - (double)splatted->pixels[k];
            sum += off * off;
        }
    }
    mem_free(in_band);
    reference_scene_free(&exact);
    *psnr = bench_error_of(sum, 0, 3 * (pixels - left_out)).psnr;
    *kept = (double)(pixels - left_out) / (double)pixels;
    return status;
}

/* ---- references ---- */

typedef struct references {
    bench_reference rays, splats; /* splats uses the rays of the former, only for their number */
} references;

/* The double-precision pictures of the rays, and of the splats at `step`, which uses EWA projection. */
static gbt_status make_references(const bench_scene *s, const trace_settings *settings, cross_step step,
                                  references *out, gbt_error *err)
{
    const raster_settings r = settings_of_step(settings, step);
    const gbt_camera *camera = &s->camera.shot.camera;
    raster_reference exact = {0};
    GBT_TRY(bench_reference_make(s->gaussians, settings, &s->rays, &out->rays, err));
    out->splats.rays = out->rays.rays;
    out->splats.rgb = mem_alloc(raster_reference_pixels(camera, REFERENCE_STEP), 3 * sizeof *out->splats.rgb,
                                "splats in double", err);
    gbt_status status = out->splats.rgb == NULL
                            ? GBT_ERR_NO_MEMORY
                            : raster_reference_make(gaussians_of_step(s, step), &exact, err);
    if (status == GBT_OK)
        status = raster_reference_forward(&exact, camera, &r, REFERENCE_STEP, out->splats.rgb, err);
    mem_free(exact.fields);
    return status;
}

static void references_free(references *r)
{
    mem_free(r->splats.rgb);
    bench_reference_free(&r->rays);
}

/* Compare the three renderers with double precision, each with the model's own cut-offs. */
static gbt_status compare_own(const bench_scene *s, const image *traced, const image pictures[CROSS_STEPS],
                              cross_view *out, gbt_error *err)
{
    references want = {0};
    const gbt_status status = make_references(s, &s->settings, CROSS_CUTS, &want, err);
    if (status == GBT_OK) {
        out->traced = bench_reference_compare(&want.rays, traced);
        out->per_ray = bench_reference_compare(&want.rays, &pictures[CROSS_TILES]);
        out->splat = bench_reference_compare(&want.splats, &pictures[CROSS_CUTS]);
    }
    references_free(&want);
    return status;
}

/* The same with the cut-offs of the preset "exact", so low that a response that rounds to the other side of a
   cut-off is invisible. */
static gbt_status compare_exact(const bench_scene *s, image scratch[3], cross_view *out, gbt_error *err)
{
    references want = {0};
    trace_settings settings = s->settings;
    trace_settings_preset(GBT_PRESET_EXACT, &settings);
    gbt_status status = make_references(s, &settings, CROSS_DILATION, &want, err);
    if (status == GBT_OK)
        status = bench_reference_leave_band(s->gaussians, &settings, &want.rays, err);
    if (status == GBT_OK)
        status = trace_picture(s, &settings, &scratch[0], err);
    if (status == GBT_OK)
        status = splat_picture(s, &settings, CROSS_TILES, &scratch[1], err);
    if (status == GBT_OK)
        status = splat_picture(s, &settings, CROSS_DILATION, &scratch[2], err);
    double psnr = 0, kept = 0;
    if (status == GBT_OK)
        status = compare_outside_band(s, &settings, &scratch[0], &scratch[1], &psnr, &kept, err);
    if (status == GBT_OK) {
        cross_check *c = out->checks + 2; /* splats a thousand pixels long lose digits in float32, hence the
                                             last of these limits */
        c[0] = (cross_check){"preset exact: per-ray form to tracer outside the rounding band, dB", 100, psnr};
        c[1] = (cross_check){"preset exact: share of pixels outside that band", 0.999, kept};
        c[2] = (cross_check){"preset exact: tracer to double reference outside that band, dB", 100,
                             bench_reference_compare(&want.rays, &scratch[0]).psnr};
        c[3] = (cross_check){"preset exact: per-ray form to double reference outside that band, dB", 100,
                             bench_reference_compare(&want.rays, &scratch[1]).psnr};
        c[4] = (cross_check){"preset exact: EWA form, not cut at 3 std-devs, to its double reference, dB", 90,
                             bench_reference_compare(&want.splats, &scratch[2]).psnr};
    }
    references_free(&want);
    return status;
}

/* ---- one view ---- */

static void name_sheet(const char *of, cross_view *v)
{
    char name[CROSS_NAME_SIZE];
    snprintf(name, sizeof name, "crosscheck_%.120s_%.120s.png", of, v->name);
    study_model_letters(name);
    memcpy(v->sheet, name, sizeof name);
}

/* Measure one view; `pictures` and `traced` have the size of the camera. */
static gbt_status measure_pictures(const bench_scene *s, const char *folder, image *traced,
                                   image pictures[CROSS_STEPS], image scratch[3], cross_view *out,
                                   gbt_error *err)
{
    char path[4096];
    double psnr, kept;
    GBT_TRY(trace_picture(s, &s->settings, traced, err));
    for (cross_step step = 0; step < CROSS_STEPS; step++) {
        GBT_TRY(splat_picture(s, &s->settings, step, &pictures[step], err));
        out->step[step] = compare(&pictures[step], step == 0 ? traced : &pictures[step - 1]);
        out->total[step] = compare(&pictures[step], traced);
    }
    GBT_TRY(compare_outside_band(s, &s->settings, traced, &pictures[CROSS_TILES], &psnr, &kept, err));
    out->checks[0] =
        (cross_check){"own cut-offs: per-ray form to tracer outside the rounding band, dB", 100, psnr};
    out->checks[1] = (cross_check){"own cut-offs: share of pixels outside that band", 0.999, kept};
    GBT_TRY(compare_own(s, traced, pictures, out, err));
    GBT_TRY(compare_exact(s, scratch, out, err));
    GBT_TRY(file_join(path, sizeof path, folder, out->sheet, err));
    return cross_write_sheet(traced, pictures, path, err);
}

static gbt_status measure_view(bench_scene *s, const char *folder, cross_view *out, gbt_error *err)
{
    image images[1 + CROSS_STEPS + 3] = {0};
    gbt_status status = bench_scene_decode(s, err);
    out->width = s->rays.width;
    out->height = s->rays.height;
    for (size_t i = 0; i < sizeof images / sizeof *images && status == GBT_OK; i++)
        status = image_alloc(&images[i], out->width, out->height, 3, err);
    if (status == GBT_OK) {
        out->gaussians = s->gaussians->count;
        log_info("%s: %zu Gaussians, %d x %d pixels", out->name, out->gaussians, out->width, out->height);
        status = measure_pictures(s, folder, &images[0], images + 1, images + 1 + CROSS_STEPS, out, err);
    }
    for (size_t i = 0; i < sizeof images / sizeof *images; i++)
        image_free(&images[i]);
    return status;
}

/* Replace the shot by a pinhole of the same pose, size and field of view, without aperture and rolling
   shutter. False if it already is one. */
static bool make_pinhole(ray_shot *shot)
{
    gbt_camera from = shot->camera;
    from.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
    const bool changed = from.model != GBT_CAMERA_SIMPLE_PINHOLE && from.model != GBT_CAMERA_PINHOLE;
    double half[2];
    *shot = ray_shot_of(&from);
    if (!changed)
        return false;
    gbt_camera_half_fov_tan(&from, half);
    shot->camera.model = GBT_CAMERA_PINHOLE;
    memset(shot->camera.params, 0, sizeof shot->camera.params);
    for (int k = 0; k < 2; k++) {
        const double side = k == 0 ? from.width : from.height;
        shot->camera.params[k] = 0.5 * side / half[k];
        shot->camera.params[2 + k] = 0.5 * side;
    }
    return true;
}

/* ---- one model ---- */

static gbt_status measure_shot(bench_scene *s, const ray_shot *shot, const char *view, const char *folder,
                               cross_model *out, gbt_error *err)
{
    cross_view *v = &out->views[out->view_count++];
    s->camera.shot = *shot;
    v->stand_in = make_pinhole(&s->camera.shot);
    snprintf(v->name, sizeof v->name, "%s", view);
    name_sheet(out->name, v);
    return measure_view(s, folder, v, err);
}

/* Measure held-out views, evenly sampled; all views if none is held out. */
static gbt_status measure_run(bench_scene *s, const char *folder, cross_model *out, gbt_error *err)
{
    const loaded_run *run = &s->run;
    size_t held_out = 0, seen = 0;
    for (size_t i = 0; i < run->scene.view_count; i++)
        held_out += run->scene.views[i].is_test;
    const size_t all = held_out > 0 ? held_out : run->scene.view_count,
                 wanted = all < CROSS_VIEWS_MAX ? all : CROSS_VIEWS_MAX;
    for (size_t i = 0; i < run->scene.view_count && out->view_count < wanted; i++) {
        char name[FILE_NAME_SIZE];
        if (held_out > 0 && !run->scene.views[i].is_test)
            continue;
        if (seen++ * wanted / all < out->view_count)
            continue;
        const gbt_camera camera = photos_camera(&run->photos, i, 0);
        const ray_shot shot = ray_shot_of(&camera);
        loaded_run_view_name(run, i, name);
        GBT_TRY(measure_shot(s, &shot, name, folder, out, err));
    }
    return GBT_OK;
}

static gbt_status measure_model(const lab_study_def *def, size_t i, const char *folder, cross_model *out,
                                gbt_error *err)
{
    char camera[4096];
    bench_scene s = {0};
    const bool is_plain = bench_scene_needs_camera(def->models[i]);
    study_model_name(def->models[i], out->name, sizeof out->name);
    if (is_plain)
        GBT_TRY(study_model_camera(def->models[i], def->camera, camera, sizeof camera, err));
    gbt_status status = bench_scene_open(def->models[i], is_plain ? camera : NULL, &s, err);
    if (status == GBT_OK && is_plain && s.camera.shot.given != NULL)
        status = base_fail(err, GBT_ERR_ARGUMENT, "%.200s: given rays have no projection (wanted a camera)",
                           camera);
    if (status == GBT_OK && is_plain) {
        const ray_shot shot = s.camera.shot;
        status = measure_shot(&s, &shot, "camera", folder, out, err);
    } else if (status == GBT_OK)
        status = measure_run(&s, folder, out, err);
    bench_scene_close(&s);
    return status;
}

gbt_status lab_study_crosscheck(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err)
{
    if (def->models == NULL || def->model_count < 1 || def->model_count > CROSS_MODELS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "study: wanted 1 to %d models", (int)CROSS_MODELS_MAX);
    GBT_TRY(study_models_differ(def->models, def->model_count, err));
    GBT_TRY(file_make_folder(folder, err));
    cross_study *study = mem_calloc(1, sizeof *study, "study", err);
    if (study == NULL)
        return GBT_ERR_NO_MEMORY;
    study->model_count = def->model_count;
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < def->model_count && status == GBT_OK; i++)
        status = measure_model(def, i, folder, &study->models[i], err);
    if (status == GBT_OK)
        status = study_output_save(&cross_output, study, folder, out, err);
    mem_free(study);
    return status;
}
