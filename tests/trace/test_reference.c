/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_reference.c -- the double reference against closed forms and central differences, and the
   rays that feed it. */
#include "base/memory.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "test_support.h"
#include "trace/fixture.h"
#include "reference_once.h"

/* One ray along +z from (x, y, z). The arrays live in `store`. */
static ray_image one_ray(float store[6], float x, float y, float z)
{
    store[0] = x;
    store[1] = y;
    store[2] = z;
    store[3] = 0;
    store[4] = 0;
    store[5] = 1;
    return (ray_image){.width = 1, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
}

typedef struct seen {
    double rgb[3], T;
    uint32_t blended;
} seen;

static seen look(const gaussians *g, const trace_settings *s, float x, float y, float z)
{
    float store[6];
    const ray_image rays = one_ray(store, x, y, z);
    seen out;
    assert_ok(reference_forward(g, s, &rays, out.rgb, &out.T, &out.blended, NULL));
    return out;
}

static void defaults(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    assert_near((double)s.alpha_min, 1.0 / 255, 1e-9);
    assert_near((double)s.alpha_max, 0.99, 1e-7);
    assert_near((double)s.transmittance_min, 1e-4, 1e-11);
    assert_near((double)s.t_near, 0.01, 1e-9);
    assert_near((double)(s.background[0] + s.background[1] + s.background[2]), 0, 0);
}

static void through_the_centre_alpha_is_opacity(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(1, 0.7f);
    g.red[0] = 0.25f;
    const seen a = look(&g, &s, 0, 0, -5);
    assert_near(a.T, 1 - (double)0.7f, 1e-15);
    assert_near(a.rgb[0], 0.25 * (double)0.7f, 1e-15);
    assert_int_equal(a.blended, 1);
    const seen off = look(&g, &s, 2, 0, -5); /* d2 = 4 */
    assert_near(off.T, 1 - (double)0.7f * exp(-2), 1e-15);
    gaussians_free(&g);
}

/* Scales 1, 2, 3 turned by a quarter about z: the local x axis is the world's y axis. */
static void rotation_and_scale_in_closed_form(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(1, 0.8f);
    g.scale_y[0] = 2;
    g.scale_z[0] = 3;
    g.quat_w[0] = g.quat_z[0] = sqrtf(0.5f);
    const seen a = look(&g, &s, 1, 0.5f, -50);
    assert_near(a.T, 1 - (double)0.8f * exp(-0.5 * (0.25 + 0.25)), 1e-7); /* x / 2 and y / 1; the quaternion
                                                                             is rounded */
    gaussians_free(&g);
}

static void layers_multiply(void **state)
{
    (void)state;
    trace_settings s = trace_settings_default();
    s.background[0] = 0.5f;
    s.background[1] = 0;
    s.background[2] = 1;
    gaussians g = some(6, 0.3f);
    for (int i = 0; i < 6; i++)
        g.mean_z[i] = (float)(10 * ((i * 5) % 6)); /* ids are not in depth order */
    const double T = pow(1 - (double)0.3f, 6);
    const seen a = look(&g, &s, 0, 0, -5);
    assert_near(a.T, T, 1e-15);
    assert_near(a.rgb[0], 1 - T + 0.5 * T, 1e-15);
    assert_near(a.rgb[1], 1 - T, 1e-15);
    assert_near(a.rgb[2], 1, 1e-15);
    gaussians_free(&g);
}

/* Inside a Gaussian and past its centre the response is taken at t_near. */
static void camera_inside(void **state)
{
    (void)state;
    trace_settings s = trace_settings_default();
    s.t_near = 0;
    gaussians g = some(1, 0.9f);
    assert_near(1 - look(&g, &s, 0, 0, 0.5f).T, 0.9 * exp(-0.125), 1e-7); /* 0.7942 */
    assert_near(1 - look(&g, &s, 0, 0, 0.5f).T, 0.7942, 1e-4);
    assert_near(1 - look(&g, &s, 0, 0, -0.5f).T, 0.9, 1e-7); /* the centre is still ahead */
    s.t_near = 0.25f;
    assert_near(1 - look(&g, &s, 0, 0, 0.5f).T, 0.9 * exp(-0.5 * 0.75 * 0.75), 1e-7);
    assert_near(1 - look(&g, &s, 0, 0, -0.125f).T, 0.9 * exp(-0.5 * 0.125 * 0.125),
                1e-7); /* the centre is nearer than t_near */
    gaussians_free(&g);
}

static void ties_go_by_id(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(5, 0.5f);
    for (int i = 0; i < 5; i++)
        g.red[i] = (float)(1 << i);
    reference_hit *hits = NULL;
    size_t count, capacity = 0;
    assert_ok(reference_ray_hits(&g, &s, (double[3]){0, 0, -4}, (double[3]){0, 0, 1}, &hits, &count,
                                 &capacity, NULL));
    assert_int_equal(count, 5);
    for (uint32_t i = 0; i < 5; i++) {
        assert_int_equal(hits[i].id, i);
        assert_near(hits[i].t, 4, 0);
        assert_near(hits[i].d2, 0, 0);
        assert_near(hits[i].alpha, 0.5, 0);
    }
    assert_near(look(&g, &s, 0, 0, -4).rgb[0], 0.5 + 0.5 + 0.5 + 0.5 + 0.5, 1e-15); /* 2^-(i+1) 2^i each */
    g.mean_z[4] = -1;
    g.mean_z[1] = 2; /* now 4 comes first, and 1 last */
    assert_ok(reference_ray_hits(&g, &s, (double[3]){0, 0, -4}, (double[3]){0, 0, 1}, &hits, &count,
                                 &capacity, NULL));
    static const uint32_t wanted[] = {4, 0, 2, 3, 1};
    for (int i = 0; i < 5; i++)
        assert_int_equal(hits[i].id, wanted[i]);
    assert_near(hits[0].t, 3, 0);
    assert_near(hits[4].t, 6, 0);
    mem_free(hits);
    gaussians_free(&g);
}

static void nothing_there(void **state)
{
    (void)state;
    trace_settings s = trace_settings_default();
    s.background[1] = 0.5f;
    gaussians g = some(0, 1);
    const seen empty = look(&g, &s, 0, 0, 0);
    assert_near(empty.T, 1, 0);
    assert_near(empty.rgb[0], 0, 0);
    assert_near(empty.rgb[1], 0.5, 0);
    assert_int_equal(empty.blended, 0);
    gaussians_free(&g);
    g = some(1, 0.9f);
    float store[6] = {0}; /* a zero direction is no ray, even inside a Gaussian */
    const ray_image rays = {
        .width = 1, .height = 1, .origin = store, .dir = store + 3, .common_origin = true};
    double rgb[3], T, d[GAUSSIANS_FIELD_COUNT] = {0};
    assert_ok(reference_forward(&g, &s, &rays, rgb, &T, NULL, NULL));
    assert_near(T, 1, 0);
    assert_near(rgb[1], 0.5, 0);
    assert_ok(reference_backward(&g, &s, &rays, (double[3]){1, 2, 3}, (double[1]){1}, d, NULL));
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        assert_near(d[f], 0, 0);
    gaussians_free(&g);
}

/* alpha_min belongs to the kept side; the next smaller float does not. */
static void the_cut_is_inclusive(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(2, s.alpha_min);
    g.opacity[1] = nextafterf(s.alpha_min, 0);
    reference_hit *hits = NULL;
    size_t count, capacity = 0;
    assert_ok(reference_ray_hits(&g, &s, (double[3]){0, 0, -4}, (double[3]){0, 0, 1}, &hits, &count,
                                 &capacity, NULL));
    assert_int_equal(count, 1);
    assert_int_equal(hits[0].id, 0);
    mem_free(hits);
    gaussians_free(&g);
}

static void opacity_is_cut_at_alpha_max(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(1, 1);
    float store[6];
    ray_image rays = one_ray(store, 0, 0, -4);
    double rgb[3], T, d[GAUSSIANS_FIELD_COUNT] = {0};
    assert_ok(reference_forward(&g, &s, &rays, rgb, &T, NULL, NULL));
    assert_near(T, 1 - (double)s.alpha_max, 0);
    store[0] = 0.1f; /* off the centre: without the cut, mean, scale and opacity would all get a gradient */
    assert_ok(reference_backward(&g, &s, &rays, (double[3]){1, 1, 1}, (double[1]){1}, d, NULL));
    for (int f = 0; f < REFERENCE_red; f++)
        assert_near(d[f], 0, 0);
    for (int f = REFERENCE_red; f <= REFERENCE_blue; f++)
        assert_near(d[f], (double)s.alpha_max, 0);
    store[0] = 0.2f; /* exp(-0.02) = 0.980: open again */
    assert_ok(reference_backward(&g, &s, &rays, (double[3]){1, 1, 1}, NULL, d, NULL));
    assert_near(d[REFERENCE_opacity], 3 * exp(-0.02), 1e-7);
    assert_true(d[REFERENCE_mean_x] > 0.1);
    gaussians_free(&g);
}

static void forty_faint_ones(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(40, 0.01f);
    const seen a = look(&g, &s, 0, 0, -4);
    assert_near(a.T, 0.668972, 1e-6);
    assert_int_equal(a.blended, 40);
    gaussians_free(&g);
}

/* T = 0.5^n: 2^-13 = 1.22e-4 is still allowed, the 14th layer would make 6.1e-5 and is not added. */
static void stops_before_transmittance_min(void **state)
{
    (void)state;
    trace_settings s = trace_settings_default();
    s.background[2] = 1;
    gaussians g = some(20, 0.5f);
    const seen a = look(&g, &s, 0, 0, -4);
    assert_int_equal(a.blended, 13);
    assert_near(a.T, 0x1p-13, 0);
    assert_near(a.rgb[0], 1 - 0x1p-13, 1e-16);
    assert_near(a.rgb[2], 1, 1e-16); /* the background gets the rest */
    s.transmittance_min = 0x1p-13f;  /* reaching the limit exactly is allowed */
    assert_int_equal(look(&g, &s, 0, 0, -4).blended, 13);
    s.transmittance_min = nextafterf(0x1p-13f, 1);
    assert_int_equal(look(&g, &s, 0, 0, -4).blended, 12);
    /* Stopped means stopped: a faint one behind the refused one is not added either. */
    s.transmittance_min = 0x1p-13f;
    g.opacity[14] = 0.01f;
    assert_int_equal(look(&g, &s, 0, 0, -4).blended, 13);
    gaussians_free(&g);
}

static void broken_gaussians_are_not_seen(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(8, 0.5f);
    g.mean_x[0] = NAN;
    g.scale_y[1] = 0;
    g.scale_x[2] = NAN;
    g.quat_w[3] = NAN;
    g.opacity[4] = NAN;
    g.mean_z[5] = INFINITY;
    g.opacity[6] = -1;
    const seen a = look(&g, &s, 0, 0, -4);
    assert_int_equal(a.blended, 1);
    assert_near(a.rgb[0], 0.5, 0);
    gaussians_free(&g);
}

enum { SCENES = 200, SCENE_MAX = 12, LIST_MAX = SCENE_MAX };

typedef struct random_scene {
    gaussians g;
    reference_scene scene;
    trace_settings s;
    float store[6];
    ray_image rays;
    double d_rgb[3], d_T;
} random_scene;

/* 1 to 12 Gaussians around the ray; some behind the origin (the clipped branch), some cut at alpha_max, some
   below alpha_min. */
static void make_random(random_scene *r, uint64_t seed)
{
    memset(r, 0, sizeof *r);
    uint64_t at = 0;
#define UNIFORM(lo, hi) ((lo) + ((hi) - (lo)) * rng_uniform(seed, 1, at++))
    const size_t count = 1 + (size_t)(rng_uniform(seed, 0, 0) * SCENE_MAX);
    assert_ok(gaussians_resize(&r->g, count, NULL));
    for (size_t i = 0; i < count; i++) {
        gaussians *g = &r->g;
        g->mean_x[i] = UNIFORM(-0.5f, 0.5f);
        g->mean_y[i] = UNIFORM(-0.5f, 0.5f);
        g->mean_z[i] = UNIFORM(-0.5f, 4.0f);
        g->scale_x[i] = expf(UNIFORM(-2.0f, 0.5f));
        g->scale_y[i] = expf(UNIFORM(-2.0f, 0.5f));
        g->scale_z[i] = expf(UNIFORM(-2.0f, 0.5f));
        double q[4], length = 0;
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(seed, 2 + k, i);
            length += q[k] * q[k];
        }
        length = sqrt(length);
        g->quat_w[i] = (float)(q[0] / length);
        g->quat_x[i] = (float)(q[1] / length);
        g->quat_y[i] = (float)(q[2] / length);
        g->quat_z[i] = (float)(q[3] / length);
        g->opacity[i] = UNIFORM(0.05f, 1.1f);
        g->red[i] = UNIFORM(-0.2f, 1.2f);
        g->green[i] = UNIFORM(0.0f, 1.0f);
        g->blue[i] = UNIFORM(0.0f, 1.0f);
    }
    gaussians_pad(&r->g);
    assert_ok(reference_scene_make(&r->g, &r->scene, NULL));
    for (size_t i = 0; i < count; i++) { /* unit in double as well */
        double *q = r->scene.fields + REFERENCE_quat_w * count + i, length = 0;
        for (size_t k = 0; k < 4; k++)
            length += q[k * count] * q[k * count];
        for (size_t k = 0; k < 4; k++)
            q[k * count] /= sqrt(length);
    }
    r->s = trace_settings_default();
    for (int c = 0; c < 3; c++) {
        r->s.background[c] = UNIFORM(0.0f, 1.0f);
        r->d_rgb[c] = rng_normal(seed, 9, (uint64_t)c);
    }
    r->d_T = rng_normal(seed, 10, 0);
    r->rays = one_ray(r->store, 0, 0, 0);
    double dir[3] = {(double)UNIFORM(-0.1f, 0.1f), (double)UNIFORM(-0.1f, 0.1f), 1};
    dvec_normalize(dir);
    for (int k = 0; k < 3; k++)
        r->store[3 + k] = (float)dir[k];
#undef UNIFORM
}

static double loss(const random_scene *r)
{
    double rgb[3], T;
    assert_ok(reference_scene_forward(&r->scene, &r->s, &r->rays, rgb, &T, NULL, NULL));
    return dvec_dot(rgb, r->d_rgb) + T * r->d_T;
}

/* What must not change under a perturbation: which hits, in which order, how many blended, which of them cut
   at alpha_max or at t_near. */
static void hit_list_of(const random_scene *r, uint64_t list[LIST_MAX + 2])
{
    reference_hit *hits = NULL;
    size_t count, capacity = 0;
    double rgb[3];
    uint32_t blended;
    double origin[3], dir[3];
    for (int k = 0; k < 3; k++) {
        origin[k] = (double)r->store[k];
        dir[k] = (double)r->store[3 + k];
    }
    memset(list, 0, (LIST_MAX + 2) * sizeof *list);
    assert_ok(reference_scene_ray_hits(&r->scene, &r->s, origin, dir, &hits, &count, &capacity, NULL));
    assert_ok(reference_scene_forward(&r->scene, &r->s, &r->rays, rgb, NULL, &blended, NULL));
    list[0] = count;
    list[1] = blended;
    for (size_t i = 0; i < count; i++)
        list[2 + i] = 4 * (uint64_t)hits[i].id + 2 * (hits[i].alpha == (double)r->s.alpha_max) +
                      (hits[i].t == (double)r->s.t_near);
    mem_free(hits);
}

enum { CLASS_MEAN, CLASS_SCALE, CLASS_ROTATION, CLASS_OPACITY, CLASS_COLOR, CLASS_COUNT };

/* q (0, e_k) for k = 0, 1, 2: the directions in which a quaternion stays unit. `stride` is the distance
   between its components. */
static void tangents(const double *q, size_t stride, double out[3][4])
{
    const double w = q[0], x = q[stride], y = q[2 * stride], z = q[3 * stride];
    const double rows[3][4] = {{-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    memcpy(out, rows, sizeof rows);
}

/* Move parameter `k` of one class of Gaussian `i` by `h`; a rotation turns about local axis k, with the
   quaternion normalised again. */
static void perturb(random_scene *r, int class, size_t i, size_t k, double h)
{
    static const enum reference_field first[] = {REFERENCE_mean_x, REFERENCE_scale_x, REFERENCE_quat_w,
                                                 REFERENCE_opacity, REFERENCE_red};
    const size_t n = r->scene.count;
    double *p = r->scene.fields + first[class] * n + i;
    if (class != CLASS_ROTATION) {
        p[k * n] += h;
        return;
    }
    double tangent[3][4];
    tangents(p, n, tangent);
    for (size_t c = 0; c < 4; c++)
        p[c * n] = (p[c * n] + h * tangent[k][c]) / sqrt(1 + h * h);
}

static void gradients_agree_with_differences(void **state)
{
    (void)state;
    static const char *const names[CLASS_COUNT] = {"mean", "scale", "rotation", "opacity", "colour"};
    static const size_t widths[CLASS_COUNT] = {3, 3, 3, 1, 3};
    static const enum reference_field first[] = {REFERENCE_mean_x, REFERENCE_scale_x, REFERENCE_quat_w,
                                                 REFERENCE_opacity, REFERENCE_red};
    double worst[CLASS_COUNT] = {0};
    size_t tested[CLASS_COUNT] = {0}, skipped = 0, near_hits = 0, cut_hits = 0, hit_total = 0;
    for (uint64_t seed = 0; seed < SCENES; seed++) {
        random_scene r;
        float near = 0, T_front = 0.3f;
        make_random(&r, seed);
        if (seed % 2 == 1) { /* something lies in front of them all */
            r.rays.near = &near;
            r.rays.T_front = &T_front;
        }
        const size_t n = r.scene.count;
        double *d = mem_calloc(n, GAUSSIANS_FIELD_COUNT * sizeof *d, "test", NULL);
        assert_ok(reference_scene_backward(&r.scene, &r.s, &r.rays, r.d_rgb, &r.d_T, d, NULL));
        uint64_t list[LIST_MAX + 2], moved[LIST_MAX + 2];
        hit_list_of(&r, list);
        hit_total += list[0];
        for (size_t i = 0; i < list[0]; i++) {
            near_hits += list[2 + i] & 1;
            cut_hits += list[2 + i] >> 1 & 1;
        }
        for (size_t i = 0; i < n; i++) {
            double *const q = r.scene.fields + REFERENCE_quat_w * n + i, *const d_q =
                                                                             d + REFERENCE_quat_w * n + i;
            double along = 0;
            for (size_t c = 0; c < 4; c++)
                along += q[c * n] * d_q[c * n];
            assert_near(along, 0, 1e-14 * (1 + fabs(d_q[0]))); /* tangent */
            for (int class = 0; class < CLASS_COUNT; class ++)
                for (size_t k = 0; k < widths[class]; k++) {
                    double got = d[(first[class] + k) * n + i];
                    if (class == CLASS_ROTATION) {
                        double tangent[3][4];
                        tangents(q, n, tangent);
                        got = d_q[0] * tangent[k][0] + d_q[n] * tangent[k][1] + d_q[2 * n] * tangent[k][2] +
                              d_q[3 * n] * tangent[k][3];
                    }
                    double keep[GAUSSIANS_FIELD_COUNT], value[2];
                    bool same = true;
                    for (size_t f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
                        keep[f] = r.scene.fields[f * n + i];
                    const double h = 1e-6;
                    for (int side = 0; side < 2; side++) {
                        perturb(&r, class, i, k, side == 0 ? -h : h);
                        value[side] = loss(&r);
                        hit_list_of(&r, moved);
                        same = same && memcmp(list, moved, sizeof list) == 0;
                        for (size_t f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
                            r.scene.fields[f * n + i] = keep[f];
                    }
                    if (!same) {
                        skipped++;
                        continue;
                    }
                    tested[class]++;
                    const double wanted = (value[1] - value[0]) / (2 * h),
                                 error = fabs(got - wanted) / fmax(0.01, fabs(wanted));
                    worst[class] = fmax(worst[class], error);
                    if (!(error <= 1e-6))
                        fail_msg("seed %d, Gaussian %zu of %zu, %s %zu: %.12g, difference %.12g", (int)seed,
                                 i, n, names[class], k, got, wanted);
                }
        }
        mem_free(d);
        reference_scene_free(&r.scene);
        gaussians_free(&r.g);
    }
    for (int class = 0; class < CLASS_COUNT; class ++) {
        print_message("%-8s worst error %.1e of max(0.01, |difference|) in %zu\n", names[class], worst[class],
                      tested[class]);
        assert_true(tested[class] > 500);
    }
    print_message("%zu skipped; %zu hits, %zu at t_near, %zu cut at alpha_max\n", skipped, hit_total,
                  near_hits, cut_hits);
    assert_true(skipped < 20 && near_hits > 20 && cut_hits > 5 && hit_total > 300);
}

/* The same numbers from the float entries, for many rays with own origins, and for 1, 2 and 3 threads. */
static void float_entries_and_threads(void **state)
{
    (void)state;
    enum { W = 37, H = 11, RAYS = W * H };
    random_scene r;
    uint64_t seed = 1000;
    make_random(&r, seed);
    while (r.g.count < 8) {
        reference_scene_free(&r.scene);
        gaussians_free(&r.g);
        make_random(&r, ++seed);
    }
    static float origin[RAYS * 3], dir[RAYS * 3];
    static double d_rgb[RAYS * 3], d_T[RAYS], rgb[3][RAYS * 3], T[3][RAYS];
    static uint32_t blended[3][RAYS];
    for (size_t i = 0; i < RAYS; i++) {
        double d[3] = {rng_normal(1, 0, i) * 0.1, rng_normal(1, 1, i) * 0.1, 1};
        dvec_normalize(d);
        for (size_t k = 0; k < 3; k++)
            origin[3 * i + k] = 0.2f * rng_uniform(2, k, i), dir[3 * i + k] = i == 5 ? 0 : (float)d[k],
                           d_rgb[3 * i + k] = rng_normal(3, k, i);
        d_T[i] = rng_normal(4, 0, i);
    }
    const ray_image rays = {.width = W, .height = H, .origin = origin, .dir = dir};
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        assert_ok(reference_forward(&r.g, &r.s, &rays, rgb[threads - 1], T[threads - 1], blended[threads - 1],
                                    NULL));
    }
    assert_memory_equal(rgb[0], rgb[1], sizeof rgb[0]);
    assert_memory_equal(rgb[0], rgb[2], sizeof rgb[0]);
    assert_memory_equal(T[0], T[2], sizeof T[0]);
    assert_memory_equal(blended[0], blended[2], sizeof blended[0]);
    assert_near(T[0][5], 1, 0);
    /* The adjoint of all rays is the sum over rays, each seen alone. */
    const size_t n = r.g.count;
    double *all = mem_calloc(n, GAUSSIANS_FIELD_COUNT * sizeof *all, "test", NULL);
    double *sum = mem_calloc(n, GAUSSIANS_FIELD_COUNT * sizeof *sum, "test", NULL);
    assert_ok(reference_backward(&r.g, &r.s, &rays, d_rgb, d_T, all, NULL));
    for (size_t i = 0; i < RAYS; i++) {
        const ray_image one = {
            .width = 1, .height = 1, .origin = origin + 3 * i, .dir = dir + 3 * i, .common_origin = true};
        double rgb_one[3];
        assert_ok(reference_forward(&r.g, &r.s, &one, rgb_one, NULL, NULL, NULL));
        assert_memory_equal(rgb_one, rgb[0] + 3 * i, sizeof rgb_one);
        assert_ok(reference_backward(&r.g, &r.s, &one, d_rgb + 3 * i, d_T + i, sum, NULL));
    }
    for (size_t i = 0; i < n * GAUSSIANS_FIELD_COUNT; i++)
        assert_near(all[i], sum[i], 0); /* in ray order: the same bits */
    mem_free(all);
    mem_free(sum);
    reference_scene_free(&r.scene);
    gaussians_free(&r.g);
}

static gbt_camera plain_camera(void)
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = 4,
                        .height = 4,
                        .params = {4, 4, 2, 2},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static void memory_runs_out(void **state)
{
    (void)state;
    const trace_settings s = trace_settings_default();
    gaussians g = some(3, 0.5f);
    float store[6];
    const ray_image rays = one_ray(store, 0, 0, -4);
    double rgb[3], d[3 * GAUSSIANS_FIELD_COUNT] = {0};
    const gbt_camera camera = plain_camera();
    for (int entry = 0; entry < 4; entry++) {
        gbt_status status = GBT_ERR_NO_MEMORY;
        long k = 0;
        for (; status != GBT_OK; k++) {
            gbt_error err = {0};
            reference_hit *hits = NULL;
            size_t count = 7, capacity = 0;
            ray_image made = {0};
            mem_fail_after(k);
            if (entry == 0)
                status = reference_forward(&g, &s, &rays, rgb, NULL, NULL, &err);
            else if (entry == 1)
                status = reference_backward(&g, &s, &rays, (double[3]){1, 1, 1}, NULL, d, &err);
            else if (entry == 2)
                status = reference_ray_hits(&g, &s, (double[3]){0, 0, -4}, (double[3]){0, 0, 1}, &hits,
                                            &count, &capacity, &err);
            else
                status = ray_image_from_camera(&camera, &made, &err);
            mem_fail_after(-1);
            assert_true(status == GBT_OK ||
                        (status == GBT_ERR_NO_MEMORY && err.status == status && err.text[0] != '\0'));
            if (status != GBT_OK && entry == 3)
                assert_true(made.dir == NULL && made.origin == NULL);
            if (status != GBT_OK && entry == 2)
                assert_int_equal(count, 0);
            mem_free(hits);
            ray_image_free(&made);
            assert_true(k < 20);
        }
        assert_true(k > 2);
    }
    gaussians_free(&g);
}

/* A turned, shifted camera: every ray is the unprojected pixel centre, turned to the world. */
static void rays_of_every_model(void **state)
{
    (void)state;
    static const struct {
        gbt_camera_model model;
        double params[GBT_CAMERA_MAX_PARAMS];
    } rows[] = {
        {GBT_CAMERA_PINHOLE, {50, 55, 31, 22}},
        {GBT_CAMERA_SIMPLE_PINHOLE, {50, 31, 22}},
        {GBT_CAMERA_SIMPLE_RADIAL, {50, 31, 22, -0.5}}, /* folds inside the image: some pixels have no ray */
        {GBT_CAMERA_OPENCV, {50, 55, 31, 22, -0.1, 0.02, 0.003, -0.002}},
        {GBT_CAMERA_FULL_OPENCV, {50, 55, 31, 22}},
        {GBT_CAMERA_OPENCV_FISHEYE, {8, 8, 31, 22, 0.01}}, /* the corners are beyond 180 degrees */
        {GBT_CAMERA_EQUIRECTANGULAR, {61, 43}},
    };
    const double q[4] = {0.5, -0.5, 0.1, sqrt(0.49)};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        gbt_camera camera = {.model = rows[k].model, .width = 61, .height = 43, .center = {1, -2, 3.5}};
        memcpy(camera.params, rows[k].params, sizeof camera.params);
        dquat_to_matrix(q, camera.rotation);
        ray_image rays[2] = {{0}};
        for (int t = 0; t < 2; t++) {
            parallel_set_threads(1 + t);
            assert_ok(ray_image_from_camera(&camera, &rays[t], NULL));
        }
        assert_memory_equal(rays[0].dir, rays[1].dir, 3 * sizeof(float) * ray_image_count(&rays[0]));
        assert_true(rays[0].common_origin && rays[0].width == 61 && rays[0].height == 43);
        assert_near((double)rays[0].origin[2], 3.5, 0);
        size_t none = 0;
        for (int y = 0; y < 43; y++)
            for (int x = 0; x < 61; x++) {
                const float *got = rays[0].dir + 3 * (61 * y + x);
                double d[3] = {0, 0, 0};
                if (gbt_camera_unproject(&camera, x + 0.5, y + 0.5, d))
                    dmat_apply_transposed(camera.rotation, d, d);
                else
                    none++;
                for (int axis = 0; axis < 3; axis++)
                    assert_near((double)got[axis], d[axis], 6.0e-8);
                if (dvec_length(d) == 0)
                    assert_true(got[0] == 0 && got[1] == 0 && got[2] == 0);
            }
        const bool partial =
            rows[k].model == GBT_CAMERA_SIMPLE_RADIAL || rows[k].model == GBT_CAMERA_OPENCV_FISHEYE;
        assert_true(partial ? none > 20 && none < 61 * 43 / 2 : none == 0);
        ray_image_free(&rays[0]);
        ray_image_free(&rays[1]);
        assert_null(rays[0].dir);
    }
}

static void cameras_that_cannot_make_rays(void **state)
{
    (void)state;
    const gbt_camera good = plain_camera();
    gbt_camera bad[6];
    for (int i = 0; i < 6; i++)
        bad[i] = good;
    bad[0].width = 0;
    bad[1].height = -1;
    bad[2].params[0] = 0;
    bad[3].model = GBT_CAMERA_MODEL_COUNT;
    bad[4].rotation[4] = NAN;
    bad[5].center[0] = 1e39;
    for (int i = 0; i < 6; i++) {
        ray_image rays = {0};
        gbt_error err = {0};
        assert_int_equal(ray_image_from_camera(&bad[i], &rays, &err), GBT_ERR_ARGUMENT);
        assert_null(rays.dir);
        assert_true(err.text[0] != '\0');
    }
}

/* ---- the spread term ---- */

enum { SPREAD_RAYS = 64 };

typedef struct spread_job {
    const trace_settings *s;
    double of_ray[SPREAD_RAYS];
} spread_job;

static void spread_of_ray(void *context, size_t ray, const reference_hit *hits, size_t count)
{
    spread_job *job = context;
    const double t_near = (double)job->s->t_near;
    double T = 1, sum = 0;
    for (size_t i = 0; i < count; T *= 1 - hits[i].alpha, i++) {
        double T_j = T * (1 - hits[i].alpha);
        for (size_t j = i + 1; j < count; T_j *= 1 - hits[j].alpha, j++)
            sum += 2 * T * hits[i].alpha * T_j * hits[j].alpha *
                   (t_near / fmax(hits[i].t, t_near) - t_near / fmax(hits[j].t, t_near));
    }
    job->of_ray[ray] = (double)job->s->spread * sum;
}

static double spread_of_all(const reference_scene *scene, const trace_settings *s, const ray_image *rays)
{
    spread_job job = {.s = s};
    double sum = 0;
    assert_ok(reference_scene_visit(scene, s, rays, NULL, spread_of_ray, &job, NULL));
    for (int i = 0; i < SPREAD_RAYS; i++)
        sum += job.of_ray[i];
    return sum;
}

/* With opacities, which change weights and no depth, its gradient is that of what it is defined as. */
static void spread_agrees_with_differences(void **state)
{
    (void)state;
    enum { COUNT = 12 };
    trace_settings s = trace_settings_default();
    s.packet_order = true;
    s.spread = 0.7f;
    s.t_near = 2;
    s.alpha_min = 1e-6f;
    gaussians g = some(COUNT, 0.4f);
    for (int i = 0; i < COUNT; i++) {
        g.mean_x[i] = 0.1f * (float)(i % 3 - 1);
        g.mean_z[i] = 3 + 0.5f * (float)((i * 5) % COUNT);
        g.opacity[i] = 0.1f + 0.05f * (float)i;
    }
    const gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                               .width = 8,
                               .height = 8,
                               .params = {8, 8, 4, 4},
                               .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    assert_int_equal(ray_image_count(&rays), SPREAD_RAYS);
    reference_scene scene;
    assert_ok(reference_scene_make(&g, &scene, NULL));
    double *d = mem_calloc(COUNT, GAUSSIANS_FIELD_COUNT * sizeof *d, "test", NULL),
           *none = mem_calloc(SPREAD_RAYS, 3 * sizeof *none, "test", NULL);
    assert_ok(reference_scene_backward(&scene, &s, &rays, none, NULL, d, NULL));
    for (size_t i = 0; i < COUNT; i++) {
        const double h = 1e-6, got = d[REFERENCE_opacity * COUNT + i];
        double *opacity = &scene.fields[REFERENCE_opacity * COUNT + i], side[2];
        for (int k = 0; k < 2; k++) {
            *opacity += (k == 0 ? 1 : -2) * h;
            side[k] = spread_of_all(&scene, &s, &rays);
        }
        *opacity += h;
        assert_true(fabs(got) > 1e-3);
        assert_near(got, (side[0] - side[1]) / (2 * h), 1e-7 * fabs(got) + 1e-8);
    }
    mem_free(none);
    mem_free(d);
    reference_scene_free(&scene);
    ray_image_free(&rays);
    gaussians_free(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults),
        cmocka_unit_test(through_the_centre_alpha_is_opacity),
        cmocka_unit_test(rotation_and_scale_in_closed_form),
        cmocka_unit_test(layers_multiply),
        cmocka_unit_test(camera_inside),
        cmocka_unit_test(ties_go_by_id),
        cmocka_unit_test(nothing_there),
        cmocka_unit_test(the_cut_is_inclusive),
        cmocka_unit_test(opacity_is_cut_at_alpha_max),
        cmocka_unit_test(forty_faint_ones),
        cmocka_unit_test(stops_before_transmittance_min),
        cmocka_unit_test(broken_gaussians_are_not_seen),
        cmocka_unit_test(gradients_agree_with_differences),
        cmocka_unit_test(spread_agrees_with_differences),
        cmocka_unit_test(float_entries_and_threads),
        cmocka_unit_test(memory_runs_out),
        cmocka_unit_test(rays_of_every_model),
        cmocka_unit_test(cameras_that_cannot_make_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
