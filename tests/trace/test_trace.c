/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_trace.c -- the packet tracer and its adjoint against the double reference; threads,
   instruction sets, limits, failures. */
#include "base/compare.h"
#include "base/memory.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "data/gaussian_file.h"
#include "gaussians_support.h"
#include "trace/fixture.h"
#include "trace/random_scene.h"
#include "reference_once.h"
#include "trace/trace.h"

enum { CLASS_MEAN, CLASS_SCALE, CLASS_ROTATION, CLASS_OPACITY, CLASS_COLOR, CLASS_COUNT };
static const char *const class_names[CLASS_COUNT] = {"mean", "scale", "rotation", "opacity", "colour"};
static const size_t class_first[CLASS_COUNT + 1] = {REFERENCE_mean_x, REFERENCE_scale_x,
                                                    REFERENCE_quat_w, REFERENCE_opacity,
                                                    REFERENCE_red,    GAUSSIANS_FIELD_COUNT};

/* ---- scenes and rays ---- */

typedef struct cloud_def {
    const char *name;
    size_t count;
    float spread, scale_low, scale_high, flatness, opacity_high; /* of scattered_gaussians() */
    double camera[3];                                            /* looks at the origin */
} cloud_def;

static gaussians make_cloud(const cloud_def *def, uint64_t seed)
{
    return scattered_gaussians(def->count, def->spread, def->scale_low, def->scale_high, def->flatness,
                               def->opacity_high, seed);
}

static gbt_camera camera_at(const double center[3], const double target[3], int width, int height,
                            double fov_degrees)
{
    const double focal = 0.5 * width / tan(fov_degrees * 3.14159265358979323846 / 360);
    gbt_camera c = {.model = GBT_CAMERA_PINHOLE,
                    .width = width,
                    .height = height,
                    .params = {focal, focal, 0.5 * width, 0.5 * height}};
    double forward[3], right[3], down[3];
    for (int k = 0; k < 3; k++)
        forward[k] = target[k] - center[k], c.center[k] = center[k];
    if (dvec_length(forward) == 0)
        forward[2] = 1;
    dvec_normalize(forward);
    dvec_cross((double[3]){0.05, 1, 0.02}, forward, right);
    dvec_normalize(right);
    dvec_cross(forward, right, down);
    for (int k = 0; k < 3; k++) {
        c.rotation[k] = right[k];
        c.rotation[3 + k] = down[k];
        c.rotation[6 + k] = forward[k];
    }
    return c;
}

static float reach_of(const ray_image *rays)
{
    float reach = 0;
    const size_t count = rays->common_origin ? 1 : ray_image_count(rays);
    for (size_t i = 0; i < 3 * count; i++)
        reach = fmaxf(reach, fabsf(rays->origin[i]));
    return reach;
}

/* ---- both renderers ---- */

static trace_kernel kernel; /* that every test runs with, one after the other */

typedef struct traced {
    image rgb;
    float *T, *weight;
    gaussians d;
    kernel_counters counters;
    size_t rejected; /* Gaussians that a tree leaves out because of non-finite fields */
} traced;

static traced trace_all(const gaussians *g, const trace_settings *s, const ray_image *rays,
                        const image *d_rgb)
{
    traced out = {0};
    trace_scene scene = {.kernel = kernel};
    assert_ok(image_alloc(&out.rgb, rays->width, rays->height, 3, NULL));
    out.T = mem_alloc(ray_image_count(rays), sizeof(float), "test", NULL);
    out.weight = mem_alloc(g->count, sizeof(float), "test", NULL);
    assert_ok(trace_build(&scene, g, s, reach_of(rays), NULL));
    assert_ok(trace_forward(&scene, rays, true, &(trace_outputs){.rgb = &out.rgb, .transmittance = out.T},
                            &out.counters, NULL));
    assert_ok(trace_backward(&scene, rays, d_rgb, &out.d, out.weight, NULL));
    out.rejected = kernel == TRACE_EMBREE ? scene.embree.rejected_count : scene.tree.rejected_count;
    trace_scene_free(&scene);
    return out;
}

static void traced_free(traced *t)
{
    image_free(&t->rgb);
    mem_free(t->T);
    mem_free(t->weight);
    gaussians_free(&t->d);
}

static image random_gradient(const ray_image *rays, uint64_t seed)
{
    image d;
    assert_ok(image_alloc(&d, rays->width, rays->height, 3, NULL));
    for (size_t i = 0; i < 3 * ray_image_count(rays); i++)
        d.pixels[i] = (float)rng_normal(seed, 20, i);
    return d;
}

/* Rays on which rounding may change the hits: alpha within 1e-6 of a cut, T within 1e-9 of the stop, depths
   closer than float32 can tell. */
static bool is_in_band(const reference_scene *scene, const trace_settings *s, const reference_hit *hits,
                       size_t count)
{
    double T = 1, before = -1;
    for (size_t i = 0; i < count; i++) {
        const double raw =
            scene->fields[REFERENCE_opacity * scene->count + hits[i].id] * exp(-0.5 * hits[i].d2);
        if (fabs(raw - (double)s->alpha_min) < 1e-6 || fabs(raw - (double)s->alpha_max) < 1e-6)
            return true;
        if (hits[i].alpha < (double)s->alpha_min)
            continue;
        if (hits[i].t != before && hits[i].t - before < 1e-6 * hits[i].t)
            return true;
        before = hits[i].t;
        T *= 1 - hits[i].alpha;
        if (fabs(T - (double)s->transmittance_min) < 1e-9)
            return true;
        if (T < (double)s->transmittance_min)
            return false;
    }
    return false;
}

typedef struct figures {
    double psnr, max_error, T_error, gradient[CLASS_COUNT];
    size_t band, rays, hits;
    kernel_counters counters;
} figures;

static figures compare(const gaussians *g, const trace_settings *s, const ray_image *rays, uint64_t seed)
{
    figures out = {.rays = ray_image_count(rays)};
    const size_t n = out.rays;
    double *rgb = mem_alloc(n, 3 * sizeof *rgb, "test", NULL), *T = mem_alloc(n, sizeof *T, "test", NULL);
    double *d_rgb = mem_calloc(n, 3 * sizeof *d_rgb, "test", NULL),
           *d = mem_calloc(g->count, GAUSSIANS_FIELD_COUNT * sizeof *d, "test", NULL);
    bool *band = mem_calloc(n, sizeof *band, "test", NULL);
    image d_image = random_gradient(rays, seed);
    reference_scene scene;
    assert_ok(reference_scene_make(g, &scene, NULL));
    reference_hit *hits = NULL;
    size_t count, capacity = 0;
    trace_settings loose = *s;
    loose.alpha_min = fmaxf(s->alpha_min - 2e-6f, 0.5f * s->alpha_min);
    for (size_t i = 0; i < n; i++) {
        double origin[3], dir[3];
        for (size_t k = 0; k < 3; k++) {
            origin[k] = (double)ray_image_origin(rays, i)[k];
            dir[k] = (double)rays->dir[3 * i + k];
        }
        assert_ok(reference_scene_ray_hits(&scene, &loose, origin, dir, &hits, &count, &capacity, NULL));
        band[i] = is_in_band(&scene, s, hits, count);
        out.band += band[i];
        out.hits += count;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            if (band[i])
                d_image.pixels[k] = 0;
            d_rgb[k] = (double)d_image.pixels[k];
        }
    }
    mem_free(hits);
    assert_ok(reference_scene_forward(&scene, s, rays, rgb, T, NULL, NULL));
    assert_ok(reference_scene_backward(&scene, s, rays, d_rgb, NULL, d, NULL));
    traced t = trace_all(g, s, rays, &d_image);
    out.counters = t.counters;
    double square = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 3 * i; k < 3 * i + 3 && !band[i]; k++) {
            const double error = fabs((double)t.rgb.pixels[k] - rgb[k]);
            square += error * error;
            out.max_error = fmax(out.max_error, error);
            if (!isfinite(error))
                out.max_error = INFINITY;
        }
        if (!band[i])
            out.T_error = fmax(out.T_error, fabs((double)t.T[i] - T[i]));
    }
    out.psnr = square > 0 ? -10 * log10(square / (3.0 * (double)(n - out.band))) : 200;
    float *got[GAUSSIANS_FIELD_COUNT];
    field_list(&t.d, got);
    for (int class = 0; class < CLASS_COUNT; class ++) {
        double error = 0, norm = 0;
        for (size_t f = class_first[class]; f < class_first[class + 1]; f++)
            for (size_t i = 0; i < g->count; i++) {
                const double wanted = d[f * g->count + i], off = (double)got[f][i] - wanted;
                error += off * off;
                norm += wanted * wanted;
            }
        out.gradient[class] = error > 0 ? sqrt(error / norm) : error; /* NaN stays NaN */
    }
    traced_free(&t);
    reference_scene_free(&scene);
    image_free(&d_image);
    mem_free(rgb);
    mem_free(T);
    mem_free(d_rgb);
    mem_free(d);
    mem_free(band);
    return out;
}

static void print_figures(const char *name, const figures *f)
{
    print_message("%-14s %5.1f hits, %3zu of %zu rays in the band, %llu packets spilled: %.1f dB, max %.1e, "
                  "T %.1e; adjoint",
                  name, (double)f->hits / (double)f->rays, f->band, f->rays,
                  (unsigned long long)f->counters.spilled_packets, f->psnr, f->max_error, f->T_error);
    for (int class = 0; class < CLASS_COUNT; class ++)
        print_message(" %.1e", f->gradient[class]);
    print_message("\n");
}

/* What float rounding may leave. Of the scenes in docs/tracing.md, over lists: three times what it does. */
typedef struct limits {
    double psnr, error, gradient;
} limits;

static void assert_limits(const char *name, const figures *f, const limits *most)
{
    print_figures(name, f);
    if (!(f->psnr >= most->psnr && f->max_error <= most->error && f->T_error <= 2e-5))
        fail_msg("%s: %.1f dB, max error %.3g, of T %.3g", name, f->psnr, f->max_error, f->T_error);
    for (int class = 0; class < CLASS_COUNT; class ++)
        if (!(f->gradient[class] <= most->gradient))
            fail_msg("%s: gradient of %s is off by %.3g", name, class_names[class], f->gradient[class]);
    assert_true(f->band * 5 <= f->rays);
}

static void assert_figures(const char *name, const figures *f, double gradient_limit)
{
    assert_limits(name, f, &(limits){100, 2e-5, gradient_limit});
}

static trace_settings with_background(void)
{
    trace_settings s = trace_settings_default();
    s.background[0] = 0.3f;
    s.background[1] = 0.6f;
    s.background[2] = 0.1f;
    s.sky = (sky){.varies = true, .has_horizon = true, .up = {0.6f, -0.8f, 0}, .ground = {0.8f, 0.2f, 0.4f}};
    for (int k = 0; k < 3 * SKY_HARMONICS; k++)
        s.sky.harmonic[k / 3][k % 3] = 0.1f * cosf(1.7f * (float)k);
    return s;
}

/* ---- against the reference ---- */

static void random_scenes(void **state)
{
    (void)state;
    static const cloud_def rows[] = {
        {"one", 1, 0.1f, 0.5f, 1.0f, 1, 0.9f, {0, 0, -4}},
        {"twenty", 20, 1, 0.2f, 0.6f, 1, 1.2f, {3, 1, -4}},
        {"three hundred", 300, 1, 0.03f, 0.3f, 1, 0.9f, {3, 1, -4}},
        {"dense", 2000, 1, 0.05f, 0.3f, 1, 0.5f, {2, 1, -5}},
        {"opaque", 2000, 1, 0.02f, 0.2f, 1, 1.1f, {2, 1, -5}},
        {"inside", 1000, 1, 0.03f, 0.3f, 1, 0.6f, {0.1, 0.05, 0}},
        {"flat 1:100", 500, 1, 0.1f, 0.5f, 100, 0.9f, {2, 1, -4}},
        {"needles 1:1000", 500, 1, 0.2f, 0.8f, 1000, 0.9f, {2, 1, -4}},
        {"1e-3 to 1e3", 600, 2, 1e-3f, 1e3f, 1, 0.1f, {3, 1, -6}},
        {"tiny", 300, 1e-3f, 1e-4f, 3e-4f, 1, 0.9f, {2e-3, 1e-3, -4e-3}},
        {"huge", 300, 1e6f, 1e5f, 3e5f, 1, 0.9f, {2e6, 1e6, -4e6}},
    };
    static const limits ordinary = {129, 1.8e-6, 2.4e-6}, flat = {130, 2e-5, 3e-5},
                        needles = {131, 2e-5, 5e-4}, all_sizes = {126, 2e-5, 1e-5}, far = {100, 2e-5, 1e-5};
    static const limits *const over_lists[] = {&ordinary,  &ordinary, &ordinary, &ordinary,
                                               &ordinary,  &ordinary, &flat,     &needles,
                                               &all_sizes, &far,      &far};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gaussians g = make_cloud(&rows[i], 100 + i);
        trace_settings s = with_background();
        if (rows[i].spread < 0.01f)
            s.t_near = 1e-5f;
        const gbt_camera camera = camera_at(rows[i].camera, (double[3]){0, 0, 0}, 37, 21, 40);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        const figures f = compare(&g, &s, &rays, i);
        /* At 1:100 and 1:1000 the thin axis is 1e-3 and 1e-4 of the distance: rounding of coordinates alone
           moves every hit by that much more of a std-dev. */
        const float thin = rows[i].flatness;
        if (kernel == TRACE_LIST)
            assert_limits(rows[i].name, &f, over_lists[i]);
        else
            assert_figures(rows[i].name, &f, thin > 500 ? 5e-4 : thin > 50 ? 5e-5 : 1e-5);
        assert_true(f.hits > 0);
        ray_image_free(&rays);
        gaussians_free(&g);
    }
}

/* Of trace_settings.packet_order to each ray's own order: the largest difference of two pixels. */
static double off_by_one_order(const gaussians *g, const trace_settings *settings, const ray_image *rays)
{
    image rgb[2] = {{0}, {0}};
    trace_scene scene = {0};
    trace_settings s = *settings;
    double largest = 0;
    for (int k = 0; k < 2; k++) {
        s.packet_order = k == 1;
        assert_ok(image_fit(&rgb[k], rays->width, rays->height, 3, NULL));
        assert_ok(trace_build(&scene, g, &s, 0, NULL));
        assert_ok(trace_forward(&scene, rays, false, &(trace_outputs){.rgb = &rgb[k]}, NULL, NULL));
    }
    for (size_t k = 0; k < 3 * ray_image_count(rays); k++)
        largest = fmax(largest, fabs((double)rgb[0].pixels[k] - (double)rgb[1].pixels[k]));
    trace_scene_free(&scene);
    image_free(&rgb[0]);
    image_free(&rgb[1]);
    return largest;
}

/* trace_settings.packet_order. Few enough Gaussians that no two are equally deep on a ray in the middle and
   no ray becomes opaque: what lies behind that on a ray of its own is left out. */
static void one_order_for_sixteen_rays(void **state)
{
    (void)state;
    if (kernel != TRACE_LIST)
        return; /* which does not heed it */
    static const cloud_def rows[] = {
        {"three hundred", 300, 1, 0.03f, 0.3f, 1, 0.9f, {3, 1, -4}},
        {"flat 1:100", 500, 1, 0.1f, 0.5f, 100, 0.9f, {2, 1, -4}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gaussians g = make_cloud(&rows[i], 300 + i);
        trace_settings s = with_background();
        const gbt_camera camera = camera_at(rows[i].camera, (double[3]){0, 0, 0}, 37, 21, 40);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        s.packet_order = true;
        for (int spreads = 0; spreads < 2; spreads++) {
            s.spread = spreads ? 3 : 0;
            s.t_near = spreads ? 2 : 0.01f; /* hits of other depths are then of other nearness */
            const figures f = compare(&g, &s, &rays, i);
            assert_figures(rows[i].name, &f, rows[i].flatness > 50 ? 5e-5 : 1e-5);
        }
        s.spread = 0;
        assert_true(off_by_one_order(&g, &s, &rays) > 1e-3); /* an approximation */
        ray_image_free(&rays);
        gaussians_free(&g);
    }
}

/* A plane behind everything that the lowest rays alone hit: on the middle rays of their packets it is behind
   the camera, or cut at the near depth. One order of few rows and of many is that of each ray. */
static void one_order_beside_a_plane(void **state)
{
    (void)state;
    if (kernel != TRACE_LIST)
        return;
    static const float planes[2][3] = {{-1, 200, 40}, {-0.2f, 5, 20}}; /* y, z; size */
    for (size_t k = 0; k < 4; k++) {
        const float *plane = planes[k % 2];
        const size_t count = k < 2 ? 200 : 300;
        gaussians g = some(count + 1, 0.006f);
        for (size_t i = 0; i < count; i++) {
            g.mean_z[i] = 3 + 0.01f * (float)i;
            g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 1.5f;
            g.red[i] = g.blue[i] = 0;
        }
        g.mean_y[count] = plane[0];
        g.mean_z[count] = plane[1];
        g.scale_x[count] = g.scale_z[count] = plane[2];
        g.scale_y[count] = 0.01f;
        g.opacity[count] = 0.9f;
        g.green[count] = g.blue[count] = 0;
        trace_settings s = with_background();
        s.packet_order = true;
        const gbt_camera camera = camera_at((double[3]){0, 0, 0}, (double[3]){0, 0.275, 5}, 16, 16, 7.322);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        image d_rgb = random_gradient(&rays, 1);
        traced t = trace_all(&g, &s, &rays, &d_rgb);
        assert_true(t.weight[count] > 0.1f); /* it is seen */
        const double off = off_by_one_order(&g, &s, &rays);
        double *rgb = mem_alloc(3 * ray_image_count(&rays), sizeof *rgb, "test", NULL);
        assert_ok(reference_forward(&g, &s, &rays, rgb, NULL, NULL, NULL));
        print_message("beside a plane: one order is off by %.1e\n", off);
        assert_true(off < 2e-5);
        for (size_t i = 0; i < 3 * ray_image_count(&rays); i++)
            assert_near((double)t.rgb.pixels[i], rgb[i], 5e-5);
        mem_free(rgb);
        traced_free(&t);
        image_free(&d_rgb);
        ray_image_free(&rays);
        gaussians_free(&g);
    }
}

/* Gaussians one behind the other, the first opaque beyond its size: T falls to a hundredth at the first, and
   rays stop before the last. */
static void one_order_to_the_stop(void **state)
{
    (void)state;
    if (kernel != TRACE_LIST)
        return;
    enum { COUNT = 11 };
    gaussians g = some(COUNT, 0.4f);
    for (size_t i = 0; i < COUNT; i++) {
        g.mean_z[i] = 3 + 0.1f * (float)i;
        g.scale_x[i] = g.scale_z[i] = i % 4 == 3 ? 1 : 0.5f; /* 1: evaluated as ellipsoids */
        g.scale_y[i] = 0.8f * g.scale_x[i];
        g.red[i] = rng_uniform(64, 0, i);
        g.blue[i] = rng_uniform(64, 1, i);
    }
    g.opacity[0] = 2.5f;
    trace_settings s = with_background();
    s.packet_order = true;
    const gbt_camera camera = camera_at((double[3]){0, 0, 0}, (double[3]){0, 0, 5}, 16, 16, 6);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const figures f = compare(&g, &s, &rays, 64);
    assert_figures("to the stop", &f, 1e-5);
    assert_true(f.counters.blended > 5 * f.rays && f.counters.blended < COUNT * f.rays);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* One needle (1, 1/r, 1/r) at a time, and a ray through its one-sigma shell: the worst that float32
   coordinates allow. */
static void needles_one_by_one(void **state)
{
    (void)state;
    static const double ratios[] = {1, 1e2, 1e3, 1e4, 1e6},
                        over_lists[] = {1.0 / 255, 1.3e-5, 1.1e-4, 1.1e-3};
    enum { NEEDLES = 200 };
    const trace_settings s = trace_settings_default();
    for (size_t k = 0; k < sizeof ratios / sizeof ratios[0]; k++) {
        const double thin = 1 / ratios[k];
        double error[NEEDLES];
        size_t seen = 0;
        for (uint64_t i = 0; i < NEEDLES; i++) {
            gaussians g = some(1, 0.9f);
            double q[4], rotation[9], shell[3], turned[3], dir[3], origin[3] = {0, 0, 0};
            for (uint64_t j = 0; j < 4; j++)
                q[j] = rng_normal(30 + k, j, i);
            const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
            for (int j = 0; j < 4; j++)
                q[j] /= length;
            g.quat_w[0] = (float)q[0];
            g.quat_x[0] = (float)q[1];
            g.quat_y[0] = (float)q[2];
            g.quat_z[0] = (float)q[3];
            dquat_to_matrix(q, rotation);
            g.scale_y[0] = g.scale_z[0] = (float)thin;
            g.mean_x[0] = (float)(2 * rng_normal(30 + k, 4, i));
            g.mean_y[0] = (float)(2 * rng_normal(30 + k, 5, i));
            g.mean_z[0] = (float)(6 + 2 * rng_normal(30 + k, 6, i));
            for (uint64_t j = 0; j < 3; j++)
                shell[j] = rng_normal(30 + k, 7 + j, i);
            dvec_normalize(shell);
            shell[1] *= thin;
            shell[2] *= thin;
            dmat_apply(rotation, shell, turned);
            dir[0] = turned[0] + (double)g.mean_x[0];
            dir[1] = turned[1] + (double)g.mean_y[0];
            dir[2] = turned[2] + (double)g.mean_z[0];
            dvec_normalize(dir);
            float store[6] = {0, 0, 0, (float)dir[0], (float)dir[1], (float)dir[2]};
            const ray_image rays = {
                .width = 1, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
            for (int j = 0; j < 3; j++)
                dir[j] = (double)store[3 + j]; /* the reference sees the same float32 ray */
            reference_hit *hits = NULL;
            size_t count = 0, capacity = 0;
            assert_ok(reference_ray_hits(&g, &s, origin, dir, &hits, &count, &capacity, NULL));
            image d_rgb = random_gradient(&rays, i);
            traced t = trace_all(&g, &s, &rays, &d_rgb);
            const double alpha = 1 - (double)t.T[0];
            assert_true(alpha >= 0 && alpha <= 0.9 + 1e-6); /* false for NaN */
            seen += count;
            error[i] = fabs(alpha - (count > 0 ? hits[0].alpha : 0));
            float *d[GAUSSIANS_FIELD_COUNT];
            field_list(&t.d, d);
            for (size_t f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
                assert_true(isfinite(d[f][0]));
            mem_free(hits);
            image_free(&d_rgb);
            traced_free(&t);
            gaussians_free(&g);
        }
        qsort(error, NEEDLES, sizeof *error, compare_doubles);
        print_message("needles 1:%g: |alpha - reference| 95 %% %.1e, worst %.1e\n", ratios[k],
                      error[NEEDLES * 95 / 100], error[NEEDLES - 1]);
        if (ratios[k] <= 1e4) {
            assert_int_equal(seen, NEEDLES);
            assert_true(error[NEEDLES * 95 / 100] <= (kernel == TRACE_LIST ? over_lists[k] : 1.0 / 255));
        }
    }
}

/* Rays from one point into all directions go over the faces of a cube. Tiles as small as a face, tiles that
   several faces share, the poles, and pixels without a ray. */
static void faces_of_a_cube(void **state)
{
    (void)state;
    const cloud_def def = {"", 400, 1, 0.05f, 0.5f, 1, 0.6f, {0, 0, 0}};
    gaussians g = make_cloud(&def, 17);
    const trace_settings s = with_background();
    static const struct {
        const char *name;
        gbt_camera_model model;
        int width, height;
        double params[8];
    } rows[] = {{"panorama, 1 tile", GBT_CAMERA_EQUIRECTANGULAR, 16, 8, {16, 8}},
                {"panorama", GBT_CAMERA_EQUIRECTANGULAR, 100, 50, {100, 50}},
                {"fisheye 180", GBT_CAMERA_FISHEYE, 48, 48, {15, 15, 24, 24}},
                {"fisheye 330", GBT_CAMERA_FISHEYE, 48, 48, {8.3, 8.3, 24, 24}},
                {"fisheye 360", GBT_CAMERA_FISHEYE, 32, 32, {4.5, 4.5, 16, 16}}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_camera camera =
            camera_at((double[3]){0.1, 0.2, 0}, (double[3]){0.3, 0.1, 1}, rows[i].width, rows[i].height, 60);
        camera.model = rows[i].model;
        memcpy(camera.params, rows[i].params, sizeof rows[i].params);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        const figures f = compare(&g, &s, &rays, 130 + i);
        assert_limits(rows[i].name, &f,
                      kernel == TRACE_LIST ? &(limits){132, 2e-5, 2.2e-6} : &(limits){100, 2e-5, 1e-5});
        trace_scene scene = {.kernel = TRACE_LIST};
        image rgb;
        assert_ok(image_alloc(&rgb, rays.width, rays.height, 3, NULL));
        assert_ok(trace_build(&scene, &g, &s, reach_of(&rays), NULL));
        assert_ok(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb}, NULL, NULL));
        assert_true(scene.listed && scene.lists.view.face_count == LIST_FACES);
        image_free(&rgb);
        trace_scene_free(&scene);
        ray_image_free(&rays);
    }
    gaussians_free(&g);
}

static void rays_that_do_not_run_together(void **state)
{
    (void)state;
    const cloud_def def = {"", 600, 1, 0.05f, 0.4f, 1, 0.7f, {0, 0, 0}};
    gaussians g = make_cloud(&def, 7);
    const trace_settings s = with_background();
    gbt_camera camera = camera_at((double[3]){0.1, 0.2, 0}, (double[3]){0, 0, 1}, 36, 18, 60);
    static const struct {
        gbt_camera_model model;
        const char *name;
        double params[8];
    } rows[] = {{GBT_CAMERA_EQUIRECTANGULAR, "all around", {36, 18}},
                {GBT_CAMERA_OPENCV_FISHEYE, "fisheye", {8, 8, 18, 9, 0.01, 0, 0, 0}}};
    for (size_t i = 0; i < 2; i++) {
        camera.model = rows[i].model;
        memcpy(camera.params, rows[i].params, sizeof rows[i].params);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        const figures f = compare(&g, &s, &rays, 30 + i);
        assert_figures(rows[i].name, &f, 1e-5);
        ray_image_free(&rays);
    }
    /* Every ray from its own place into its own direction: no frustum, every packet lane by lane. */
    enum { W = 19, H = 13 };
    static float origin[3 * W * H], dir[3 * W * H];
    for (size_t i = 0; i < W * H; i++) {
        double d[3];
        for (size_t k = 0; k < 3; k++) {
            d[k] = rng_normal(40, k, i);
            origin[3 * i + k] = (float)rng_normal(41, k, i);
        }
        dvec_normalize(d);
        for (size_t k = 0; k < 3; k++)
            dir[3 * i + k] = (float)d[k];
    }
    const ray_image rays = {.width = W, .height = H, .origin = origin, .dir = dir};
    const figures f = compare(&g, &s, &rays, 42);
    assert_limits("every way", &f, &(limits){135, 2e-5, 8e-7});
    assert_true(f.counters.spilled_packets >= 16); /* of 20; those in the corners have few rays */
    gaussians_free(&g);
}

static void one_hundred_thousand_hits(void **state)
{
    (void)state;
    for (size_t count = 10000; count <= 100000; count *= 10) {
        gaussians g = some(count, 0);
        for (size_t i = 0; i < count; i++) {
            g.mean_z[i] = 2 * rng_uniform(1, 0, i);
            g.mean_x[i] = 0.2f * rng_uniform(1, 1, i);
            g.opacity[i] = 4 / (float)count * (0.5f + rng_uniform(1, 2, i));
            g.red[i] = rng_uniform(1, 3, i);
            g.blue[i] = 0;
        }
        trace_settings s = with_background();
        s.alpha_min = 0.1f / (float)count;
        float store[6] = {0, 0, -5, 0, 0, 1};
        const ray_image rays = {
            .width = 1, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
        image d_rgb = random_gradient(&rays, 3);
        traced t = trace_all(&g, &s, &rays, &d_rgb);
        double rgb[3], T;
        uint32_t blended;
        assert_ok(reference_forward(&g, &s, &rays, rgb, &T, &blended, NULL));
        assert_int_equal(blended, count);
        assert_int_equal(t.counters.blended, count);
        assert_int_equal(t.counters.spilled_packets, kernel == TRACE_TREE);
        for (int c = 0; c < 3; c++)
            assert_near((double)t.rgb.pixels[c], rgb[c], 1e-4); /* 10^5 additions in float32 */
        assert_near((double)t.T[0], T, 1e-4);
        if (count == 10000) { /* the reference's adjoint is quadratic in the hits */
            double *d = mem_calloc(count, GAUSSIANS_FIELD_COUNT * sizeof *d, "test", NULL), worst = 0;
            const double d_in[3] = {(double)d_rgb.pixels[0], (double)d_rgb.pixels[1],
                                    (double)d_rgb.pixels[2]};
            assert_ok(reference_backward(&g, &s, &rays, d_in, NULL, d, NULL));
            float *got[GAUSSIANS_FIELD_COUNT];
            field_list(&t.d, got);
            for (int class = 0; class < CLASS_COUNT; class ++) {
                double error = 0, norm = 0;
                for (size_t f = class_first[class]; f < class_first[class + 1]; f++)
                    for (size_t i = 0; i < count; i++) {
                        error += pow((double)got[f][i] - d[f * count + i], 2);
                        norm += pow(d[f * count + i], 2);
                    }
                if (class != CLASS_ROTATION) /* round: no gradient */
                    worst = fmax(worst, sqrt(error / norm));
                else
                    assert_true(error == 0 && norm == 0);
            }
            print_message("10,000 hits on one ray: adjoint within %.1e\n", worst);
            assert_true(worst <= 5e-5);
            mem_free(d);
        }
        traced_free(&t);
        image_free(&d_rgb);
        gaussians_free(&g);
    }
}

/* Equal depths go by id: in the packet (150 rows fit) and ray by ray (800 do not). */
static void coincident_gaussians(void **state)
{
    (void)state;
    const trace_settings s = with_background();
    for (size_t count = 150; count <= 800; count += 650) {
        gaussians g = some(count, 0.01f);
        for (size_t i = 0; i < count; i++)
            g.red[i] = rng_uniform(8, 0, i), g.green[i] = i % 2 == 0, g.blue[i] = (float)i / (float)count,
            g.scale_y[i] = 2, g.scale_z[i] = 0.5f;
        const gbt_camera camera = camera_at((double[3]){1, 0.5, -6}, (double[3]){0, 0, 0}, 16, 12, 20);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        const figures f = compare(&g, &s, &rays, 50);
        const limits few = {113, 2e-5, 6e-6}, many = {109, 2e-5, 5e-5}; /* T: a product of 800 roundings */
        if (kernel == TRACE_LIST)
            assert_limits(count == 150 ? "150 at once" : "800 at once", &f, count == 150 ? &few : &many);
        else
            assert_figures(count == 150 ? "150 at once" : "800 at once", &f, count == 150 ? 1e-5 : 5e-5);
        assert_int_equal(f.counters.spilled_packets, kernel == TRACE_TREE && count == 800 ? 12 : 0);
        ray_image_free(&rays);
        gaussians_free(&g);
    }
}

static void assert_copies(const char *name, const gaussians *g, const double center[3],
                          const double target[3], int size, double fov)
{
    const trace_settings s = with_background();
    const gbt_camera camera = camera_at(center, target, size, size, fov);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const figures f = compare(g, &s, &rays, 60);
    assert_figures(name, &f, 2e-5);
    ray_image_free(&rays);
}

/* Gaussians of one shape in one place go by index however opaque each is, though those that are less so end
   before the others; few of them, and more than are ranked by pairs. Over the tree they must be equally
   opaque. */
static void copies_of_other_opacity(void **state)
{
    (void)state;
    if (kernel == TRACE_TREE)
        skip();
    for (size_t count = 3; count <= 300; count *= 10) {
        const float most = count < 300 ? 0.5f : 0.03f;
        gaussians g = some(count, 0);
        for (size_t i = 0; i < count; i++) {
            g.opacity[i] = most * (0.2f + 0.8f * (float)i / (float)(count - 1));
            g.red[i] = rng_uniform(8, 0, i), g.green[i] = i % 2 == 0, g.blue[i] = (float)i / (float)count;
            g.scale_x[i] = 0.3f, g.scale_y[i] = 0.2f, g.scale_z[i] = 0.4f;
        }
        assert_copies("copies", &g, (double[3]){1, 0.5, -6}, (double[3]){0, 0, 0}, 40, 30);
        gaussians_free(&g);
    }
    /* As near as it depends on what is seen of them which formula they get. */
    for (int k = 0; k < 5; k++) {
        gaussians g = some(2, 0.3f);
        for (size_t i = 0; i < 2; i++) {
            g.mean_x[i] = 0.3f, g.mean_y[i] = 0.2f, g.mean_z[i] = 4 + 0.2f * (float)k;
            g.scale_y[i] = 1.05f, g.scale_z[i] = 0.97f;
            g.quat_w[i] = 0.92338f, g.quat_x[i] = 0.10260f, g.quat_y[i] = 0.30779f, g.quat_z[i] = 0.20520f;
            g.red[i] = i == 1, g.green[i] = 0, g.blue[i] = i == 0;
        }
        g.opacity[1] = 0.9f;
        assert_copies("copies nearby", &g, (double[3]){0, 0, 0}, (double[3]){0, 0, 1}, 64, 40);
        gaussians_free(&g);
    }
    /* Of another size, too: at the same depths. */
    gaussians g = some(3, 0.4f);
    for (size_t i = 0; i < 3; i++) {
        g.mean_x[i] = 1, g.mean_y[i] = 0.5f, g.mean_z[i] = 5;
        g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = i == 2 ? 1 : 0.5f;
        g.red[i] = i == 1, g.green[i] = 0, g.blue[i] = i == 0;
    }
    g.opacity[1] = 0.9f;
    g.opacity[2] = 0.014f;
    assert_copies("two sizes", &g, (double[3]){0, 0, 0}, (double[3]){0, 0, 1}, 64, 40);
    gaussians_free(&g);
}

/* The camera inside of many that hide each other, and no near depth: most hits are at depth 0, where they go
   by index, and one found late may come first. */
static void inside_of_many(void **state)
{
    (void)state;
    gaussians g = random_gaussians(200, 0.3f, 21);
    for (size_t i = 0; i < g.count; i++) {
        g.scale_x[i] = 2 + g.scale_x[i];
        g.scale_y[i] = 2 + g.scale_y[i];
        g.scale_z[i] = 2 + g.scale_z[i];
    }
    trace_settings s = with_background();
    s.t_near = 0;
    const gbt_camera camera = camera_at((double[3]){4, 0.5, 0}, (double[3]){5, 0, 2}, 20, 18, 20);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const figures f = compare(&g, &s, &rays, 61);
    assert_figures("inside of many", &f, 1e-5);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* A sheet across the depths, whose near part is blended rounds before its far part is reached, and a wall in
   front of the far part alone: the rays of that part become opaque while the sheet waits for them. What was
   blended must still reach the adjoint. */
static void sheets_that_end_behind_a_wall(void **state)
{
    (void)state;
    enum { SHEETS = 5, WALLS = 3, COUNT = SHEETS + WALLS + 6000 };
    gaussians g = some(COUNT, 0.03f);
    for (size_t i = 0; i < COUNT; i++) { /* faint ones all along the rays, so that there are rounds */
        const float depth = 1.5f + 25 * rng_uniform(90, 0, i);
        g.mean_x[i] = depth * (rng_uniform(90, 1, i) - 0.5f);
        g.mean_y[i] = depth * (rng_uniform(90, 2, i) - 0.5f);
        g.mean_z[i] = depth;
        g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 0.05f;
        g.red[i] = rng_uniform(90, 3, i);
        g.green[i] = rng_uniform(90, 4, i);
        g.blue[i] = rng_uniform(90, 5, i);
    }
    for (size_t i = 0; i < SHEETS; i++) { /* from (-1.5, y, 4) to (7.5, y, 20) */
        g.mean_x[i] = 3;
        g.mean_y[i] = 0;
        g.mean_z[i] = 12 + 0.3f * (float)i;
        g.scale_x[i] = 0.1f;
        g.scale_y[i] = 5;
        g.scale_z[i] = 9;
        g.quat_w[i] = 0.9673f;
        g.quat_x[i] = 0;
        g.quat_y[i] = 0.2537f;
        g.quat_z[i] = 0;
        g.opacity[i] = 0.4f;
    }
    for (size_t i = SHEETS; i < SHEETS + WALLS; i++) { /* in front of the last column */
        g.mean_x[i] = 3.5f;
        g.mean_y[i] = 0;
        g.mean_z[i] = 9 + 0.2f * (float)i;
        g.scale_x[i] = 0.7f;
        g.scale_y[i] = 9;
        g.scale_z[i] = 0.05f;
        g.opacity[i] = 2.5f; /* opaque beyond a std-dev */
    }
    gaussians_pad(&g);
    const trace_settings s = with_background();
    const gbt_camera camera = camera_at((double[3]){0, 0, 0}, (double[3]){0, 0, 1}, 4, 4, 50);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const figures f = compare(&g, &s, &rays, 91);
    assert_figures("behind a wall", &f, 2e-5);
    assert_int_equal(f.counters.spilled_packets, 0);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* At alpha_max exactly the gradient is already 0, as the reference has it; one float below it is open. */
static void the_cap_is_exact(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    float store[6] = {0, 0, -5, 0, 0, 1};
    const ray_image rays = {
        .width = 1, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
    image d_rgb;
    assert_ok(image_alloc(&d_rgb, 1, 1, 3, NULL));
    d_rgb.pixels[0] = d_rgb.pixels[1] = d_rgb.pixels[2] = 1;
    const float opacities[3] = {nextafterf(s.alpha_max, 0), s.alpha_max, nextafterf(s.alpha_max, 1)};
    for (cpu_isa isa = CPU_PLAIN; isa <= CPU_AVX512; isa++) {
        cpu_limit_isa(isa);
        for (int i = 0; i < 3; i++) {
            gaussians g = some(1, opacities[i]);
            traced t = trace_all(&g, &s, &rays, &d_rgb);
            double d[GAUSSIANS_FIELD_COUNT] = {0};
            assert_ok(reference_backward(&g, &s, &rays, (double[3]){1, 1, 1}, NULL, d, NULL));
            assert_near((double)t.d.opacity[0], i == 0 ? 3 : 0, 0);
            assert_near(d[REFERENCE_opacity], i == 0 ? 3 : 0, 0);
            assert_near((double)t.d.red[0], (double)(i == 0 ? opacities[0] : s.alpha_max), 0);
            traced_free(&t);
            gaussians_free(&g);
        }
    }
    cpu_limit_isa(CPU_AVX512);
    image_free(&d_rgb);
}

/* ---- the same bits ---- */

static void assert_same(const traced *a, const traced *b, size_t rays, size_t count)
{
    assert_memory_equal(a->rgb.pixels, b->rgb.pixels, 3 * rays * sizeof(float));
    assert_memory_equal(a->T, b->T, rays * sizeof(float));
    assert_memory_equal(a->weight, b->weight, count * sizeof(float));
    float *x[GAUSSIANS_FIELD_COUNT], *y[GAUSSIANS_FIELD_COUNT];
    field_list(&a->d, x);
    field_list(&b->d, y);
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        assert_memory_equal(x[f], y[f], count * sizeof(float));
    assert_memory_equal(&a->counters, &b->counters, sizeof a->counters);
}

/* With the threads that are set. */
static void assert_same_on_all_sets(const traced *first, const gaussians *g, const trace_settings *s,
                                    const ray_image *rays, const image *d_rgb)
{
    for (cpu_isa isa = CPU_PLAIN; isa <= CPU_AVX512; isa++) {
        cpu_limit_isa(isa);
        traced again = trace_all(g, s, rays, d_rgb);
        assert_same(first, &again, ray_image_count(rays), g->count);
        traced_free(&again);
    }
    cpu_limit_isa(CPU_AVX512);
}

/* A row that comes last on the middle rays, and on few others first: the adjoint goes past it once for each
   row in front, and then sorts the rays one by one. */
static void the_last_row_is_near_on_few_rays(void **state)
{
    (void)state;
    if (kernel != TRACE_LIST)
        return;
    enum { COUNT = 800 };
    gaussians g = some(COUNT + 1, 0.0003f);
    for (size_t i = 0; i < COUNT; i++) {
        g.mean_z[i] = 8.5f + 2 * (float)i / COUNT;
        g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 1.5f;
        g.red[i] = rng_uniform(62, 0, i);
        g.blue[i] = rng_uniform(62, 1, i);
    }
    g.mean_y[COUNT] = -0.16f;
    g.mean_z[COUNT] = 12;
    g.scale_x[COUNT] = g.scale_z[COUNT] = 1.6f;
    g.scale_y[COUNT] = 0.004f;
    g.opacity[COUNT] = 0.9f;
    trace_settings s = with_background();
    s.alpha_min = 1e-4f;
    const gbt_camera camera = camera_at((double[3]){0, 0, 0}, (double[3]){0, 0.1933, 5}, 16, 16, 7.322);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const figures f = compare(&g, &s, &rays, 62);
    assert_figures("late and near", &f, 5e-4);
    assert_int_equal(f.counters.spilled_packets, 0); /* forward */
    image d_rgb = random_gradient(&rays, 63);
    cpu_limit_isa(CPU_PLAIN);
    traced first = trace_all(&g, &s, &rays, &d_rgb);
    assert_same_on_all_sets(&first, &g, &s, &rays, &d_rgb);
    traced_free(&first);
    image_free(&d_rgb);
    ray_image_free(&rays);
    gaussians_free(&g);
}

static void instruction_sets_and_threads_give_the_same_bits(void **state)
{
    (void)state;
    /* More than 3,072 Gaussians: from there on Embree builds a tree with several threads. */
    const cloud_def defs[] = {{"", 4000, 1, 0.03f, 0.3f, 30, 0.9f, {2, 1, -5}},
                              {"", 500, 0.2f, 1, 2, 1, 0.03f, {0, 0, 0}},
                              {"", 1000, 1, 0.03f, 0.3f, 30, 0.9f, {2, 1, -5}}};
    const int before = parallel_threads();
    uint64_t spilled = 0;
    for (size_t i = 0; i < (kernel == TRACE_LIST ? 3 : 2); i++) {
        gaussians g = make_cloud(&defs[i], 60 + i);
        trace_settings s = with_background();
        s.packet_order = i == 2; /* which lists alone heed */
        gbt_camera camera = camera_at(defs[i].camera, (double[3]){0, 0, 0.5}, 22, 14, 50);
        if (i == 1) { /* wide and deep: packets spill */
            camera.model = GBT_CAMERA_EQUIRECTANGULAR;
            camera.params[0] = 22;
            camera.params[1] = 14;
        }
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        image d_rgb = random_gradient(&rays, 70);
        parallel_set_threads(1);
        cpu_limit_isa(CPU_PLAIN);
        traced first = trace_all(&g, &s, &rays, &d_rgb);
        spilled += first.counters.spilled_packets;
        for (int threads = 1; threads <= 16; threads = threads < 3 ? threads + 1 : threads + 13) {
            parallel_set_threads(threads);
            assert_same_on_all_sets(&first, &g, &s, &rays, &d_rgb);
        }
        traced_free(&first);
        image_free(&d_rgb);
        ray_image_free(&rays);
        gaussians_free(&g);
    }
    print_message("widest instruction set here: %s; %llu packets spilled\n", cpu_isa_name(cpu_best_isa()),
                  (unsigned long long)spilled);
    assert_true(spilled > 5);
    parallel_set_threads(before);
}

/* ---- odd input ---- */

static void rays_that_are_none(void **state)
{
    (void)state;
    enum { W = 6, H = 5, RAYS = W * H };
    float origin[3 * RAYS], dir[3 * RAYS];
    for (size_t i = 0; i < RAYS; i++) {
        origin[3 * i] = 0.1f * (float)(i % W);
        origin[3 * i + 1] = 0;
        origin[3 * i + 2] = -4;
        dir[3 * i] = dir[3 * i + 1] = 0;
        dir[3 * i + 2] = 1;
    }
    dir[3 * 2 + 2] = 0;
    dir[3 * 7] = NAN;
    dir[3 * 9 + 2] = INFINITY;
    origin[3 * 11] = NAN;
    origin[3 * 13 + 1] = INFINITY;
    dir[3 * 28 + 2] = dir[3 * 29 + 2] = 0; /* a packet without any ray */
    static const size_t none[] = {2, 7, 9, 11, 13, 28, 29};
    const ray_image rays = {.width = W, .height = H, .origin = origin, .dir = dir};
    const trace_settings s = with_background();
    gaussians g = some(3, 0.5f);
    image d_rgb = random_gradient(&rays, 80);
    trace_scene scene = {0};
    traced t = {0};
    assert_ok(image_alloc(&t.rgb, W, H, 3, NULL));
    float T[RAYS];
    assert_ok(trace_build(&scene, &g, &s, 4, NULL));
    assert_ok(trace_forward(&scene, &rays, true, &(trace_outputs){.rgb = &t.rgb, .transmittance = T},
                            &t.counters, NULL));
    assert_ok(trace_backward(&scene, &rays, &d_rgb, &t.d, NULL, NULL));
    assert_int_equal(t.counters.rays, RAYS - 7);
    for (size_t i = 0; i < RAYS; i++) {
        bool is_none = false;
        for (size_t k = 0; k < sizeof none / sizeof *none; k++)
            is_none = is_none || none[k] == i;
        assert_true(is_none == (T[i] == 1));
        for (size_t c = 0; c < 3; c++)
            assert_true(is_none == (t.rgb.pixels[3 * i + c] == s.sky.ground[c]));
    }
    assert_true(isfinite(t.d.mean_x[0]) && isfinite(t.d.scale_z[0]) && isfinite(t.d.opacity[0]));
    trace_scene_free(&scene);
    traced_free(&t);
    image_free(&d_rgb);
    gaussians_free(&g);
}

static void broken_gaussians_are_left_out(void **state)
{
    (void)state;
    gaussians g = some(12, 0.4f);
    g.mean_x[0] = NAN;
    g.scale_y[1] = 0;
    g.scale_x[2] = NAN;
    g.quat_w[3] = NAN;
    g.opacity[4] = NAN;
    g.mean_z[5] = INFINITY;
    g.opacity[6] = -1;
    g.opacity[7] = 0;    /* below alpha_min: not rejected, only never seen */
    g.opacity[8] = 1.5f; /* cut at alpha_max near the centre, as any other */
    g.mean_z[8] = 3;
    const trace_settings s = with_background();
    const gbt_camera camera = camera_at((double[3]){1, 0.5, -6}, (double[3]){0, 0, 0}, 13, 9, 30);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    image d_rgb = random_gradient(&rays, 90);
    traced t = trace_all(&g, &s, &rays, &d_rgb);
    assert_int_equal(t.rejected, kernel == TRACE_LIST ? 0 : 6); /* lists count nothing */
    float *d[GAUSSIANS_FIELD_COUNT];
    field_list(&t.d, d);
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        for (size_t i = 0; i < 8; i++)
            assert_true(d[f][i] == 0);
    assert_true(t.weight[8] > 0 && t.weight[11] > 0);
    traced_free(&t);
    double rgb[3 * 13 * 9];
    assert_ok(reference_forward(&g, &s, &rays, rgb, NULL, NULL, NULL));
    t = trace_all(&g, &s, &rays, &d_rgb);
    for (size_t i = 0; i < 3 * 13 * 9; i++)
        assert_near((double)t.rgb.pixels[i], rgb[i], 2e-6);
    traced_free(&t);
    gaussians nobody = some(0, 0); /* no Gaussian, no tree */
    t = trace_all(&nobody, &s, &rays, &d_rgb);
    float behind[3];
    sky_color(&s.sky, s.background, rays.dir, behind);
    assert_true(t.rgb.pixels[0] == behind[0] && t.T[20] == 1 && t.d.count == 0);
    traced_free(&t);
    gaussians_free(&nobody);
    image_free(&d_rgb);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Spheres of about the step of floats there, a ray at each: none that the reference hits is lost. */
static void small_spheres_far_away(void **state)
{
    (void)state;
    enum { W = 32, RAYS = 16 * W };
    static const trace_kernel kernels[] = {TRACE_TREE, TRACE_SINGLE, TRACE_EMBREE};
    static const double places[][2] = {{0.005, 1e5}, {0.05, 1e6}, {0.005, 1e6}, {0.5, 1e7}}; /* size, where */
    static float origin[3 * RAYS], dir[3 * RAYS], T[RAYS];
    static double want_rgb[3 * RAYS], want[RAYS];
    if (kernel == TRACE_LIST)
        return; /* rays from many places have no lists */
    const trace_settings s = trace_settings_default();
    const ray_image rays = {.width = W, .height = RAYS / W, .origin = origin, .dir = dir};
    gaussians g = some(RAYS, 1);
    float *const mean[3] = {g.mean_x, g.mean_y, g.mean_z};
    image rgb;
    size_t hits = 0;
    assert_ok(image_alloc(&rgb, rays.width, rays.height, 3, NULL));
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        const double size = places[p][0];
        for (size_t i = 0; i < RAYS; i++) {
            double way[3];
            for (size_t k = 0; k < 3; k++)
                way[k] = rng_normal(16 + p, k, i);
            dvec_normalize(way);
            for (size_t k = 0; k < 3; k++) {
                mean[k][i] = (float)(places[p][1] + 1000 * size * (double)rng_uniform(16 + p, 3 + k, i));
                origin[3 * i + k] = (float)((double)mean[k][i] - 5000 * size * way[k]);
                dir[3 * i + k] = (float)way[k];
            }
            g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = (float)(size / 3.3);
        }
        assert_ok(reference_forward(&g, &s, &rays, want_rgb, want, NULL, NULL));
        for (size_t k = 0; k < sizeof kernels / sizeof *kernels; k++) {
            trace_scene scene = {.kernel = kernels[k]};
            assert_ok(trace_build(&scene, &g, &s, reach_of(&rays), NULL));
            assert_ok(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb, .transmittance = T},
                                    NULL, NULL));
            for (size_t i = 0; i < RAYS; i++) {
                assert_true(want[i] >= 0.97 || T[i] < 1);
                hits += want[i] < 0.97;
            }
            trace_scene_free(&scene);
        }
    }
    assert_true(hits > 1000);
    image_free(&rgb);
    gaussians_free(&g);
}

/* A disc thinner than float32 can square: the ray inside its plane hits it, its neighbours make infinities.
   No gradient may be NaN. */
static void no_nan_from_neighbours(void **state)
{
    (void)state;
    gaussians g = some(2, 0.5f);
    g.scale_x[0] = 1e-25f;
    g.mean_x[1] = 0.2f;
    enum { W = 4, H = 1 };
    float origin[3] = {0, 0, -4},
          dir[3 * W] = {0, 0, 1, 0.02f, 0, 0.9998f, -0.02f, 0, 0.9998f, 0.04f, 0, 0.9992f};
    const ray_image rays = {.width = W, .height = H, .origin = origin, .dir = dir, .common_origin = true};
    const trace_settings s = with_background();
    image d_rgb = random_gradient(&rays, 95);
    traced t = trace_all(&g, &s, &rays, &d_rgb);
    float *d[GAUSSIANS_FIELD_COUNT];
    field_list(&t.d, d);
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        assert_true(isfinite(d[f][0]) && isfinite(d[f][1]));
    for (size_t i = 0; i < 3 * W; i++)
        assert_true(isfinite(t.rgb.pixels[i]));
    assert_true(t.weight[0] > 0.1f && t.weight[1] > 0.1f);
    traced_free(&t);
    image_free(&d_rgb);
    gaussians_free(&g);
}

static void wrong_sizes_are_refused(void **state)
{
    (void)state;
    gaussians g = some(1, 0.5f), d = {0};
    float store[9] = {0, 0, -5, 0, 0, 1, 0, 0, 1};
    ray_image rays = {.width = 2, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
    const trace_settings s = trace_settings_default();
    trace_scene scene = {0};
    image rgb, small;
    gbt_error err = {0};
    assert_ok(image_alloc(&rgb, 2, 1, 3, NULL));
    assert_ok(image_alloc(&small, 1, 1, 3, NULL));
    assert_ok(trace_build(&scene, &g, &s, 5, NULL));
    assert_int_equal(trace_forward(&scene, &rays, true, &(trace_outputs){.rgb = &small}, NULL, &err),
                     GBT_ERR_ARGUMENT);
    assert_int_equal(trace_backward(&scene, &rays, &rgb, &d, NULL, NULL), GBT_ERR_ARGUMENT); /* no pass */
    /* Nobody wants the picture any more; the next one is drawn. */
    const atomic_bool stopped = true;
    scene.stop = &stopped;
    err = (gbt_error){0};
    assert_int_equal(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb}, NULL, &err),
                     GBT_ERR_INTERRUPTED);
    scene.stop = NULL;
    assert_ok(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb}, NULL, NULL));
    assert_int_equal(trace_backward(&scene, &rays, &rgb, &d, NULL, NULL), GBT_ERR_ARGUMENT); /* no tape */
    assert_ok(trace_forward(&scene, &rays, true, &(trace_outputs){.rgb = &rgb}, NULL, NULL));
    assert_int_equal(trace_backward(&scene, &rays, &small, &d, NULL, NULL), GBT_ERR_ARGUMENT);
    assert_ok(trace_backward(&scene, &rays, &rgb, &d, NULL, NULL));
    assert_ok(trace_build(&scene, &g, &s, 5, NULL));
    assert_int_equal(trace_backward(&scene, &rays, &rgb, &d, NULL, NULL),
                     GBT_ERR_ARGUMENT); /* the tape was of another build */
    trace_scene_free(&scene);
    image_free(&rgb);
    image_free(&small);
    gaussians_free(&g);
    gaussians_free(&d);
}

static gbt_status run_once(const gaussians *g, const trace_settings *s, const ray_image *rays, image *rgb,
                           const image *d_rgb, gbt_error *err)
{
    trace_scene scene = {.kernel = kernel};
    gaussians d = {0};
    gbt_status status = trace_build(&scene, g, s, reach_of(rays), err);
    if (status == GBT_OK)
        status = trace_forward(&scene, rays, true, &(trace_outputs){.rgb = rgb}, NULL, err);
    if (status == GBT_OK)
        status = trace_backward(&scene, rays, d_rgb, &d, NULL, err);
    trace_scene_free(&scene);
    gaussians_free(&d);
    return status;
}

static void memory_runs_out(void **state)
{
    (void)state;
    const cloud_def defs[2] = {{"", 200, 1, 0.1f, 0.3f, 1, 0.9f, {2, 1, -5}},
                               {"", 300, 0.2f, 1, 2, 1, 0.03f, {2, 1, -5}}};
    const trace_settings s = with_background();
    const int before = parallel_threads();
    parallel_set_threads(1);
    for (size_t i = 0; i < 2; i++) { /* the second spills */
        gaussians g = make_cloud(&defs[i], 5 + i);
        const gbt_camera camera = camera_at(defs[i].camera, (double[3]){0, 0, 0}, 12, 6, 40);
        ray_image rays = {0};
        assert_ok(ray_image_from_camera(&camera, &rays, NULL));
        image d_rgb = random_gradient(&rays, 1), rgb;
        assert_ok(image_alloc(&rgb, 12, 6, 3, NULL));
        assert_ok(run_once(&g, &s, &rays, &rgb, &d_rgb, NULL)); /* Embree's device exists from here on */
        long n = 0;
        for (gbt_status status = GBT_ERR_NO_MEMORY; status != GBT_OK; n++) {
            gbt_error err = {0};
            mem_fail_after(n);
            status = run_once(&g, &s, &rays, &rgb, &d_rgb, &err);
            mem_fail_after(-1);
            if (status != GBT_OK) {
                assert_int_equal(status, GBT_ERR_NO_MEMORY);
                assert_true(err.text[0] != '\0');
            }
        }
        assert_true(n > 15);
        image_free(&rgb);
        image_free(&d_rgb);
        ray_image_free(&rays);
        gaussians_free(&g);
    }
    parallel_set_threads(before);
}

/* ---- a scene of others ---- */

static void peer_scene(void **state)
{
    (void)state;
    const char *path = shared_path("peer/match2k/scene.ply");
    if (path == NULL)
        skip();
    gaussian_cloud cloud;
    assert_ok(gaussian_file_read(path, &cloud, NULL));
    gaussians g = gaussians_of_cloud(&cloud, 1);
    assert_int_equal(cloud.count, 2000);
    const gbt_camera camera = camera_at((double[3]){0, -38, 9}, (double[3]){0, 0, 0}, 48, 48, 38);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    const trace_settings s = trace_settings_default();
    const figures f = compare(&g, &s, &rays, 2);
    assert_figures("peer match2k", &f, 1e-5);
    assert_true(f.hits > 10 * f.rays);
    ray_image_free(&rays);
    gaussians_free(&g);
    gaussian_cloud_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_scenes),
        cmocka_unit_test(one_order_for_sixteen_rays),
        cmocka_unit_test(one_order_beside_a_plane),
        cmocka_unit_test(one_order_to_the_stop),
        cmocka_unit_test(needles_one_by_one),
        cmocka_unit_test(faces_of_a_cube),
        cmocka_unit_test(rays_that_do_not_run_together),
        cmocka_unit_test(one_hundred_thousand_hits),
        cmocka_unit_test(coincident_gaussians),
        cmocka_unit_test(copies_of_other_opacity),
        cmocka_unit_test(inside_of_many),
        cmocka_unit_test(sheets_that_end_behind_a_wall),
        cmocka_unit_test(the_cap_is_exact),
        cmocka_unit_test(the_last_row_is_near_on_few_rays),
        cmocka_unit_test(instruction_sets_and_threads_give_the_same_bits),
        cmocka_unit_test(rays_that_are_none),
        cmocka_unit_test(broken_gaussians_are_left_out),
        cmocka_unit_test(small_spheres_far_away),
        cmocka_unit_test(no_nan_from_neighbours),
        cmocka_unit_test(wrong_sizes_are_refused),
        cmocka_unit_test(memory_runs_out),
        cmocka_unit_test(peer_scene),
    };
    int failed = 0;
    for (kernel = TRACE_LIST; kernel <= TRACE_TREE; kernel++) {
        print_message(kernel == TRACE_LIST ? "over lists\n" : "over the tree\n");
        failed += cmocka_run_group_tests(tests, NULL, NULL);
    }
    return failed;
}
