/* eval/bench_trace.c -- time build, forward and adjoint on given Gaussians, with the error against the double reference beside it. */
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "data/gaussian_ply.h"
#include "eval/camera_file.h"
#include "eval/json_out.h"
#include "eval/loaded_run.h"
#include "gbtrace/bench.h"
#include "trace/reference.h"

enum { CHECK_STRIDE = 8 };

gbt_bench_def gbt_bench_def_default(void)
{
    return (gbt_bench_def){.repeats = 5};
}

/* ---- what is traced ---------------------------------------------------------------------------------------------------------------------- */

/* Colour of a 3DGS Gaussian from its centre's direction: degree 0 only, so that the workload is tracing and nothing else. */
static gbt_status gaussians_from_ply(const char *path, gaussians *out, gbt_error *err)
{
    gaussian_cloud cloud;
    GBT_TRY(gaussian_ply_load(path, &cloud, err));
    const gbt_status status = gaussians_resize(out, cloud.count, err);
    for (size_t i = 0; status == GBT_OK && i < cloud.count; i++) {
        out->mean_x[i] = cloud.mean[3 * i], out->mean_y[i] = cloud.mean[3 * i + 1], out->mean_z[i] = cloud.mean[3 * i + 2];
        out->scale_x[i] = expf(cloud.scale_log[3 * i]), out->scale_y[i] = expf(cloud.scale_log[3 * i + 1]), out->scale_z[i] = expf(cloud.scale_log[3 * i + 2]);
        out->quat_w[i] = cloud.quat[4 * i], out->quat_x[i] = cloud.quat[4 * i + 1], out->quat_y[i] = cloud.quat[4 * i + 2], out->quat_z[i] = cloud.quat[4 * i + 3];
        out->opacity[i] = cloud.opacity[i];
        const float *sh = cloud.sh + i * GAUSSIAN_SH_COUNT * 3;
        out->red[i] = fmaxf(0, 0.5f + 0.28209479f * sh[0]), out->green[i] = fmaxf(0, 0.5f + 0.28209479f * sh[1]), out->blue[i] = fmaxf(0, 0.5f + 0.28209479f * sh[2]);
    }
    if (status == GBT_OK)
        gaussians_pad(out);
    gaussian_cloud_free(&cloud);
    return status;
}

/* What the caller has given in place of the model's own. */
static gbt_status override_setting(const char *name, float given, float *setting, gbt_error *err)
{
    if (isnan(given) || given == 0)
        return GBT_OK;
    if (!(given > 0 && given < 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "bench: bad %s (wanted a number in (0, 1), got %g)", name, (double)given);
    *setting = given;
    return GBT_OK;
}

static gbt_status override_settings(const gbt_bench_def *def, trace_settings *settings, gbt_error *err)
{
    GBT_TRY(override_setting("alpha_min", def->alpha_min, &settings->alpha_min, err));
    GBT_TRY(override_setting("alpha_max", def->alpha_max, &settings->alpha_max, err));
    return override_setting("t_min", def->t_min, &settings->transmittance_min, err);
}

/* ---- figures -------------------------------------------------------------------------------------------------------------------------------- */

typedef struct figures {
    double build_ms, forward_seconds, adjoint_seconds, forward_us, adjoint_us; /* medians; us: core-microseconds per ray */
    kernel_counters counters;
    double psnr, max_error; /* NaN when not checked */
    size_t check_rays;
} figures;

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, by_value);
    return values[count / 2];
}

static gbt_status time_passes(trace_scene *traced, const gaussians *g, const trace_settings *settings, const ray_image *rays, int repeats, image *rgb,
                              figures *out, gbt_error *err)
{
    const double ray_count = (double)rays->width * (double)rays->height;
    gaussians d_gaussians = {0};
    image d_rgb = {0};
    double *samples = mem_alloc((size_t)repeats, 5 * sizeof *samples, "timings", err);
    gbt_status status = samples == NULL ? GBT_ERR_NO_MEMORY : image_alloc(&d_rgb, rays->width, rays->height, 3, err);
    for (size_t i = 0; status == GBT_OK && i < 3 * (size_t)rays->width * (size_t)rays->height; i++)
        d_rgb.pixels[i] = 1 / (float)ray_count;
    const float reach = ray_image_reach(rays);
    for (int i = -1; i < repeats && status == GBT_OK; i++) { /* the first pass warms caches and memory up */
        const double t0 = clock_wall();
        status = trace_build(traced, g, settings, reach, err);
        const double t1 = clock_wall(), c1 = clock_process();
        memset(&out->counters, 0, sizeof out->counters);
        if (status == GBT_OK)
            status = trace_forward(traced, rays, true, &(trace_outputs){.rgb = rgb}, &out->counters, err);
        const double t2 = clock_wall(), c2 = clock_process();
        if (status == GBT_OK)
            status = trace_backward(traced, rays, &d_rgb, &d_gaussians, NULL, NULL, err);
        const double t3 = clock_wall(), c3 = clock_process();
        if (i < 0)
            continue;
        samples[i] = t1 - t0, samples[repeats + i] = t2 - t1, samples[2 * repeats + i] = t3 - t2;
        samples[3 * repeats + i] = c2 - c1, samples[4 * repeats + i] = c3 - c2;
    }
    if (status == GBT_OK) {
        out->build_ms = 1000 * median(samples, repeats);
        out->forward_seconds = median(samples + repeats, repeats);
        out->adjoint_seconds = median(samples + 2 * repeats, repeats);
        out->forward_us = 1e6 * median(samples + 3 * repeats, repeats) / ray_count;
        out->adjoint_us = 1e6 * median(samples + 4 * repeats, repeats) / ray_count;
    }
    gaussians_free(&d_gaussians);
    image_free(&d_rgb);
    mem_free(samples);
    return status;
}

/* Every 8th pixel in both directions, in double. */
static gbt_status check_image(const gaussians *g, const trace_settings *settings, const ray_image *rays, const image *rgb, figures *out, gbt_error *err)
{
    ray_image few = {0};
    GBT_TRY(ray_image_reserve(&few, (rays->width + CHECK_STRIDE - 1) / CHECK_STRIDE, (rays->height + CHECK_STRIDE - 1) / CHECK_STRIDE, false, err));
    const size_t count = ray_image_count(&few);
    double *want = mem_alloc(count, 3 * sizeof *want, "check image", err);
    gbt_status status = want == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t i = 0; i < count; i++) {
        const size_t x = i % (size_t)few.width * CHECK_STRIDE, y = i / (size_t)few.width * CHECK_STRIDE, from = y * (size_t)rays->width + x;
        memcpy(few.dir + 3 * i, rays->dir + 3 * from, 3 * sizeof *few.dir);
        memcpy(few.origin + 3 * i, ray_image_origin(rays, from), 3 * sizeof *few.origin);
    }
    if (status == GBT_OK)
        status = reference_forward(g, settings, &few, want, NULL, NULL, err);
    double square = 0;
    out->max_error = 0;
    for (size_t i = 0; status == GBT_OK && i < count; i++) {
        const size_t x = i % (size_t)few.width * CHECK_STRIDE, y = i / (size_t)few.width * CHECK_STRIDE;
        for (size_t c = 0; c < 3; c++) {
            const double error = fabs((double)rgb->pixels[3 * (y * (size_t)rays->width + x) + c] - want[3 * i + c]);
            square += error * error;
            out->max_error = fmax(out->max_error, error);
        }
    }
    out->check_rays = count;
    out->psnr = square > 0 ? -10 * log10(square / (3 * (double)count)) : 200;
    ray_image_free(&few);
    mem_free(want);
    return status;
}

static gbt_status print_figures(const gbt_bench_def *def, const figures *f, const gaussians *g, const trace_scene *traced, const ray_image *rays, FILE *out,
                                gbt_error *err)
{
    const double n = (double)rays->width * (double)rays->height;
    fprintf(out, "%s: %zu Gaussians (%zu in the tree, %zu nodes, %zu leaves, %.1f MB), %d x %d rays, %d threads, %s\n", def->model, g->count, traced->tree.box_count,
            traced->tree.node_count, traced->tree.leaf_count, (double)(traced->tree.bytes + g->count * RECORD_FLOATS * sizeof(float)) * 1e-6, rays->width, rays->height, parallel_threads(),
            cpu_isa_name(cpu_best_isa()));
    fprintf(out, "build   %8.2f ms\nforward %8.2f ms  %6.3f core-us/ray\nadjoint %8.2f ms  %6.3f core-us/ray\n", f->build_ms, 1000 * f->forward_seconds,
            f->forward_us, 1000 * f->adjoint_seconds, f->adjoint_us);
    const kernel_counters *c = &f->counters;
    const double packets = (double)c->rays / PACKET_LANES;
    fprintf(out, "per ray: %.2f hits, %.2f blended, %.1f tests, %.2f nodes; per packet: %.1f rows, %.1f pairs of rows, %.1f candidates; %llu packets spilled\n",
            (double)c->hits / n, (double)c->blended / n, (double)c->tests / n, (double)c->nodes / n, (double)c->rows / packets, (double)c->pairs / packets,
            (double)c->candidates / packets, (unsigned long long)c->spilled_packets);
    if (def->check)
        fprintf(out, "to the double reference (%zu rays): PSNR %.1f dB, max error %.3g\n", f->check_rays, f->psnr, f->max_error);
    if (def->json == NULL)
        return GBT_OK;
    json_t *root = json_pack("{s:i,s:o,s:I,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:I,s:s,s:s,s:i,s:I}", "schema", 1, "model", json_text(def->model), "rays", (json_int_t)n,
                             "forward_core_us_per_ray", f->forward_us, "adjoint_core_us_per_ray", f->adjoint_us, "forward_seconds", f->forward_seconds,
                             "adjoint_seconds", f->adjoint_seconds, "build_ms", f->build_ms, "hits_per_ray", (double)f->counters.hits / n, "blended_per_ray",
                             (double)f->counters.blended / n, "tests_per_ray", (double)f->counters.tests / n, "nodes_per_ray", (double)f->counters.nodes / n,
                             "spilled_packets", (json_int_t)f->counters.spilled_packets, "kernel", "packet", "isa", cpu_isa_name(cpu_best_isa()), "threads",
                             parallel_threads(), "gaussians", (json_int_t)g->count);
    json_object_set_new(root, "alpha_min", json_real((double)traced->settings.alpha_min));
    json_object_set_new(root, "alpha_max", json_real((double)traced->settings.alpha_max));
    json_object_set_new(root, "transmittance_min", json_real((double)traced->settings.transmittance_min));
    if (def->check) {
        json_object_set_new(root, "psnr_to_reference", json_real(f->psnr));
        json_object_set_new(root, "max_error", json_real(f->max_error));
    }
    const gbt_status status = json_save(root, def->json, err);
    json_decref(root);
    return status;
}

static gbt_status bench(const gbt_bench_def *def, loaded_run *run, FILE *out, gbt_error *err)
{
    gaussians from_ply = {0};
    const gaussians *g = &from_ply;
    trace_settings settings = trace_settings_default();
    camera_file camera = {0};
    trace_scene traced = {0};
    ray_image rays = {0};
    image rgb = {0};
    figures f = {.psnr = NAN, .max_error = NAN};
    const size_t length = strlen(def->model);
    const bool is_ply = length > 4 && strcmp(def->model + length - 4, ".ply") == 0;
    gbt_status status;
    if (is_ply) {
        if (def->camera == NULL)
            return base_fail(err, GBT_ERR_ARGUMENT, "--camera: missing (a .ply has no cameras)");
        status = gaussians_from_ply(def->model, &from_ply, err);
        if (status == GBT_OK)
            status = camera_file_read(def->camera, (const double[3]){0, 0, 0}, &camera, err);
    } else if (def->camera != NULL) {
        status = loaded_run_open_model(def->model, run, err);
        if (status == GBT_OK)
            status = camera_file_read(def->camera, run->model.origin, &camera, err);
    } else {
        status = loaded_run_open(def->model, NULL, 0, run, err);
        size_t view = 0;
        while (status == GBT_OK && view + 1 < run->scene.view_count && !run->scene.views[view].is_test)
            view++;
        if (status == GBT_OK) {
            const gbt_camera taken = photos_camera(&run->photos, view, 0);
            camera.shot = ray_shot_of(&taken);
        }
    }
    if (!is_ply) {
        if (status == GBT_OK)
            status = frame_render_shot(&run->frame, &run->model.anchors, &run->model.decoder, &camera.shot, &run->settings, err);
        g = &run->frame.gaussians;
        settings = run->settings;
    }
    if (status == GBT_OK)
        status = override_settings(def, &settings, err);
    if (status == GBT_OK)
        status = ray_image_from_shot(&camera.shot, 0, &rays, err);
    if (status == GBT_OK)
        status = image_alloc(&rgb, rays.width, rays.height, 3, err);
    if (status == GBT_OK)
        status = time_passes(&traced, g, &settings, &rays, def->repeats, &rgb, &f, err);
    if (status == GBT_OK && def->check)
        status = check_image(g, &settings, &rays, &rgb, &f, err);
    if (status == GBT_OK)
        status = print_figures(def, &f, g, &traced, &rays, out, err);
    camera_file_free(&camera);
    trace_scene_free(&traced);
    ray_image_free(&rays);
    image_free(&rgb);
    gaussians_free(&from_ply);
    return status;
}

gbt_status gbt_bench_trace(const gbt_bench_def *def, FILE *out, gbt_error *err)
{
    if (def->model == NULL || def->repeats < 1 || def->repeats > 1000)
        return base_fail(err, GBT_ERR_ARGUMENT, "bench: wanted a model and 1 to 1000 repeats");
    loaded_run *run = mem_calloc(1, sizeof *run, "run", err);
    if (run == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = bench(def, run, out, err);
    loaded_run_close(run);
    mem_free(run);
    return status;
}
