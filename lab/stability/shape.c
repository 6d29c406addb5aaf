/* SPDX-License-Identifier: Apache-2.0 */
/* stability/shape.c -- cases of the study "stability" about shape and place: needles (A2), a camera inside a
   Gaussian (A3), a scene far from the origin (A5). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/cpu.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "data/bytes.h"
#include "data/scene.h"
#include "stability/draw.h"
#include "stability/gradient.h"
#include "stability/model.h"

/* Alpha of the only Gaussian, by the tracer and by the rasterizer. */
static double alpha_at(const stability *s, const drawing *d, size_t pixel)
{
    return s->status == GBT_OK ? 1 - (double)d->transmittance[pixel] : 0;
}

/* ---- A2: needles and pancakes ---- */

enum { NEEDLE_SIZE = 17, NEEDLE_MIDDLE = NEEDLE_SIZE * NEEDLE_SIZE / 2, NEEDLES_MAX = 1024 };

typedef struct needles {
    drawing ours, theirs;
    gaussians g;
    ray_image rays;
    float error[NEEDLES_MAX], raster_error[NEEDLES_MAX];
    size_t bad; /* not finite, or outside [0, opacity] */
} needles;

/* Place needle `i`, and return a random point of its one-sigma ellipsoid in `through`, for a ray to go
   through. */
static void place_needle(needles *n, size_t i, const double scale[3], double opacity, double through[3])
{
    static const double white[3] = {1, 1, 1};
    double mean[3], quat[4], local[3], turn[9];
    draw_random_turn(2, 0, i, quat);
    draw_random_direction(2, 4, i, local);
    dquat_to_matrix(quat, turn);
    for (uint64_t k = 0; k < 3; k++) {
        mean[k] = 2 * rng_normal(2, 10 + k, i) + (k == 2 ? 6 : 0);
        local[k] *= scale[k];
    }
    draw_set(&n->g, 0, mean, scale, quat, opacity, white);
    dmat_apply(turn, local, through);
    for (int k = 0; k < 3; k++)
        through[k] += mean[k];
}

static void measure_needle(stability *s, needles *n, size_t i, double opacity, const double through[3])
{
    static const double here[3] = {0, 0, 0}, up[3] = {0.6, -0.8, 0};
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    gbt_camera camera = draw_pinhole(NEEDLE_SIZE, NEEDLE_SIZE, 500, here);
    double T = 1;
    draw_ray(&n->rays, 0, here, through);
    double *rgb = draw_exact(s, &n->g, &settings, &n->rays, &T);
    mem_free(rgb);
    draw_traced(s, &n->ours, &n->g, &settings, &n->rays);
    const double alpha = alpha_at(s, &n->ours, 0);
    n->bad += !(alpha >= 0 && alpha <= opacity + 1e-6) || draw_count_bad(n->ours.rgb.pixels, 3) > 0;
    n->error[i] = isfinite(alpha) ? (float)fabs(alpha - (1 - T)) : 1;
    if (gbt_camera_look_at(here, through, up, &camera))
        draw_splatted(s, &n->theirs, &n->g, &splat, &camera);
    n->raster_error[i] = (float)fabs(alpha_at(s, &n->theirs, NEEDLE_MIDDLE) - (1 - T));
}

static double percentile_95(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare_floats);
    return (double)values[count * 95 / 100 < count ? count * 95 / 100 : count - 1];
}

/* Errors of alpha for `count` needles (or pancakes) of ratio r; for r = infinity the thin axes are 0. */
static void measure_ratio(stability *s, needles *n, bool pancake, double r, size_t count, double error[2])
{
    const double opacity = (double)(float)stability_number(s, "opacity");
    const double thin = 1 / r, scale[3] = {1, pancake ? 1 : thin, thin};
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        double through[3];
        place_needle(n, i, scale, opacity, through);
        measure_needle(s, n, i, opacity, through);
    }
    error[0] = percentile_95(n->error, count);
    error[1] = percentile_95(n->raster_error, count);
}

/* Load a file of needles: the largest ratio that the reader leaves. */
static void load_needles(stability *s, double r)
{
    enum { ROWS = 200 };
    static float rows[ROWS][MODEL_COLUMNS];
    gaussian_cloud cloud = {0};
    double largest = 0;
    for (size_t i = 0; i < ROWS; i++) {
        const float row[MODEL_COLUMNS] = {(float)i,        0, 0, 0.1f, 0.2f, 0.3f, 1, 0, -logf((float)r),
                                          -logf((float)r), 1, 0, 0,    0};
        memcpy(rows[i], row, sizeof row);
    }
    stability_ok(s, stability_read_model(s, rows, ROWS, &cloud));
    for (size_t i = 0; i < cloud.count; i++)
        largest = fmax(largest, exp((double)cloud.scale_log[3 * i] - (double)cloud.scale_log[3 * i + 1]));
    stability_check(s, "A2d", largest, NAN, "%zu of %d rows of ratio %g clamped, and counted.",
                    cloud.scales_clamped, ROWS, r);
    gaussian_cloud_free(&cloud);
}

/* Many needles of the largest ratio in one tree, where a SAH builder could lose some. */
static void build_needles(stability *s, double r)
{
    const trace_settings settings = trace_settings_default();
    gaussians g = {0};
    trace_scene traced = {.kernel = TRACE_TREE};
    draw_alloc(s, &g, 10000);
    for (size_t i = 0; i < g.count && s->status == GBT_OK; i++) {
        const double scale[3] = {1, 1 / r, 1 / r}, white[3] = {1, 1, 1};
        double mean[3], quat[4];
        draw_random_turn(3, 0, i, quat);
        draw_random_direction(3, 4, i, mean);
        draw_set(&g, i, mean, scale, quat, 0.9, white);
    }
    if (s->status == GBT_OK)
        stability_ok(s, trace_build(&traced, &g, &settings, 10, s->err));
    stability_check(s, "A2e", (double)(g.count - traced.tree.box_count), NAN, "%zu needles of ratio %g.",
                    g.count, r);
    trace_scene_free(&traced);
    gaussians_free(&g);
}

gbt_status stability_a2(stability *s)
{
    double ratios[16], worst[2][2] = {{0, 0}, {0, 0}};
    const size_t ratio_count = stability_list(s, "ratios", 16, ratios),
                 count = (size_t)fmin(stability_number(s, "needles"), NEEDLES_MAX);
    const double promised = stability_number(s, "promised_ratio");
    needles *n = mem_calloc(1, sizeof *n, "needles", s->err);
    if (n == NULL || count < 1)
        return n == NULL ? GBT_ERR_NO_MEMORY : GBT_ERR_FORMAT;
    draw_alloc(s, &n->g, 1);
    draw_rays(s, &n->rays, 1, 1);
    stability_chart *chart = stability_new_chart(
        s, "Needles", "Error of alpha, of 95 in 100 needles. Loaded files are clamped at a ratio of 10,000.",
        "length over thickness", "error of alpha");
    chart->log_x = chart->log_y = true;
    for (size_t i = 0; i < ratio_count && s->status == GBT_OK; i++)
        for (int pancake = 0; pancake < 2; pancake++) {
            double error[2];
            measure_ratio(s, n, pancake, ratios[i], count, error);
            for (int r = 0; r < 2; r++) {
                if (ratios[i] <= promised)
                    worst[pancake][r] = larger_or_nan(worst[pancake][r], error[r]);
                if (!pancake)
                    stability_point(chart, r, ratios[i], fmax(error[r], 1e-7));
            }
        }
    stability_check(s, "A2a", worst[0][0], worst[0][1],
                    "Ratios to %g, against double on the same float32 numbers.", promised);
    stability_check(s, "A2b", worst[1][0], worst[1][1], "%s", "");
    double unused[2];
    for (int pancake = 0; pancake < 2; pancake++)
        measure_ratio(s, n, pancake, INFINITY, count, unused);
    stability_check(s, "A2c", (double)n->bad, NAN,
                    "Ratios to %g, and an axis of length 0, which is not seen.",
                    ratio_count > 0 ? ratios[ratio_count - 1] : 0);
    drawing_free(&n->ours);
    drawing_free(&n->theirs);
    gaussians_free(&n->g);
    ray_image_free(&n->rays);
    mem_free(n);
    load_needles(s, 1e6);
    build_needles(s, 1e6);
    return s->status;
}

/* ---- A3: the camera inside a Gaussian ---- */

/* Alpha while a camera moves from z = -1 to 1, looking along z, in `count` steps. */
static void walk_through(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                         size_t count, double *alpha)
{
    ray_image rays = {0};
    const double ahead[3] = {0, 0, 1};
    draw_rays(s, &rays, 16, (int)(count / 16 + 1));
    for (size_t i = 0; s->status == GBT_OK && i < ray_image_count(&rays); i++) {
        const double origin[3] = {0, 0, fmin(2 * (double)i / (double)count - 1, 1)};
        draw_ray(&rays, i, origin, ahead);
    }
    draw_traced(s, d, g, settings, &rays);
    for (size_t i = 0; i <= count; i++)
        alpha[i] = alpha_at(s, d, i);
    ray_image_free(&rays);
}

static double largest_step(const double *values, size_t count)
{
    double most = 0;
    for (size_t i = 0; i < count; i++)
        if (!(fabs(values[i + 1] - values[i]) <= most))
            most = fabs(values[i + 1] - values[i]);
    return most;
}

/* The rasterizer on the same way, in coarser steps: largest change in one step. */
static double splat_through(stability *s, drawing *d, const gaussians *g, size_t count,
                            stability_chart *chart)
{
    enum { SIZE = 17 };
    const raster_settings splat = raster_settings_default();
    double last = 0, most = 0;
    for (size_t i = 0; i <= count && s->status == GBT_OK; i++) {
        const double origin[3] = {0, 0, 2 * (double)i / (double)count - 1};
        const gbt_camera camera = draw_pinhole(SIZE, SIZE, 20, origin);
        draw_splatted(s, d, g, &splat, &camera);
        const double alpha = alpha_at(s, d, SIZE * SIZE / 2);
        if (i > 0)
            most = larger_or_nan(most, fabs(alpha - last));
        last = alpha;
        stability_point(chart, 1, origin[2], alpha);
    }
    return most;
}

/* Poses for which alpha can be computed by hand: origin, direction, alpha. */
static double known_poses(stability *s, drawing *d, const gaussians *g, const trace_settings *settings)
{
    double poses[70], most = 0;
    const size_t count = stability_list(s, "poses", 70, poses) / 7;
    ray_image rays = {0};
    draw_rays(s, &rays, (int)count, 1);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++)
        draw_ray(&rays, i, poses + 7 * i, poses + 7 * i + 3);
    draw_traced(s, d, g, settings, &rays);
    for (size_t i = 0; i < count; i++)
        most = larger_or_nan(most, fabs(alpha_at(s, d, i) - poses[7 * i + 6]));
    ray_image_free(&rays);
    return most;
}

/* The gradient where the peak of the response is on the ray, and where it is cut off at t_near. */
static double gradient_on_both_sides(stability *s, const gaussians *g, const trace_settings *settings)
{
    gaussians d_gaussians = {0};
    ray_image rays = {0};
    double most = 0;
    draw_rays(s, &rays, 1, 1);
    for (int side = -1; side <= 1 && s->status == GBT_OK; side += 2) {
        const double origin[3] = {0.1, -0.2, 0.5 * side}, dir[3] = {0.1, 0.05, 1};
        draw_ray(&rays, 0, origin, dir);
        const gradient_error e = draw_gradient_error(s, g, settings, &rays, &d_gaussians);
        most = fmax(most, e.bad > 0 ? (double)INFINITY : e.relative);
    }
    gaussians_free(&d_gaussians);
    ray_image_free(&rays);
    return most;
}

gbt_status stability_a3(stability *s)
{
    const size_t steps = (size_t)stability_number(s, "steps"),
                 coarse = (size_t)stability_number(s, "raster_steps");
    trace_settings settings = trace_settings_default();
    settings.t_near = (float)stability_number(s, "t_near");
    const cpu_isa best = cpu_best_isa();
    gaussians g = {0};
    drawing d = {0};
    double *alpha = mem_calloc(2 * (steps + 1), sizeof *alpha, "a walk", s->err), *other = alpha + steps + 1;
    size_t isas = 1, changed = 0;
    if (alpha == NULL)
        return GBT_ERR_NO_MEMORY;
    stability_gaussians(s, &g);
    stability_chart *chart = stability_new_chart(
        s, "Through a Gaussian",
        "What covers the middle of the picture while the camera goes through a Gaussian at 0.",
        "z of the camera, std-devs", "alpha");
    walk_through(s, &d, &g, &settings, steps, alpha);
    for (size_t i = 0; i <= 200 && steps >= 200; i++)
        stability_point(chart, 0, 0.01 * (double)i - 1, alpha[i * steps / 200]);
    const double jump = splat_through(s, &d, &g, coarse, chart);
    stability_check(s, "A3a", largest_step(alpha, steps), jump,
                    "%zu steps, t_near %g (the rasterizer: %zu steps).", steps, (double)settings.t_near,
                    coarse);
    stability_check(s, "A3b", known_poses(s, &d, &g, &settings), NAN,
                    "0.9 in front and at the centre, 0.9 exp(-1/8) = 0.7942 half a std-dev behind it and on "
                    "rays across.");
    for (cpu_isa isa = CPU_PLAIN; isa < best; isa++) {
        if (!cpu_has_isa(isa))
            continue;
        isas++;
        cpu_limit_isa(isa);
        walk_through(s, &d, &g, &settings, steps, other);
        for (size_t i = 0; i <= steps; i++)
            changed += memcmp(&alpha[i], &other[i], sizeof *alpha) != 0;
    }
    cpu_limit_isa(best);
    stability_check(s, "A3c", (double)changed, NAN, "%zu instruction sets.", isas);
    stability_check(s, "A3d", gradient_on_both_sides(s, &g, &settings), NAN,
                    "Against differences in double, all fields.");
    mem_free(alpha);
    drawing_free(&d);
    gaussians_free(&g);
    return s->status;
}

/* ---- A5: far from the origin ---- */

typedef struct far_scene {
    gaussians local, moved; /* the scene near the origin; the same in float32 coordinates elsewhere */
    double *exact;          /* picture of `local`, in double */
    gbt_camera camera;      /* for `local` */
    ray_image rays;
    drawing d;
} far_scene;

static void furnish(stability *s, far_scene *f)
{
    const size_t count = (size_t)stability_number(s, "gaussians");
    const double half = stability_number(s, "half_size"), size = stability_number(s, "scale");
    draw_alloc(s, &f->local, count);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        double mean[3], scale[3], color[3], quat[4];
        draw_random_turn(5, 9, i, quat);
        for (uint64_t k = 0; k < 3; k++) {
            mean[k] = half * (2 * (double)rng_uniform(5, k, i) - 1);
            scale[k] = size * (0.5 + (double)rng_uniform(5, 3 + k, i));
            color[k] = (double)rng_uniform(5, 6 + k, i);
        }
        draw_set(&f->local, i, mean, scale, quat, 0.2 + 0.7 * (double)rng_uniform(5, 15, i), color);
    }
}

/* Write the scene's float32 means in double, moved by `offset`, load them as a data set, and put the loaded
   positions, which are relative to the loader's origin, into f->moved. */
static void load_far(stability *s, far_scene *f, double offset, double origin[3])
{
    char path[4096];
    char line[128];
    sink file = {.err = s->err};
    scene loaded = {0};
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    if (s->status != GBT_OK ||
        !stability_ok(s, file_join(path, sizeof path, s->folder, "stability_far_away.ply", s->err)))
        return;
    snprintf(line, sizeof line, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n", f->local.count);
    sink_put_text(&file, line);
    sink_put_text(&file, "property double x\nproperty double y\nproperty double z\nend_header\n");
    for (size_t i = 0; i < f->local.count; i++) {
        sink_put_f64(&file, (double)f->local.mean_x[i] + offset);
        sink_put_f64(&file, (double)f->local.mean_y[i] + offset);
        sink_put_f64(&file, (double)f->local.mean_z[i] + offset);
    }
    stability_ok(s, file.status);
    if (s->status == GBT_OK && stability_ok(s, file_write_atomic(path, file.bytes, file.size, s->err)))
        stability_ok(s, scene_load(path, &split, &loaded, s->err));
    sink_free(&file);
    remove(path);
    for (size_t i = 0; i < f->local.count && s->status == GBT_OK; i++)
        f->moved.mean_x[i] = loaded.points.position[3 * i],
        f->moved.mean_y[i] = loaded.points.position[3 * i + 1],
        f->moved.mean_z[i] = loaded.points.position[3 * i + 2];
    memcpy(origin, loaded.origin, sizeof loaded.origin);
    scene_free(&loaded);
}

/* PSNR of the moved Gaussians, seen by a camera that was moved with them. */
static double psnr_at(stability *s, far_scene *f, const double shift[3])
{
    const trace_settings settings = trace_settings_default();
    gbt_camera camera = f->camera;
    for (int k = 0; k < 3; k++)
        camera.center[k] += shift[k];
    draw_camera(s, &f->d, &f->moved, &settings, &camera, &f->rays);
    return s->status == GBT_OK ? draw_psnr(f->d.rgb.pixels, f->exact, 3 * ray_image_count(&f->rays)) : 0;
}

gbt_status stability_a5(stability *s)
{
    static const double behind[3] = {0, 0, -3};
    double offsets[16], least = INFINITY, naive_least = INFINITY, naive_at_limit = INFINITY;
    const size_t count = stability_list(s, "offsets", 16, offsets);
    const int size = (int)stability_number(s, "size");
    const trace_settings settings = trace_settings_default();
    far_scene f = {.camera = draw_pinhole(size, size, size, behind)};
    furnish(s, &f);
    draw_alloc(s, &f.moved, f.local.count);
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_camera(&f.camera, &f.rays, s->err)))
        f.exact = draw_exact(s, &f.local, &settings, &f.rays, NULL);
    stability_chart *chart = stability_new_chart(
        s, "Far from the origin",
        "The same scene, moved. Coordinates in float32 fall apart; ours keep a double origin.",
        "distance from the origin, m", "PSNR, dB");
    chart->log_x = true;
    chart->series[1].name = "float32 world coordinates";
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        const double D = offsets[i], away[3] = {D, D, D};
        double origin[3] = {0, 0, 0}, shift[3];
#define X(name, pad, meaning) memcpy(f.moved.name, f.local.name, f.local.count * sizeof(float));
        GAUSSIANS_FIELDS(X)
#undef X
        for (size_t k = 0; k < f.local.count; k++)
            f.moved.mean_x[k] = (float)((double)f.local.mean_x[k] + D),
            f.moved.mean_y[k] = (float)((double)f.local.mean_y[k] + D),
            f.moved.mean_z[k] = (float)((double)f.local.mean_z[k] + D);
        naive_at_limit = psnr_at(s, &f, away);
        naive_least = smaller_or_nan(naive_least, naive_at_limit);
        stability_point(chart, 1, fmax(D, 1), naive_at_limit);
        load_far(s, &f, D, origin);
        for (int k = 0; k < 3; k++)
            shift[k] = D - origin[k];
        const double psnr = psnr_at(s, &f, shift);
        least = smaller_or_nan(least, psnr);
        stability_point(chart, 0, fmax(D, 1), psnr);
    }
    stability_check(
        s, "A5a", least, naive_least,
        "Offsets to %g m, loaded as a data set. Right: the tracer itself on float32 world coordinates.",
        count > 0 ? offsets[count - 1] : 0);
    mem_free(f.exact);
    drawing_free(&f.d);
    ray_image_free(&f.rays);
    gaussians_free(&f.local);
    gaussians_free(&f.moved);
    return s->status;
}
