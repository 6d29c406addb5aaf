/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_kernels.c -- every kernel against the double reference: picture, order, outputs beside
   colour, surfaces, radius, memory. */
#include "base/memory.h"
#include "base/near.h"
#include "base/rng.h"
#include "base/vec.h"
#include "test_support.h"
#include "trace/fixture.h"
#include "reference_once.h"
#include "trace/ray_hits.h"
#include "trace/tree_rows16.h"
#include "trace/trace.h"

enum { WIDTH = 40, HEIGHT = 24, RAYS = WIDTH * HEIGHT };

static gaussians cloud(size_t count, uint64_t seed, float spread, float size, float opacity)
{
    gaussians g = some(count, 0);
    for (size_t i = 0; i < count; i++) {
        double q[4], square = 0;
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(seed, k, i);
            square += q[k] * q[k];
        }
        const float inverse = (float)(1 / sqrt(square));
        g.quat_w[i] = (float)q[0] * inverse, g.quat_x[i] = (float)q[1] * inverse,
        g.quat_y[i] = (float)q[2] * inverse, g.quat_z[i] = (float)q[3] * inverse;
        g.mean_x[i] = spread * (float)rng_normal(seed, 4, i),
        g.mean_y[i] = spread * (float)rng_normal(seed, 5, i),
        g.mean_z[i] = spread * (float)rng_normal(seed, 6, i);
        g.scale_x[i] = size * powf(4, rng_uniform(seed, 7, i) - 0.5f);
        g.scale_y[i] = size * powf(4, rng_uniform(seed, 8, i) - 0.5f);
        g.scale_z[i] = 0.2f * size; /* flat, as trained ones are */
        g.opacity[i] = opacity * rng_uniform(seed, 9, i);
        g.red[i] = rng_uniform(seed, 10, i);
        g.green[i] = rng_uniform(seed, 11, i);
        g.blue[i] = rng_uniform(seed, 12, i);
    }
    gaussians_pad(&g);
    return g;
}

/* A pinhole's rays; or, spread, from points of a small disc, as through a lens. */
static ray_image make_rays(bool spread)
{
    ray_image rays = {0};
    assert_ok(ray_image_reserve(&rays, WIDTH, HEIGHT, !spread, NULL));
    for (size_t i = 0; i < RAYS; i++) {
        double d[3] = {((double)(i % WIDTH) - WIDTH / 2.0) * 0.02,
                       ((double)(i / WIDTH) - HEIGHT / 2.0) * 0.02, 1};
        if (spread)
            for (size_t k = 0; k < 3; k++)
                rays.origin[3 * i + k] = (float)(k == 2 ? -5 : 0.05 * rng_normal(77, k, i)),
                                    d[k] -= k == 2 ? 0 : (double)rays.origin[3 * i + k] / 5;
        dvec_normalize(d);
        for (size_t k = 0; k < 3; k++)
            rays.dir[3 * i + k] = (float)d[k];
    }
    if (!spread) {
        rays.origin[0] = 0.3f;
        rays.origin[1] = -0.2f;
        rays.origin[2] = -5;
    }
    return rays;
}

typedef struct pass_result {
    image rgb;
    float transmittance[RAYS], depth[RAYS], median[RAYS], normal[3 * RAYS], hit_count[RAYS];
    uint32_t strongest[RAYS];
    gaussians d;
    kernel_counters counters;
} pass_result;

static pass_result *run(const gaussians *g, const trace_settings *s, const ray_image *rays,
                        trace_kernel kernel, size_t tape_bytes_max)
{
    pass_result *r = mem_calloc(1, sizeof *r, "test", NULL);
    trace_scene scene = {.kernel = kernel, .tape_bytes_max = tape_bytes_max};
    image d_rgb;
    assert_ok(image_alloc(&r->rgb, WIDTH, HEIGHT, 3, NULL));
    assert_ok(image_alloc(&d_rgb, WIDTH, HEIGHT, 3, NULL));
    for (size_t i = 0; i < 3 * RAYS; i++)
        d_rgb.pixels[i] = (float)rng_normal(5, 5, i);
    const trace_outputs out = {.rgb = &r->rgb,
                               .transmittance = r->transmittance,
                               .depth = r->depth,
                               .median_depth = r->median,
                               .normal = r->normal,
                               .hit_count = r->hit_count,
                               .strongest = r->strongest};
    assert_ok(trace_build(&scene, g, s, 5, NULL));
    assert_ok(trace_forward(&scene, rays, true, &out, &r->counters, NULL));
    assert_ok(trace_backward(&scene, rays, &d_rgb, &r->d, NULL, NULL));
    trace_scene_free(&scene);
    image_free(&d_rgb);
    return r;
}

static void pass_free(pass_result *r)
{
    image_free(&r->rgb);
    gaussians_free(&r->d);
    mem_free(r);
}

/* What the reference says of one ray, beside its colour; `fine` is false where rounding may decide
   something. */
typedef struct expected {
    double rgb[3], transmittance, depth, median, hit_count, normal[3];
    uint32_t strongest;
    bool fine;
} expected;

static expected expect_ray(const gaussians *g, const trace_settings *s, const ray_image *rays, size_t ray,
                           reference_hit **hits, size_t *capacity)
{
    expected e = {.transmittance = 1, .strongest = UINT32_MAX, .fine = true};
    double origin[3], dir[3], top = 0, second = 0, before = -1;
    size_t count;
    trace_settings loose = *s;
    loose.alpha_min *= 0.999f;
    for (size_t k = 0; k < 3; k++) {
        origin[k] = (double)ray_image_origin(rays, ray)[k];
        dir[k] = (double)rays->dir[3 * ray + k];
    }
    assert_ok(reference_ray_hits(g, &loose, origin, dir, hits, &count, capacity, NULL));
    const double far = rays->far == NULL ? HUGE_VAL : (double)rays->far[ray];
    for (size_t i = 0; i < count; i++) {
        const reference_hit *h = &(*hits)[i];
        e.fine = e.fine && fabs(h->alpha - (double)s->alpha_min) > 1e-6 && fabs(h->t - far) > 1e-5;
        if (h->alpha < (double)s->alpha_min || h->t >= far)
            continue;
        e.fine = e.fine && h->t - before > 2e-6 * h->t;
        before = h->t;
        const double weight = e.transmittance * h->alpha, next = e.transmittance * (1 - h->alpha);
        e.fine = e.fine && fabs(next - (double)s->transmittance_min) > 1e-8 && fabs(next - 0.5) > 1e-5;
        if (next < (double)s->transmittance_min)
            break;
        const float color[3] = {g->red[h->id], g->green[h->id], g->blue[h->id]};
        const double q[4] = {(double)g->quat_w[h->id], (double)g->quat_x[h->id], (double)g->quat_y[h->id],
                             (double)g->quat_z[h->id]};
        double m[9];
        dquat_to_matrix(q, m);
        const double axis[3] = {m[2], m[5], m[8]},
                     facing = dvec_dot(axis, dir); /* z is the shortest axis of cloud() */
        e.fine = e.fine && fabs(facing) > 1e-5;
        for (int k = 0; k < 3; k++) {
            e.rgb[k] += weight * (double)color[k];
            e.normal[k] += (facing < 0 ? weight : -weight) * axis[k];
        }
        e.depth += weight * h->t;
        e.hit_count++;
        if (next < 0.5 && e.median == 0)
            e.median = h->t;
        if (weight > top) {
            second = top;
            top = weight;
            e.strongest = h->id;
        } else
            second = fmax(second, weight);
        e.transmittance = next;
    }
    e.fine = e.fine && top - second > (top > 0 ? 1e-5 : -1);
    for (int k = 0; k < 3; k++)
        e.rgb[k] += e.transmittance * (double)s->background[k];
    e.depth = e.transmittance < 1 ? e.depth / (1 - e.transmittance) : 0;
    return e;
}

static void check_run(const char *name, const gaussians *g, const trace_settings *s, const ray_image *rays,
                      const pass_result *r)
{
    reference_hit *hits = NULL;
    size_t capacity = 0, left_out = 0;
    for (size_t i = 0; i < RAYS; i++) {
        const expected e = expect_ray(g, s, rays, i, &hits, &capacity);
        if (!e.fine) {
            left_out++;
            continue;
        }
        for (size_t k = 0; k < 3; k++) {
            assert_near((double)r->rgb.pixels[3 * i + k], e.rgb[k], 2e-5);
            assert_near((double)r->normal[3 * i + k], e.normal[k], 2e-5);
        }
        assert_near((double)r->transmittance[i], e.transmittance, 2e-5);
        assert_near((double)r->depth[i], e.depth, 1e-4 * (1 + e.depth));
        assert_near((double)r->median[i], e.median, 1e-5 * (1 + e.median));
        assert_near((double)r->hit_count[i], e.hit_count, 0);
        assert_int_equal(r->strongest[i], e.strongest);
    }
    mem_free(hits);
    if (left_out * 4 > RAYS)
        fail_msg("%s: %zu of %d rays are within rounding of a cut", name, left_out, RAYS);
}

static const char *const kernel_names[] = {"list", "tree", "single", "embree"};

static void all_kernels_all_outputs(void **state)
{
    (void)state;
    const struct {
        const char *name;
        size_t count;
        float spread, size, opacity;
    } rows[] = {{"thin", 300, 1, 0.15f, 0.7f},
                {"opaque", 1500, 0.7f, 0.1f, 1},
                {"around the camera", 400, 4, 0.5f, 0.6f},
                {"through one another", 500, 0.02f, 0.5f, 0.03f}}; /* in another order on every ray */
    trace_settings s = trace_settings_default();
    s.background[0] = 0.2f;
    s.background[2] = 0.7f;
    for (size_t i = 0; i < 4; i++)
        for (int spread = 0; spread < 2; spread++) {
            gaussians g = cloud(rows[i].count, i, rows[i].spread, rows[i].size, rows[i].opacity);
            ray_image rays = make_rays(spread == 1);
            for (int kernel = TRACE_LIST; kernel <= TRACE_EMBREE; kernel++) {
                pass_result *r = run(&g, &s, &rays, (trace_kernel)kernel, 0);
                check_run(rows[i].name, &g, &s, &rays, r);
                assert_true(i < 3 || kernel != TRACE_LIST || r->counters.spilled_packets > 0 || spread == 1);
                assert_true(r->counters.hits >= r->counters.blended && r->counters.blended > RAYS);
                pass_free(r);
            }
            ray_image_free(&rays);
            gaussians_free(&g);
        }
}

/* Where next to nothing of a Gaussian is hit, its depth is known all the same. */
static void depth_of_faint_hits(void **state)
{
    (void)state;
    gaussians g = cloud(1, 0, 0, 1, 1);
    ray_image rays = make_rays(false);
    trace_settings s = trace_settings_default();
    s.alpha_min = 1e-5f;
    g.scale_x[0] = g.scale_y[0] = g.scale_z[0] = 0.2f;
    g.opacity[0] = 0.9f;
    const double way[3] = {-0.3, 0.2, 5}; /* from the rays' origin to the Gaussian, which is at 0 */
    for (int kernel = TRACE_LIST; kernel <= TRACE_EMBREE; kernel++) {
        pass_result *r = run(&g, &s, &rays, (trace_kernel)kernel, 0);
        int faint = 0;
        for (size_t i = 0; i < RAYS; i++) {
            const double d[3] = {(double)rays.dir[3 * i], (double)rays.dir[3 * i + 1],
                                 (double)rays.dir[3 * i + 2]},
                         t = dvec_dot(d, way);
            if (r->hit_count[i] > 0)
                assert_near((double)r->depth[i], t, 1e-5 * t);
            faint += r->hit_count[i] > 0 && r->transmittance[i] > 0.9999f;
        }
        assert_true(faint > 10);
        pass_free(r);
    }
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* The adjoint of every kernel's hits is that of the tree kernel, to rounding. */
static void kernels_share_the_adjoint(void **state)
{
    (void)state;
    gaussians g = cloud(800, 3, 0.8f, 0.15f, 0.8f);
    ray_image rays = make_rays(false);
    const trace_settings s = trace_settings_default();
    pass_result *tree = run(&g, &s, &rays, TRACE_TREE, 0);
    for (int kernel = TRACE_LIST; kernel <= TRACE_EMBREE; kernel++) {
        pass_result *other = run(&g, &s, &rays, (trace_kernel)kernel, 0);
        const float *const a[] = {tree->d.mean_x, tree->d.scale_y, tree->d.quat_z, tree->d.opacity,
                                  tree->d.red};
        const float *const b[] = {other->d.mean_x, other->d.scale_y, other->d.quat_z, other->d.opacity,
                                  other->d.red};
        for (size_t f = 0; f < 5; f++) {
            double error = 0, norm = 0;
            for (size_t i = 0; i < g.count; i++) {
                error += pow((double)(a[f][i] - b[f][i]), 2);
                norm += pow((double)a[f][i], 2);
            }
            if (!(error < 1e-8 * norm)) /* a hit at a cut may be on one side here and on the other there: 1e-4
                                         */
                fail_msg("%s: field %zu differs by %.2g", kernel_names[kernel], f, sqrt(error / norm));
        }
        pass_free(other);
    }
    pass_free(tree);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Rays that end at a surface, in front of everything, inside and behind. */
static void surfaces(void **state)
{
    (void)state;
    gaussians g = cloud(600, 8, 0.8f, 0.15f, 0.9f);
    ray_image rays = make_rays(false);
    const trace_settings s = trace_settings_default();
    rays.far = mem_alloc(RAYS, sizeof *rays.far, "test", NULL);
    for (size_t i = 0; i < RAYS; i++)
        rays.far[i] = i % 7 == 0 ? INFINITY : 3 + 4 * rng_uniform(1, 1, i);
    for (int kernel = TRACE_LIST; kernel <= TRACE_EMBREE; kernel++) {
        pass_result *r = run(&g, &s, &rays, (trace_kernel)kernel, 0);
        check_run(kernel_names[kernel], &g, &s, &rays, r);
        pass_free(r);
    }
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Rays in two parts: each as the reference sees it, and both together as whole rays. */
static void parts_of_rays(void **state)
{
    (void)state;
    gaussians g = cloud(900, 9, 0.8f, 0.2f, 0.95f);
    trace_settings s = trace_settings_default();
    ray_image rays = make_rays(false);
    double *wanted = mem_alloc(RAYS, 4 * sizeof *wanted, "test", NULL);
    float *cut = mem_alloc(RAYS, sizeof *cut, "test", NULL), *through[2];
    unsigned char *ended = mem_alloc(RAYS, 1, "test", NULL);
    for (int i = 0; i < 2; i++)
        through[i] = mem_alloc(RAYS, sizeof *through[i], "test", NULL);
    for (size_t i = 0; i < RAYS; i++)
        cut[i] = 3 + 4 * rng_uniform(1, 3, i);
    pass_result *whole = run(&g, &s, &rays, TRACE_LIST, 0);
    trace_scene scene = {.kernel = TRACE_LIST};
    image rgb, sum;
    assert_ok(image_alloc(&rgb, WIDTH, HEIGHT, 3, NULL));
    assert_ok(image_alloc(&sum, WIDTH, HEIGHT, 3, NULL));
    memset(sum.pixels, 0, 3 * RAYS * sizeof *sum.pixels);
    assert_ok(trace_build(&scene, &g, &s, 5, NULL));
    ray_image part = rays;
    part.near = mem_alloc(RAYS, sizeof *part.near, "test", NULL);
    part.far = mem_alloc(RAYS, sizeof *part.far, "test", NULL);
    part.T_front = mem_alloc(RAYS, sizeof *part.T_front, "test", NULL);
    for (int half = 0; half < 2; half++) {
        for (size_t i = 0; i < RAYS; i++) {
            part.near[i] = half == 0 ? 0 : cut[i];
            part.far[i] = half == 0 ? cut[i] : ended[i] != 0 ? 0 : INFINITY;
            part.T_front[i] = half == 0 ? 1 : through[0][i];
        }
        const trace_outputs out = {.rgb = &rgb, .transmittance = through[half], .ended = ended};
        assert_ok(trace_forward(&scene, &part, false, &out, NULL, NULL));
        assert_ok(reference_forward(&g, &s, &part, wanted, wanted + 3 * RAYS, NULL, NULL));
        size_t off = 0;
        for (size_t i = 0; i < RAYS; i++) {
            double error = fabs(wanted[3 * RAYS + i] - (double)through[half][i]);
            for (size_t c = 0; c < 3; c++) {
                error = fmax(error, fabs(wanted[3 * i + c] - (double)rgb.pixels[3 * i + c]));
                sum.pixels[3 * i + c] += rgb.pixels[3 * i + c];
            }
            off += !(error < 2e-5);
        }
        assert_true(off <= RAYS / 200); /* a hit at a cut may be on the other side */
    }
    for (size_t i = 0; i < 3 * RAYS; i++) /* the background is black */
        if (!(fabsf(sum.pixels[i] - whole->rgb.pixels[i]) < 3e-6f))
            fail_msg("%s: value %zu is %g in parts, %g whole", kernel_names[TRACE_LIST], i,
                     (double)sum.pixels[i], (double)whole->rgb.pixels[i]);
    gbt_error err = {0};
    assert_int_equal(trace_forward(&scene, &part, true, &(trace_outputs){.rgb = &rgb}, NULL, &err),
                     GBT_ERR_ARGUMENT); /* there is no adjoint */
    for (int kernel = TRACE_LIST + 1; kernel <= TRACE_EMBREE; kernel++) {
        scene.kernel = (trace_kernel)kernel;
        assert_int_equal(trace_forward(&scene, &part, false, &(trace_outputs){.rgb = &rgb}, NULL, NULL),
                         GBT_ERR_ARGUMENT);
    }
    mem_free(part.near);
    mem_free(part.far);
    mem_free(part.T_front);
    trace_scene_free(&scene);
    image_free(&rgb);
    image_free(&sum);
    pass_free(whole);
    mem_free(wanted);
    mem_free(cut);
    mem_free(ended);
    for (int i = 0; i < 2; i++)
        mem_free(through[i]);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* More near the eye than lists are worth for whole rays: parts of rays never go through the tree. */
static void parts_are_listed_whatever_is_near(void **state)
{
    (void)state;
    enum { SIDE = 1024, ALL = SIDE * SIDE };
    const trace_settings s = trace_settings_default();
    gaussians g = cloud(4200, 9, 0.8f, 0.2f, 1);
    ray_image rays = {0};
    image rgb[2];
    assert_ok(ray_image_reserve(&rays, SIDE, SIDE, true, NULL));
    for (size_t i = 0; i < g.count; i++) { /* large, and so faint that they are seen in a few pixels */
        g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 3;
        g.opacity[i] = 1.0001f * s.alpha_min;
    }
    rays.origin[0] = rays.origin[1] = 0;
    rays.origin[2] = -5;
    for (size_t i = 0; i < ALL; i++) {
        double d[3] = {((double)(i % SIDE) - SIDE / 2) * 1e-3, ((double)(i / SIDE) - SIDE / 2) * 1e-3, 1};
        dvec_normalize(d);
        for (size_t k = 0; k < 3; k++)
            rays.dir[3 * i + k] = (float)d[k];
    }
    trace_scene scene = {0};
    assert_ok(trace_build(&scene, &g, &s, 5, NULL));
    for (int parts = 0; parts < 2; parts++) {
        assert_ok(image_alloc(&rgb[parts], SIDE, SIDE, 3, NULL));
        if (parts == 1) {
            rays.near = mem_calloc(ALL, sizeof *rays.near, "test", NULL);
            rays.T_front = mem_alloc(ALL, sizeof *rays.T_front, "test", NULL);
            for (size_t i = 0; i < ALL; i++)
                rays.T_front[i] = 1;
        }
        assert_ok(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb[parts]}, NULL, NULL));
        assert_int_equal(scene.listed, parts);
    }
    size_t seen = 0, off = 0;
    for (size_t i = 0; i < (size_t)3 * ALL; i++) {
        seen += rgb[1].pixels[i] > 0;
        off += fabsf(rgb[0].pixels[i] - rgb[1].pixels[i]) > 1e-5f;
    }
    assert_true(seen > 100000 && off < seen / 100);
    for (int k = 0; k < 2; k++)
        image_free(&rgb[k]);
    trace_scene_free(&scene);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* Tiles that are traced again for the adjoint give the same bits as those that were kept. */
static void no_room_for_the_tape(void **state)
{
    (void)state;
    gaussians g = cloud(500, 4, 0.8f, 0.2f, 0.8f);
    ray_image rays = make_rays(false);
    trace_settings s = trace_settings_default();
    for (int i = 0; i < 3; i++) {
        const trace_kernel kernel = i == 0 ? TRACE_TREE : TRACE_LIST;
        s.packet_order = i == 2;
        pass_result *kept = run(&g, &s, &rays, kernel, 0), *again = run(&g, &s, &rays, kernel, 1);
        assert_true(kept->counters.tape_bytes > 1000 && again->counters.tape_bytes == 0);
        assert_memory_equal(kept->d.mean_x, again->d.mean_x, g.count * sizeof(float));
        assert_memory_equal(kept->d.quat_y, again->d.quat_y, g.count * sizeof(float));
        assert_memory_equal(kept->d.opacity, again->d.opacity, g.count * sizeof(float));
        pass_free(kept);
        pass_free(again);
    }
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* ---- order ---- */

typedef struct brute_row {
    float t;
    int row;
} brute_row;

static int by_depth(const void *a, const void *b)
{
    const brute_row *x = a, *y = b;
    return x->t != y->t ? (x->t < y->t ? -1 : 1) : x->row - y->row;
}

/* Rows that overlap little, much and wholly, with ties: on every ray, T in front of each hit is the product
   of the hits sorted before it. */
static void rows_are_in_exact_order(void **state)
{
    (void)state;
    enum { COUNT = 90 };
    static _Alignas(64) float t[(COUNT + ROW_BLOCK) * 16], one_minus_alpha[(COUNT + ROW_BLOCK) * 16],
        before[(COUNT + 1) * 16], term[(COUNT + ROW_BLOCK) * 16];
    static _Alignas(64) float after[(COUNT + 1) * 16];
    static float near[COUNT + ROW_BLOCK], far_reached[COUNT], start[COUNT];
    static const float overlaps[] = {0, 0.5f, 3, 1000};
    for (size_t round = 0; round < 4; round++) {
        uint16_t order[COUNT];
        static _Alignas(64) float key[COUNT + 16], raw[COUNT][16];
        for (uint64_t i = 0; i < COUNT; i++) {
            start[i] = 10 + floorf((float)COUNT * rng_uniform(round, 0, i));
            key[i] = INFINITY;
            for (uint64_t lane = 0; lane < 16; lane++) {
                const bool hit = rng_uniform(round, 1, 16 * i + lane) < 0.7f || lane == i % 16;
                /* many ties */
                raw[i][lane] =
                    hit ? start[i] + floorf(8 * overlaps[round] * rng_uniform(round, 2, 16 * i + lane)) / 8
                        : INFINITY;
                key[i] = fminf(key[i], raw[i][lane]);
            }
        }
        rank_keys(key, COUNT, order);
        float reached = 0;
        vfloat16 product = vfloat16_set1(1);
        for (int i = 0; i < COUNT; i++) {
            near[i] = INFINITY;
            float far = 0;
            for (int lane = 0; lane < 16; lane++) {
                const float depth = raw[order[i]][lane];
                t[16 * i + lane] = depth,
                           one_minus_alpha[16 * i + lane] =
                               isinf(depth) ? 1
                                            : 0.3f + 0.6f * rng_uniform(round, 3, (uint64_t)(16 * i + lane));
                term[16 * i + lane] = isinf(depth) ? 0 : rng_uniform(round, 4, (uint64_t)(16 * i + lane));
                near[i] = fminf(near[i], depth);
                far = fmaxf(far, isinf(depth) ? 0 : depth);
            }
            reached = fmaxf(reached, far);
            far_reached[i] = reached;
            row_store(before, i, product);
            product = vfloat16_mul(product, row_load(one_minus_alpha, i));
        }
        sorted_rows o = {t, one_minus_alpha, before, near, far_reached, COUNT};
        end_rows(&o);
        vfloat16 behind = vfloat16_set1(0.25f);
        row_store(after, COUNT, behind);
        for (int i = COUNT; i-- > 0;)
            row_store(after, i, behind = vfloat16_add(behind, row_load(term, i)));
        memset(term + (size_t)COUNT * 16, 0, ROW_BLOCK * 16 * sizeof *term);
        row_window window = {0};
        for (int first = 0; first < COUNT; first += ROW_BLOCK) {
            vfloat16 T[ROW_BLOCK], sum[ROW_BLOCK];
            move_window(&o, first, &window);
            window_transmittance(&o, first, &window, T);
            window_behind(&o, first, &window, term, after, sum);
            for (int k = 0; k < ROW_BLOCK && first + k < COUNT; k++)
                for (int lane = 0; lane < 16; lane++) {
                    if (isinf(t[16 * (first + k) + lane]))
                        continue;
                    brute_row hits[COUNT];
                    int n = 0, at = 0;
                    for (int i = 0; i < COUNT; i++)
                        if (!isinf(t[16 * i + lane]))
                            hits[n++] = (brute_row){t[16 * i + lane], i};
                    qsort(hits, (size_t)n, sizeof *hits, by_depth);
                    double want = 1, want_behind = 0.25;
                    for (; hits[at].row != first + k; at++)
                        want *= (double)one_minus_alpha[16 * hits[at].row + lane];
                    for (int i = at + 1; i < n; i++)
                        want_behind += (double)term[16 * hits[i].row + lane];
                    _Alignas(64) float got[2][16];
                    vfloat16_store(got[0], T[k]), vfloat16_store(got[1], sum[k]);
                    assert_near((double)got[0][lane], want, 1e-5 * want);
                    assert_near((double)got[1][lane], want_behind, 1e-5 * want_behind);
                }
        }
    }
}

static int by_key(const void *a, const void *b)
{
    const uint64_t x = ((const ray_hit *)a)->key, y = ((const ray_hit *)b)->key;
    return (x > y) - (x < y);
}

/* Any number of hits, with depths of which few or many are equal; depths may be infinite. */
static void hits_are_sorted(void **state)
{
    (void)state;
    enum { MOST = 700 };
    static ray_hit hits[MOST], spare[MOST], wanted[MOST];
    for (size_t n = 0; n <= MOST; n += n < 220 ? 1 : 37)
        for (int kind = 0; kind < 3; kind++) {
            for (size_t i = 0; i < n; i++) {
                const float u = rng_uniform(n, (uint64_t)kind, i);
                const float depth = kind == 0 ? 1 + u : kind == 1 ? floorf(4 * u) : u < 0.5f ? INFINITY : 7;
                wanted[i] = hits[i] = make_hit(depth, 0.5f + (float)i, (uint32_t)(i * 2654435761u));
            }
            sort_hits(hits, spare, n);
            qsort(wanted, n, sizeof *wanted, by_key);
            for (size_t i = 0; i < n; i++)
                assert_true(hits[i].key == wanted[i].key && hits[i].alpha == wanted[i].alpha);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_kernels_all_outputs),
        cmocka_unit_test(depth_of_faint_hits),
        cmocka_unit_test(kernels_share_the_adjoint),
        cmocka_unit_test(surfaces),
        cmocka_unit_test(parts_of_rays),
        cmocka_unit_test(parts_are_listed_whatever_is_near),
        cmocka_unit_test(hits_are_sorted),
        cmocka_unit_test(no_room_for_the_tape),
        cmocka_unit_test(rows_are_in_exact_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
