/* SPDX-License-Identifier: Apache-2.0 */
/* study/speed.c -- the study "speed": measure the cost of each setting and its effect on the picture. */
#include "study/speed.h"

#include <math.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "benchmark/bench_scene.h"
#include "lab/lab.h"
#include "raster/raster.h"
#include "study/model.h"

/* ---- the settings to measure ---- */

/* One value of one setting (a knob); all other settings are as in the preset "default". */
typedef struct speed_step {
    speed_knob knob;
    const char *value;
    float number; /* value of the knob; 0: the default */
    int choice;   /* index of a preset, kernel or instruction set */
} speed_step;

/* For each knob from exact to fast, passing through the default. */
static const speed_step steps[] = {
    {KNOB_PRESET, "exact", 0, GBT_PRESET_EXACT},
    {KNOB_PRESET, "default", 0, GBT_PRESET_DEFAULT},
    {KNOB_PRESET, "fast", 0, GBT_PRESET_FAST},
    {KNOB_ALPHA, "1e-4", 1e-4f, 0},
    {KNOB_ALPHA, "0.001", 1e-3f, 0},
    {KNOB_ALPHA, "1/255", 0, 0},
    {KNOB_ALPHA, "0.01", 0.01f, 0},
    {KNOB_ALPHA, "0.02", 0.02f, 0},
    {KNOB_ALPHA, "0.05", 0.05f, 0},
    {KNOB_STOP, "1e-6", 1e-6f, 0},
    {KNOB_STOP, "1e-4", 0, 0},
    {KNOB_STOP, "0.001", 1e-3f, 0},
    {KNOB_STOP, "0.01", 0.01f, 0},
    {KNOB_STOP, "0.03", 0.03f, 0},
    {KNOB_KERNEL, "embree", 0, TRACE_EMBREE},
    {KNOB_KERNEL, "single", 0, TRACE_SINGLE},
    {KNOB_KERNEL, "tree", 0, TRACE_TREE},
    {KNOB_KERNEL, "list", 0, TRACE_LIST},
    {KNOB_ISA, "plain", 0, CPU_PLAIN},
    {KNOB_ISA, "neon", 0, CPU_NEON},
    {KNOB_ISA, "avx2", 0, CPU_AVX2},
    {KNOB_ISA, "avx512", 0, CPU_AVX512},
    {KNOB_RENDERER, "rays", 0, -1},
    {KNOB_RENDERER, "splats, per-ray order", 0, RASTER_PER_RAY},
    {KNOB_RENDERER, "EWA splats", 0, RASTER_EWA},
};

/* Whether splats can be drawn: only by pinholes at rest, and the compared photos need such cameras too. */
static bool takes_splats(const bench_scene *s)
{
    bool takes = raster_takes(&s->camera.shot.camera);
    for (size_t i = 0; i < s->run.scene.view_count; i++)
        takes = takes && raster_takes(&s->run.scene.views[i].camera);
    return takes;
}

static void list_rows(const trace_settings *own, bool with_splats, speed_model *out)
{
    const cpu_isa best = cpu_best_isa();
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        const speed_step *s = &steps[i];
        if (s->knob == KNOB_ISA && (s->choice > (int)best || !cpu_has_isa((cpu_isa)s->choice)))
            continue;
        if (s->knob == KNOB_RENDERER && !with_splats)
            continue;
        speed_row *row = &out->rows[out->row_count++];
        *row = (speed_row){
            .knob = s->knob, .value = s->value, .settings = *own, .kernel = TRACE_LIST, .isa = best};
        trace_settings_preset(s->knob == KNOB_PRESET ? (gbt_preset)s->choice : GBT_PRESET_DEFAULT,
                              &row->settings);
        row->is_default = s->knob != KNOB_PRESET && s->number == 0;
        switch (s->knob) {
        case KNOB_ALPHA:
            row->settings.alpha_min = row->is_default ? row->settings.alpha_min : s->number;
            break;
        case KNOB_STOP:
            row->settings.transmittance_min = row->is_default ? row->settings.transmittance_min : s->number;
            break;
        case KNOB_KERNEL:
            row->kernel = (trace_kernel)s->choice, row->is_default = row->kernel == TRACE_LIST;
            break;
        case KNOB_ISA:
            row->isa = (cpu_isa)s->choice, row->is_default = row->isa == best;
            break;
        case KNOB_RENDERER:
            row->is_default = s->choice < 0, row->splats = s->choice >= 0,
            row->form = row->splats ? (raster_form)s->choice : RASTER_EWA;
            break;
        case KNOB_PRESET:
        case KNOB_COUNT:
            break;
        }
    }
}

/* ---- one model ---- */

static void keep_figures(const bench_scene *s, const bench_way *way, const bench_reference *want,
                         speed_row *row)
{
    const double rays = (double)ray_image_count(&s->rays);
    row->photo_psnr = NAN;
    row->picture_us = way->figures.build_us + way->figures.forward_us;
    row->forward_us = way->figures.forward_us;
    row->both_us = row->forward_us + way->figures.adjoint_us;
    row->blended = (double)way->figures.counters.blended / rays;
    row->pairs = (double)way->figures.counters.order_steps / (rays / PACKET_LANES);
    row->error = bench_reference_compare(want, &way->rgb);
}

/* Measure all rows; the default only once, although every knob has a row for it. */
static gbt_status measure_rows(const bench_scene *s, const bench_reference *want, int repeats,
                               speed_model *out, gbt_error *err)
{
    const bench_splat splats[] = {
        [RASTER_EWA] = {&s->camera.shot.camera, &s->run.frame.gaussians, RASTER_EWA},
        [RASTER_PER_RAY] = {&s->camera.shot.camera, s->gaussians, RASTER_PER_RAY}};
    bench_way *ways = mem_calloc(out->row_count, sizeof *ways, "ways", err);
    if (ways == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t count = 0, place[SPEED_WAYS_MAX];
    for (size_t i = 0; i < out->row_count; i++) {
        const speed_row *row = &out->rows[i];
        place[i] = row->is_default ? 1 : count++; /* the second row is the preset "default" */
        if (!row->is_default)
            ways[place[i]] = (bench_way){.kernel = row->kernel,
                                         .isa = row->isa,
                                         .settings = row->settings,
                                         .splat = row->splats ? &splats[row->form] : NULL};
    }
    const gbt_status status = bench_measure(ways, count, s->gaussians, &s->rays, repeats, err);
    for (size_t i = 0; i < out->row_count && status == GBT_OK; i++)
        keep_figures(s, &ways[place[i]], want, &out->rows[i]);
    for (size_t i = 0; i < count; i++)
        bench_way_free(&ways[i]);
    mem_free(ways);
    return status;
}

static gbt_status measure_scene(bench_scene *s, bench_reference *want, const char *path, const char *camera,
                                int repeats, speed_model *out, gbt_error *err)
{
    GBT_TRY(bench_scene_open(path, camera, s, err));
    trace_settings whole = s->settings;
    list_rows(&whole, takes_splats(s), out);
    whole.alpha_min = 1e-6f;
    whole.transmittance_min = 1e-9f;
    s->settings = whole;
    GBT_TRY(bench_scene_decode(s, err));
    out->gaussians = s->gaussians->count;
    out->rays = ray_image_count(&s->rays);
    log_info("%s: %zu Gaussians, %zu rays: the picture in double", out->name, out->gaussians, out->rays);
    GBT_TRY(bench_reference_make(s->gaussians, &whole, &s->rays, want, err));
    out->check_rays = ray_image_count(&want->rays);
    log_info("%s: timing %zu settings", out->name, out->row_count);
    GBT_TRY(measure_rows(s, want, repeats, out, err));
    return speed_measure_photos(s, out, err);
}

static gbt_status measure_path(const char *path, const char *camera, int repeats, speed_model *out,
                               gbt_error *err)
{
    bench_scene s = {0};
    bench_reference want = {0};
    const gbt_status status = measure_scene(&s, &want, path, camera, repeats, out, err);
    bench_reference_free(&want);
    bench_scene_close(&s);
    return status;
}

/* ---- all models ---- */

lab_study_def lab_study_def_default(void) { return (lab_study_def){.repeats = 3}; }

static gbt_status measure_model(const lab_study_def *def, size_t i, speed_model *out, gbt_error *err)
{
    char camera[4096];
    const bool is_plain = bench_scene_needs_camera(def->models[i]);
    study_model_name(def->models[i], out->name, sizeof out->name);
    if (is_plain)
        GBT_TRY(study_model_camera(def->models[i], def->camera, camera, sizeof camera, err));
    return measure_path(def->models[i], is_plain ? camera : NULL, def->repeats, out, err);
}

gbt_status lab_study_speed(const lab_study_def *def, const char *folder, FILE *out, gbt_error *err)
{
    if (def->models == NULL || def->model_count < 1 || def->model_count > SPEED_MODELS_MAX ||
        def->repeats < 1 || def->repeats > 1000)
        return base_fail(err, GBT_ERR_ARGUMENT, "study: wanted 1 to %d models and 1 to 1000 repeats",
                         (int)SPEED_MODELS_MAX);
    GBT_TRY(study_models_differ(def->models, def->model_count, err));
    GBT_TRY(file_make_folder(folder, err));
    speed_study *study = mem_calloc(1, sizeof *study, "study", err);
    if (study == NULL)
        return GBT_ERR_NO_MEMORY;
    study->repeats = def->repeats;
    study->threads = parallel_threads();
    study->model_count = def->model_count;
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < def->model_count && status == GBT_OK; i++)
        status = measure_model(def, i, &study->models[i], err);
    if (status == GBT_OK)
        status = study_output_save(&speed_output, study, folder, out, err);
    mem_free(study);
    return status;
}
