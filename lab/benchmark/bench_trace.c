/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_trace.c -- gbtrace bench trace: time build, forward and adjoint of one or more kernels on
   the same Gaussians, and print their errors against the double-precision reference. */
#include <jansson.h>
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/parallel.h"
#include "benchmark/bench_passes.h"
#include "benchmark/bench_reference.h"
#include "benchmark/bench_scene.h"
#include "data/json_out.h"
#include "lab/lab.h"

enum { KERNELS_MAX = BENCH_KERNELS };

lab_bench_def lab_bench_def_default(void)
{
    return (lab_bench_def){.repeats = 5, .preset = GBT_PRESET_AS_TRAINED, .kernel = "list"};
}

/* Replace one of the model's settings by the caller's value, if there is one. */
static gbt_status override_setting(const char *name, float given, float *setting, gbt_error *err)
{
    static const float least = 1e-30f; /* below it, kernels would round responses that count to 0 */
    if (isnan(given) || given == 0)
        return GBT_OK;
    if (!(given >= least && given < 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "bench: bad %s (wanted a number in [%g, 1), got %g)", name,
                         (double)least, (double)given);
    *setting = given;
    return GBT_OK;
}

static gbt_status override_settings(const lab_bench_def *def, trace_settings *settings, gbt_error *err)
{
    GBT_TRY(loaded_run_preset(def->preset, settings, err));
    GBT_TRY(override_setting("alpha_min", def->alpha_min, &settings->alpha_min, err));
    GBT_TRY(override_setting("alpha_max", def->alpha_max, &settings->alpha_max, err));
    if (settings->alpha_max < settings->alpha_min)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "bench: bad alpha_max (wanted alpha_min, %g, or more, got %g)",
                         (double)settings->alpha_min, (double)settings->alpha_max);
    return override_setting("t_min", def->t_min, &settings->transmittance_min, err);
}

/* ---- figures: one table for the text and the JSON file ---- */

typedef struct measured {
    const lab_bench_def *def;
    const bench_scene *scene;
    int kernel[KERNELS_MAX];
    bench_way ways[KERNELS_MAX];
    bench_splat splat;
    bench_error error[KERNELS_MAX];  /* if checked: against the reference with the same cut-offs, */
    bench_error steady[KERNELS_MAX]; /* the same on rays outside of the rounding band, */
    bench_error whole[KERNELS_MAX];  /* and against the reference without cut-offs, on all rays */
    size_t count, check_rays, steady_rays;
} measured;

enum { ROW_COUNT = 25 };
typedef struct figure_row {
    const char *label, *key; /* label in the text; key in the file */
    double value;
    int decimals;
    bool is_cost; /* a cost: its ratio to the first kernel is printed */
} figure_row;

static void list_figures(const measured *m, size_t way, figure_row rows[ROW_COUNT])
{
    const bench_figures *f = &m->ways[way].figures;
    const kernel_counters *c = &f->counters;
    const double n = (double)ray_image_count(&m->scene->rays), packets = n / PACKET_LANES;
    const figure_row all[ROW_COUNT] = {
        {"build, ms", "build_ms", f->build_ms, 2, true},
        {"build, core-us/ray", "build_core_us_per_ray", f->build_us, 3, true},
        {"forward, ms", NULL, 1000 * f->forward_seconds, 2, true},
        {"forward, core-us/ray", "forward_core_us_per_ray", f->forward_us, 3, true},
        {"adjoint, ms", NULL, 1000 * f->adjoint_seconds, 2, true},
        {"adjoint, core-us/ray", "adjoint_core_us_per_ray", f->adjoint_us, 3, true},
        {"all three, core-us/ray", "core_us_per_ray", f->build_us + f->forward_us + f->adjoint_us, 3, true},
        {NULL, "forward_seconds", f->forward_seconds, 0, false},
        {NULL, "adjoint_seconds", f->adjoint_seconds, 0, false},
        {"hits per ray", "hits_per_ray", (double)c->hits / n, 2, false},
        {"blended per ray", "blended_per_ray", (double)c->blended / n, 2, false},
        {"tests per ray", "tests_per_ray", (double)c->tests / n, 1, true},
        {"nodes per ray", "nodes_per_ray", (double)c->nodes / n, 2, true},
        {"candidates per packet", "candidates_per_packet", (double)c->candidates / packets, 1, true},
        {"rows per packet", "rows_per_packet", (double)c->rows / packets, 1, true},
        {"pairs of rows per packet", "row_pairs_per_packet", (double)c->order_steps / packets, 1, true},
        {"packets spilled", "spilled_packets", (double)c->spilled_packets, 0, false},
        {"tape, MB", NULL, (double)c->tape_bytes * 1e-6, 2, true},
        {"tree, MB", NULL, (double)f->tree_bytes * 1e-6, 2, true},
        {"lists, MB", NULL, (double)f->list_bytes * 1e-6, 2, true},
        {"records, MB", NULL, (double)f->record_bytes * 1e-6, 2, true},
        {NULL, "tape_bytes", (double)c->tape_bytes, 0, false},
        {NULL, "tree_bytes", (double)f->tree_bytes, 0, false},
        {NULL, "list_bytes", (double)f->list_bytes, 0, false},
        {NULL, "record_bytes", (double)f->record_bytes, 0, false},
    };
    memcpy(rows, all, sizeof all);
}

static void print_head(const measured *m, FILE *out)
{
    const bench_scene *s = m->scene;
    fprintf(out, "%s: %zu Gaussians, %d x %d rays, %d threads, %s\n", m->def->model, s->gaussians->count,
            s->rays.width, s->rays.height, parallel_threads(), cpu_isa_name(m->ways[0].isa));
    for (size_t k = 0; k < m->count; k++)
        if (m->kernel[k] == TRACE_LIST && !m->ways[k].traced.listed)
            fputs("list: not possible for these rays; the tree is traversed instead\n", out);
    fprintf(out, "alpha_min %g, alpha_max %g, T_min %g; medians of %d\n\n", (double)s->settings.alpha_min,
            (double)s->settings.alpha_max, (double)s->settings.transmittance_min, m->def->repeats);
}

/* One column per kernel. From the second on, costs are followed by the speed-up over the first kernel. */
static void print_figures(const measured *m, FILE *out)
{
    figure_row rows[KERNELS_MAX][ROW_COUNT];
    print_head(m, out);
    fprintf(out, "%-26s", "");
    for (size_t k = 0; k < m->count; k++) {
        list_figures(m, k, rows[k]);
        fprintf(out, k == 0 ? "%10s" : "%10s         ", bench_kernel_name(m->kernel[k]));
    }
    fputs("\n", out);
    for (int r = 0; r < ROW_COUNT; r++) {
        if (rows[0][r].label == NULL)
            continue;
        fprintf(out, "%-26s", rows[0][r].label);
        for (size_t k = 0; k < m->count; k++) {
            const double first = rows[0][r].value, value = rows[k][r].value;
            fprintf(out, "%10.*f", rows[k][r].decimals, value);
            if (k > 0 && rows[k][r].is_cost && first > 0 && value > 0)
                fprintf(out, " %7.2fx", value / first);
            else if (k > 0)
                fprintf(out, " %8s", "");
        }
        fputs("\n", out);
    }
    for (size_t k = 0; m->def->check && k < m->count; k++)
        fprintf(out,
                "%s to the double reference (%zu rays): PSNR %.1f dB, max error %.3g; on the %zu rays where "
                "rounding decides nothing: PSNR %.1f dB, max error %.3g; to the one without cut-offs: "
                "PSNR %.1f dB, max error %.3g\n",
                bench_kernel_name(m->kernel[k]), m->check_rays, m->error[k].psnr, m->error[k].max,
                m->steady_rays, m->steady[k].psnr, m->steady[k].max, m->whole[k].psnr, m->whole[k].max);
}

static json_t *way_to_json(const measured *m, size_t way)
{
    figure_row rows[ROW_COUNT];
    list_figures(m, way, rows);
    json_t *out = json_pack("{s:s,s:s}", "kernel", bench_kernel_name(m->kernel[way]), "isa",
                            cpu_isa_name(m->ways[way].isa));
    if (m->kernel[way] == TRACE_LIST)
        json_object_set_new(out, "listed", json_boolean(m->ways[way].traced.listed));
    for (int r = 0; r < ROW_COUNT; r++)
        if (rows[r].key != NULL)
            json_object_set_new(out, rows[r].key, json_real(rows[r].value));
    if (m->def->check) {
        json_object_set_new(out, "psnr_to_reference", json_number(m->error[way].psnr));
        json_object_set_new(out, "max_error", json_number(m->error[way].max));
        json_object_set_new(out, "psnr_outside_rounding_band", json_number(m->steady[way].psnr));
        json_object_set_new(out, "max_error_outside_rounding_band", json_number(m->steady[way].max));
        json_object_set_new(out, "psnr_without_cuts", json_number(m->whole[way].psnr));
        json_object_set_new(out, "max_error_without_cuts", json_number(m->whole[way].max));
    }
    return out;
}

/* The first kernel's figures stand at the top level of the JSON, as in earlier versions. */
static gbt_status save_figures(const measured *m, gbt_error *err)
{
    const trace_settings *s = &m->scene->settings;
    json_t *root = json_pack("{s:i,s:o,s:I,s:I,s:i,s:f,s:f,s:f}", "schema", 3, "model",
                             json_text(m->def->model), "rays", (json_int_t)ray_image_count(&m->scene->rays),
                             "gaussians", (json_int_t)m->scene->gaussians->count, "threads",
                             parallel_threads(), "alpha_min", (double)s->alpha_min, "alpha_max",
                             (double)s->alpha_max, "transmittance_min", (double)s->transmittance_min);
    json_t *kernels = json_array();
    for (size_t k = 0; k < m->count; k++)
        json_array_append_new(kernels, way_to_json(m, k));
    json_object_update(root, json_array_get(kernels, 0));
    json_object_set_new(root, "kernels", kernels);
    const gbt_status status = json_save(root, m->def->json, err);
    json_decref(root);
    return status;
}

static void compare(const measured *m, const bench_reference *want, bench_error error[KERNELS_MAX])
{
    for (size_t k = 0; k < m->count; k++)
        error[k] = bench_reference_compare(want, &m->ways[k].rgb);
}

static gbt_status check(measured *m, const bench_scene *traced, bench_reference *want, gbt_error *err)
{
    const trace_settings without = bench_settings_without_cuts(&traced->settings);
    GBT_TRY(bench_reference_make(traced->gaussians, &without, &traced->rays, want, err));
    compare(m, want, m->whole);
    GBT_TRY(bench_reference_make(traced->gaussians, &traced->settings, &traced->rays, want, err));
    compare(m, want, m->error);
    GBT_TRY(bench_reference_leave_band(traced->gaussians, &traced->settings, want, err));
    compare(m, want, m->steady);
    m->check_rays = ray_image_count(&want->rays);
    for (size_t i = 0; i < m->check_rays; i++)
        m->steady_rays += !want->left_out[i];
    return GBT_OK;
}

static gbt_status bench(measured *m, bench_scene *traced, bench_reference *want, FILE *out, gbt_error *err)
{
    const lab_bench_def *def = m->def;
    GBT_TRY(bench_scene_open(def->model, def->camera, traced, err));
    GBT_TRY(override_settings(def, &traced->settings, err));
    GBT_TRY(bench_scene_decode(traced, err));
    for (size_t k = 0; k < m->count; k++) {
        m->ways[k].isa = cpu_best_isa();
        m->ways[k].settings = traced->settings;
        m->ways[k].settings.packet_order = m->kernel[k] == BENCH_PACKET_ORDER;
        if (m->kernel[k] == BENCH_SPLATS)
            m->ways[k].splat = &m->splat;
        else
            m->ways[k].kernel = m->kernel[k] == BENCH_PACKET_ORDER ? TRACE_LIST : (trace_kernel)m->kernel[k];
    }
    m->splat = (bench_splat){&traced->camera.shot.camera, &traced->run.frame.gaussians, RASTER_EWA};
    GBT_TRY(bench_measure(m->ways, m->count, traced->gaussians, &traced->rays, def->repeats, err));
    if (def->check)
        GBT_TRY(check(m, traced, want, err));
    print_figures(m, out);
    return def->json != NULL ? save_figures(m, err) : GBT_OK;
}

gbt_status lab_bench_trace(const lab_bench_def *def, FILE *out, gbt_error *err)
{
    if (def->model == NULL || def->repeats < 1 || def->repeats > 1000)
        return base_fail(err, GBT_ERR_ARGUMENT, "bench: wanted a model and 1 to 1000 repeats");
    if (def->json != NULL && (file_is_same(def->json, def->model) ||
                              (def->camera != NULL && file_is_same(def->json, def->camera))))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (`json` must be another file)",
                         def->json);
    bench_scene traced = {0};
    bench_reference want = {0};
    measured m = {.def = def, .scene = &traced};
    const char *list = def->kernel != NULL ? def->kernel : "list";
    m.count = bench_kernels_parse(list, m.kernel, KERNELS_MAX);
    if (m.count == 0)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "--kernel: \"%.60s\" (wanted list, packet, tree, single, embree or splats, or some of them "
            "with commas between)",
            list);
    const gbt_status status = bench(&m, &traced, &want, out, err);
    for (size_t k = 0; k < m.count; k++)
        bench_way_free(&m.ways[k]);
    bench_reference_free(&want);
    bench_scene_close(&traced);
    return status;
}
