/* SPDX-License-Identifier: Apache-2.0 */
/* tests/bvh/test_gaussian_scene.c -- boxes of Gaussians under Embree's traversal: brute force in double, what
   is left out, bad rays, memory. */
#include "test_support.h"

#include "base/gaussians.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "bvh/device.h"
#include "bvh/gaussian_scene.h"
#include "bvh/gaussian_tree.h"
#include "bvh/proxy.h"

static const float alpha_min = 1.0f / 255.0f;

static float uniform(uint64_t seed, uint64_t stream, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(seed, stream, index);
}

typedef struct cloud_case {
    const char *name;
    size_t count;
    float center, spread;        /* means lie in center +- spread along every axis */
    float scale_low, scale_high; /* logarithmically between */
    float flatness;              /* the third scale is multiplied by this */
    float distance;              /* of the ray origins from the center */
    float dir_length, t_near, t_far;
} cloud_case;

static const cloud_case cloud_cases[] = {
    {"ordinary", 2000, 0, 5, 0.05f, 0.3f, 1, 12, 1, 0.01f, INFINITY},
    {"from inside", 2000, 0, 5, 0.05f, 0.3f, 1, 1, 1, 0.01f, INFINITY},
    {"one", 1, 0, 0.1f, 0.5f, 1, 1, 4, 1, 0.01f, INFINITY},
    {"one, behind", 1, 0, 0.1f, 0.05f, 0.1f, 1, -4, 1, 0.01f, INFINITY},
    {"two", 2, 0, 1, 0.5f, 1, 1, 4, 1, 0.01f, INFINITY},
    {"one block and one more", 4097, 0, 5, 0.05f, 0.2f, 1, 12, 1, 0.01f, INFINITY},
    {"small and far from 0", 1500, 1e5f, 5, 0.005f, 0.3f, 1, 12, 1, 0.01f, INFINITY},
    {"scales 1e-3 to 1e3", 1500, 0, 100, 1e-3f, 1e3f, 1, 200, 1, 0.01f, INFINITY},
    {"discs 1:1000", 1500, 0, 5, 0.1f, 0.5f, 1e-3f, 12, 1, 0.01f, INFINITY},
    {"400 in one place", 400, 1, 0, 0.05f, 0.5f, 1, 3, 1, 0, INFINITY},
    {"1e-6 wide", 1000, 0, 1e-4f, 1e-6f, 1e-5f, 1, 40, 1, 0.01f, INFINITY},
    {"1e12 wide", 500, 0, 1e13f, 1e12f, 3e12f, 1, 3e13f, 1, 0.01f, INFINITY},
    {"a slice of t", 2000, 0, 5, 0.05f, 0.3f, 1, 12, 1, 10, 12},
    {"long dir", 2000, 0, 5, 0.05f, 0.3f, 1, 12, 0x1p90f, 0x1p-95f, INFINITY},
    {"short dir", 2000, 0, 5, 0.05f, 0.3f, 1, 12, 0x1p-100f, 0x1p97f, 0x1p104f},
};

static void fill_cloud(const cloud_case *c, uint64_t seed, gaussians *g)
{
    assert_ok(gaussians_resize(g, c->count, NULL));
    for (size_t i = 0; i < c->count; i++) {
        double q[4], length = 0;
        float scale[3];
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(seed, 10 + k, i);
            length += q[k] * q[k];
        }
        length = sqrt(length);
        for (uint64_t k = 0; k < 3; k++)
            scale[k] = c->scale_low * powf(c->scale_high / c->scale_low, rng_uniform(seed, 20 + k, i));
        g->mean_x[i] = c->center + uniform(seed, 0, i, -c->spread, c->spread);
        g->mean_y[i] = c->center + uniform(seed, 1, i, -c->spread, c->spread);
        g->mean_z[i] = c->center + uniform(seed, 2, i, -c->spread, c->spread);
        g->scale_x[i] = scale[0];
        g->scale_y[i] = scale[1];
        g->scale_z[i] = scale[2] * c->flatness;
        g->quat_w[i] = (float)(q[0] / length);
        g->quat_x[i] = (float)(q[1] / length);
        g->quat_y[i] = (float)(q[2] / length);
        g->quat_z[i] = (float)(q[3] / length);
        g->opacity[i] = uniform(seed, 3, i, 0, 1);
        g->red[i] = g->green[i] = g->blue[i] = 0.5f;
    }
    gaussians_pad(g);
}

/* Sixteen rays from near `distance` before the center (behind it when negative) to points among the
   Gaussians: neighbours for even numbers, each its own way for odd ones; some along an axis. */
typedef struct ray_packet {
    float origin[3][SCENE_LANES], dir[3][SCENE_LANES];
    unsigned active;
} ray_packet;

static ray_packet make_packet(const cloud_case *c, uint64_t seed, uint64_t number)
{
    ray_packet p = {.active = number % 3 == 0                        ? 0xffffu
                              : rng_uniform(seed, 30, number) < 0.5f ? 0x0ff0u
                                                                     : 0xa5a7u};
    for (unsigned i = 0; i < SCENE_LANES; i++) {
        const uint64_t who = number % 2 == 0 ? 0 : i;
        double way[3], from[3];
        for (uint64_t k = 0; k < 3; k++) {
            const float side =
                k == 0 ? -c->distance : uniform(seed, 40 + k, 64 * number + who, -0.5f, 0.5f) * c->distance;
            const float jitter =
                uniform(seed, 50 + k, 64 * number + i, -1, 1) * (c->spread * 0.05f + c->scale_low);
            const float target =
                c->center + uniform(seed, 60 + k, 64 * number + who, -c->spread, c->spread) + jitter;
            from[k] = (double)(c->center + side);
            way[k] = (double)target - from[k];
        }
        if (c->distance < 0) {
            way[0] = -way[0];
            way[1] = -way[1];
            way[2] = -way[2];
        }
        if (number % 7 == 3) { /* exactly along x, and with components that Embree replaces */
            from[1] += way[1];
            from[2] += way[2];
            way[1] = number % 2 == 0 ? 0 : 1e-30;
            way[2] = number % 2 == 0 ? -0.0 : 0;
        }
        dvec_normalize(way);
        for (unsigned k = 0; k < 3; k++) {
            p.origin[k][i] = (float)from[k];
            p.dir[k][i] = (float)way[k] * c->dir_length;
        }
    }
    return p;
}

typedef struct visits {
    size_t gaussian_count;
    unsigned char *times; /* [SCENE_LANES][gaussian_count] */
} visits;

static void count_visit(uint32_t id, unsigned lanes, void *user)
{
    visits *v = user;
    assert_true(id < v->gaussian_count);
    assert_true(lanes != 0 && lanes < 1u << SCENE_LANES);
    for (unsigned i = 0; i < SCENE_LANES; i++)
        if ((lanes >> i & 1) != 0)
            v->times[i * v->gaussian_count + id]++;
}

/* Of one Gaussian and one ray, in double. */
typedef struct verdict {
    bool reached; /* alpha >= alpha_min somewhere in t_near <= t <= t_far */
    bool boxed;   /* the ray crosses a box a little larger than the padded one */
} verdict;

static verdict judge(const gaussians *g, size_t i, const float origin[3], const float dir[3], float t_near,
                     float t_far, double reach)
{
    const double q[4] = {(double)g->quat_w[i], (double)g->quat_x[i], (double)g->quat_y[i],
                         (double)g->quat_z[i]};
    const double scale[3] = {(double)g->scale_x[i], (double)g->scale_y[i], (double)g->scale_z[i]};
    const double mean[3] = {(double)g->mean_x[i], (double)g->mean_y[i], (double)g->mean_z[i]};
    double r[9], offset[3], way[3], x[3], w[3];
    dquat_to_matrix(q, r);
    for (int k = 0; k < 3; k++) {
        offset[k] = (double)origin[k] - mean[k];
        way[k] = (double)dir[k];
    }
    dmat_apply_transposed(r, offset, x);
    dmat_apply_transposed(r, way, w);
    for (int k = 0; k < 3; k++) {
        x[k] /= scale[k];
        w[k] /= scale[k];
    }
    const double t = fmin(fmax(-dvec_dot(x, w) / dvec_dot(w, w), (double)t_near), (double)t_far);
    double d2 = 0, enter = (double)t_near, leave = (double)t_far;
    for (int k = 0; k < 3; k++)
        d2 += (x[k] + t * w[k]) * (x[k] + t * w[k]);
    const double k_max = sqrt(2 * log((double)g->opacity[i] / (double)alpha_min));
    for (int k = 0; k < 3; k++) {
        const double a = r[3 * k] * scale[0], b = r[3 * k + 1] * scale[1], c = r[3 * k + 2] * scale[2];
        const double half = 1.0001 * k_max * sqrt(a * a + b * b + c * c) + 0x1p-20 * reach;
        const double t1 = (-half - offset[k]) / way[k], t2 = (half - offset[k]) / way[k];
        if (way[k] == 0) {
            leave = fabs(offset[k]) <= half ? leave : -1;
            continue;
        }
        enter = fmax(enter, fmin(t1, t2));
        leave = fmin(leave, fmax(t1, t2));
    }
    return (verdict){.reached = (double)g->opacity[i] * exp(-0.5 * d2) >= (double)alpha_min,
                     .boxed = enter <= leave * (1 + 1e-6)};
}

static double largest_coordinate(const cloud_case *c)
{
    return (double)(fabsf(c->center) + fabsf(c->distance));
}

enum { PACKETS = 40 };

static void agrees_with_brute_force(void **state)
{
    const cloud_case *c = *state;
    const uint64_t seed = (uint64_t)(c - cloud_cases) + 1;
    gaussians g = {0};
    gaussian_scene scene = {0};
    fill_cloud(c, seed, &g);
    visits v = {.gaussian_count = c->count, .times = mem_alloc(c->count, SCENE_LANES, "visits", NULL)};
    assert_non_null(v.times);
    size_t reached_count = 0, visited_count = 0;
    assert_ok(gaussian_scene_build(&g, alpha_min, (float)largest_coordinate(c), &scene, NULL));
    const double reach = fmax((double)scene.coordinate_max, largest_coordinate(c));
    for (uint64_t number = 0; number < PACKETS; number++) {
        const ray_packet p = make_packet(c, seed, number);
        memset(v.times, 0, c->count * SCENE_LANES);
        gaussian_scene_visit(&scene, p.origin, p.dir, c->t_near, c->t_far, p.active, count_visit, &v);
        for (unsigned lane = 0; lane < SCENE_LANES; lane++) {
            const float origin[3] = {p.origin[0][lane], p.origin[1][lane], p.origin[2][lane]};
            const float dir[3] = {p.dir[0][lane], p.dir[1][lane], p.dir[2][lane]};
            for (size_t i = 0; i < c->count; i++) {
                const unsigned times = v.times[lane * c->count + i];
                if ((p.active >> lane & 1) == 0 || g.opacity[i] <= alpha_min) {
                    assert_int_equal(times, 0);
                    continue;
                }
                const verdict want = judge(&g, i, origin, dir, c->t_near, c->t_far, reach);
                if (times > 1 || (want.reached && times != 1) || (!want.boxed && times != 0))
                    fail_msg("packet %d, ray %u, Gaussian %zu: visited %u times, reached %d, boxed %d",
                             (int)number, lane, i, times, want.reached, want.boxed);
                reached_count += want.reached;
                visited_count += times;
            }
        }
    }
    print_message("%s: %zu reached, %zu visited\n", c->name, reached_count, visited_count);
    if (c->distance > 0)
        assert_true(reached_count > 100);
    assert_true(visited_count >= reached_count);
    mem_free(v.times);
    gaussian_scene_free(&scene);
    gaussians_free(&g);
}

typedef struct thread_job {
    const gaussian_scene *scene;
    unsigned char *times; /* [PACKETS][SCENE_LANES][count] */
} thread_job;

static void visit_packets(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const thread_job *job = context;
    const cloud_case *c = &cloud_cases[0];
    for (size_t number = begin; number < end; number++) {
        visits v = {.gaussian_count = c->count, .times = job->times + number * SCENE_LANES * c->count};
        const ray_packet p = make_packet(c, 1, number);
        gaussian_scene_visit(job->scene, p.origin, p.dir, c->t_near, c->t_far, p.active, count_visit, &v);
    }
}

static void the_same_for_every_thread_count(void **state)
{
    (void)state;
    const cloud_case *c = &cloud_cases[0];
    const size_t size = PACKETS * SCENE_LANES * c->count;
    gaussians g = {0};
    fill_cloud(c, 1, &g);
    unsigned char *want = mem_calloc(size, 1, "visits", NULL), *got = mem_calloc(size, 1, "visits", NULL);
    assert_true(want != NULL && got != NULL);
    const int before = parallel_threads();
    for (int threads = 1; threads <= 2; threads++) {
        gaussian_scene scene = {0};
        parallel_set_threads(threads);
        assert_ok(gaussian_scene_build(&g, alpha_min, 12, &scene, NULL));
        parallel_blocks(PACKETS, 1, visit_packets,
                        &(thread_job){.scene = &scene, .times = threads == 1 ? want : got});
        gaussian_scene_free(&scene);
    }
    parallel_set_threads(before);
    assert_memory_equal(want, got, size);
    size_t total = 0;
    for (size_t i = 0; i < size; i++)
        total += want[i];
    assert_true(total > 1000);
    mem_free(want);
    mem_free(got);
    gaussians_free(&g);
}

static void no_visit(uint32_t id, unsigned lanes, void *user)
{
    (void)user;
    fail_msg("Gaussian %u was visited by %x", (unsigned)id, lanes);
}

static void empty_scenes(void **state)
{
    (void)state;
    const ray_packet p = make_packet(&cloud_cases[2], 1, 0);
    gaussian_scene scene = {0};
    gaussians g = {0};
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL));
    gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0xffff, no_visit, NULL);
    fill_cloud(&cloud_cases[2], 1, &g);
    g.opacity[0] = alpha_min; /* at the cut: no proxy */
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL));
    assert_int_equal(scene.box_count, 0);
    assert_int_equal(scene.rejected_count, 0);
    gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0xffff, no_visit, NULL);
    g.opacity[0] = 0.9f;
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL));
    assert_int_equal(scene.box_count, 1);
    gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0, no_visit, NULL); /* no ray is active */
    assert_ok(gaussians_resize(&g, 0, NULL));
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL)); /* and empty again */
    assert_int_equal(scene.box_count, 0);
    gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0xffff, no_visit, NULL);
    gaussian_scene_free(&scene);
    gaussian_scene_free(&scene); /* twice is fine */
    gaussians_free(&g);
}

/* The box is tight and not too tight: rays beside each of its faces, just inside and just outside of the
   point where the proxy touches it. */
static void boxes_are_tight(void **state)
{
    (void)state;
    const cloud_case c = {
        .count = 1, .center = 3, .spread = 1, .scale_low = 0.2f, .scale_high = 2, .flatness = 1};
    for (uint64_t seed = 1; seed <= 50; seed++) {
        gaussians g = {0};
        gaussian_scene scene = {0};
        fill_cloud(&c, seed, &g);
        g.opacity[0] = 0.9f;
        assert_ok(gaussian_scene_build(&g, alpha_min, 20, &scene, NULL));
        const double q[4] = {(double)g.quat_w[0], (double)g.quat_x[0], (double)g.quat_y[0],
                             (double)g.quat_z[0]},
                     k = sqrt(2 * log(0.9 * 255));
        const double scale[3] = {(double)g.scale_x[0], (double)g.scale_y[0], (double)g.scale_z[0]};
        const double mean[3] = {(double)g.mean_x[0], (double)g.mean_y[0], (double)g.mean_z[0]};
        double r[9];
        dquat_to_matrix(q, r);
        ray_packet p = {.active = 0xfff};
        for (int lane = 0; lane < 12; lane++) { /* axis, side, inside or outside */
            const int axis = lane % 3, along = (axis + 1) % 3;
            const double out = (lane / 3 % 2 == 0 ? 1 : -1) * (lane < 6 ? 0.9999 : 1.0001);
            double touch[3] = {0}, length = 0;
            for (int i = 0; i < 3; i++)
                length += r[3 * axis + i] * scale[i] * r[3 * axis + i] * scale[i];
            for (int j = 0; j < 3; j++) {
                for (int i = 0; i < 3; i++)
                    touch[j] += r[3 * j + i] * scale[i] * r[3 * axis + i] * scale[i] * k / sqrt(length);
                p.origin[j][lane] = (float)(mean[j] + out * touch[j]) - (j == along ? 10 : 0);
                p.dir[j][lane] = j == along;
            }
        }
        unsigned char times[SCENE_LANES] = {0};
        visits v = {.gaussian_count = 1, .times = times};
        gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, p.active, count_visit, &v);
        for (int lane = 0; lane < 12; lane++)
            if (times[lane] != (lane < 6))
                fail_msg("seed %d, axis %d, %s: visited %d times", (int)seed, lane % 3,
                         lane < 6 ? "inside" : "outside", times[lane]);
        gaussian_scene_free(&scene);
        gaussians_free(&g);
    }
}

static void bad_gaussians_are_counted(void **state)
{
    (void)state;
    const cloud_case c = {.count = 64,
                          .spread = 1,
                          .scale_low = 0.5f,
                          .scale_high = 1,
                          .flatness = 1,
                          .distance = 4,
                          .dir_length = 1};
    const float bad[] = {NAN, INFINITY, -INFINITY};
    gaussians g = {0};
    fill_cloud(&c, 3, &g);
    for (size_t i = 0; i < c.count; i++)
        g.opacity[i] = 0.5f;
    size_t i = 0;
    for (size_t k = 0; k < 3; k++) {
        float *const fields[] = {g.mean_x, g.mean_z, g.scale_y, g.quat_w, g.red, g.blue};
        for (size_t f = 0; f < sizeof fields / sizeof *fields; f++)
            fields[f][i++] = bad[k];
    }
    g.opacity[i++] = NAN;
    g.opacity[i++] = INFINITY;
    g.scale_x[i++] = 0;
    g.scale_z[i++] = -1;
    g.mean_y[i++] = 1e17f;
    g.mean_y[i++] = -3e38f;
    const size_t rejected = i;
    /* unseen, but nothing is wrong with them */
    g.opacity[i++] = 0;
    g.opacity[i++] = -INFINITY;
    g.opacity[i++] = alpha_min;
    gaussian_scene scene = {0};
    gaussian_tree tree = {0};
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL));
    assert_ok(gaussian_tree_build(&g, alpha_min, 4, &tree, NULL));
    assert_int_equal(scene.rejected_count, rejected);
    assert_int_equal(scene.box_count, c.count - i);
    assert_int_equal(tree.rejected_count, rejected);
    assert_int_equal(tree.box_count, c.count - i);
    assert_true(tree.coordinate_max == scene.coordinate_max);
    visits v = {.gaussian_count = c.count, .times = mem_calloc(c.count, SCENE_LANES, "visits", NULL)};
    assert_non_null(v.times);
    for (uint64_t number = 0; number < PACKETS; number++) {
        const ray_packet p = make_packet(&c, 3, number);
        gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0xffff, count_visit, &v);
    }
    for (size_t k = 0; k < c.count; k++) {
        unsigned times = 0;
        for (unsigned lane = 0; lane < SCENE_LANES; lane++)
            times += v.times[lane * c.count + k];
        assert_int_equal(times > 0, k >= i);
    }
    mem_free(v.times);
    gaussian_tree_free(&tree);
    gaussian_scene_free(&scene);
    gaussians_free(&g);
}

static void bad_rays_cross_nothing(void **state)
{
    (void)state;
    static const float bad[][8] = {
        /* origin, dir, t_near, t_far */
        {NAN, 0, 0, 1, 0, 0, 0, INFINITY},
        {INFINITY, 0, 0, 1, 0, 0, 0, INFINITY},
        {0, 2e18f, 0, 1, 0, 0, 0, INFINITY},
        {0, 0, 0, 0, 0, 0, 0, INFINITY},
        {0, 0, 0, NAN, 0, 1, 0, INFINITY},
        {0, 0, 0, 1, -INFINITY, 0, 0, INFINITY},
        {0, 0, 0, 1, 0, 0, -1, INFINITY},
        {0, 0, 0, 1, 0, 0, NAN, INFINITY},
        {0, 0, 0, 1, 0, 0, 0, NAN},
        {0, 0, 0, 1, 0, 0, 2, 1},
        {0, 0, 0, 1, 0, 0, INFINITY, INFINITY},
    };
    const cloud_case c = {.count = 50, .spread = 0, .scale_low = 1, .scale_high = 1, .flatness = 1};
    gaussians g = {0};
    gaussian_scene scene = {0};
    fill_cloud(&c, 4, &g);
    assert_ok(gaussian_scene_build(&g, alpha_min, 4, &scene, NULL));
    visits v = {.gaussian_count = c.count, .times = mem_calloc(c.count, SCENE_LANES, "visits", NULL)};
    assert_non_null(v.times);
    for (size_t b = 0; b < sizeof bad / sizeof *bad; b++) {
        const bool bad_range = !(bad[b][6] == 0 && bad[b][7] == INFINITY);
        ray_packet p = {.active = 0xffff};
        for (unsigned i = 0; i < SCENE_LANES; i++) /* every other one is good, if the range is */
            for (unsigned k = 0; k < 3; k++) {
                p.origin[k][i] = i % 2 == 0 ? bad[b][k] : 0;
                p.dir[k][i] = i % 2 == 0 ? bad[b][3 + k] : k == 2;
            }
        memset(v.times, 0, c.count * SCENE_LANES);
        gaussian_scene_visit(&scene, p.origin, p.dir, bad[b][6], bad[b][7], p.active, count_visit, &v);
        for (unsigned lane = 0; lane < SCENE_LANES; lane++)
            for (size_t i = 0; i < c.count; i++)
                assert_int_equal(v.times[lane * c.count + i],
                                 lane % 2 == 1 && !bad_range && g.opacity[i] > alpha_min);
    }
    mem_free(v.times);
    gaussian_scene_free(&scene);
    gaussians_free(&g);
}

static void memory_is_counted_and_limited(void **state)
{
    (void)state;
    const ray_packet p = make_packet(&cloud_cases[0], 1, 0);
    gaussians g = {0};
    gaussian_scene scene = {0};
    fill_cloud(&cloud_cases[0], 1, &g);
    assert_ok(gaussian_scene_build(&g, alpha_min, 12, &scene, NULL)); /* Embree's own tables exist
                                                                                   from here */
    gaussian_scene_free(&scene);
    const size_t before = bvh_memory_bytes();
    assert_ok(gaussian_scene_build(&g, alpha_min, 12, &scene, NULL));
    const size_t held = bvh_memory_bytes() - before;
    assert_true(held > 20 * g.count && held < 1000 * g.count);
    gaussian_scene_free(&scene);
    assert_int_equal(bvh_memory_bytes(), before);
    bvh_limit_memory(before + 1000);
    gbt_error err = {0};
    assert_int_equal(gaussian_scene_build(&g, alpha_min, 12, &scene, &err), GBT_ERR_NO_MEMORY);
    assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
    assert_int_equal(scene.box_count, 0);
    gaussian_scene_visit(&scene, p.origin, p.dir, 0, INFINITY, 0xffff, no_visit, NULL);
    bvh_limit_memory(SIZE_MAX);
    assert_ok(gaussian_scene_build(&g, alpha_min, 12, &scene, NULL));
    assert_true(scene.box_count > 0);
    gaussian_scene_free(&scene);
    gaussians_free(&g);
}

/* Embree is refused memory at ever later points: each build is whole or an error, and nothing is kept. */
static void builds_are_whole_or_refused(void **state)
{
    (void)state;
    gaussians g = {0};
    fill_cloud(&cloud_cases[0], 1, &g);
    for (int is_tree = 0; is_tree < 2; is_tree++) {
        const size_t before = bvh_memory_bytes();
        int refused = 0;
        for (size_t allowed = 256; allowed < 1u << 30; allowed += allowed / 4) {
            gaussian_scene scene = {0};
            gaussian_tree tree = {0};
            gbt_error err = {0};
            bvh_limit_memory(before + allowed);
            const gbt_status status = is_tree ? gaussian_tree_build(&g, alpha_min, 12, &tree, &err)
                                              : gaussian_scene_build(&g, alpha_min, 12, &scene, &err);
            bvh_limit_memory(SIZE_MAX);
            assert_int_equal(status == GBT_OK, is_tree ? tree.root != NULL : scene.box_count > 0);
            gaussian_tree_free(&tree);
            gaussian_scene_free(&scene);
            assert_int_equal(bvh_memory_bytes(), before);
            if (status == GBT_OK)
                break;
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_true(err.text[0] != '\0');
            refused++;
        }
        assert_true(refused > 10);
    }
    gaussians_free(&g);
}

static void no_memory_is_an_error(void **state)
{
    (void)state;
    gaussians g = {0};
    fill_cloud(&cloud_cases[0], 1, &g);
    gbt_status status = GBT_ERR_NO_MEMORY;
    long n = 0;
    for (; n < 100 && status != GBT_OK; n++) {
        gaussian_scene scene = {0};
        gbt_error err = {0};
        mem_fail_after(n);
        status = gaussian_scene_build(&g, alpha_min, 12, &scene, &err);
        mem_fail_after(-1);
        if (status != GBT_OK) {
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_true(err.text[0] != '\0');
            assert_int_equal(scene.box_count, 0);
        }
        gaussian_scene_free(&scene);
    }
    assert_true(n > 2 && n < 100);
    gaussians_free(&g);
}

/* Far from 0, where the pad is larger than what rounding may take of it: on every face. */
static void boxes_are_padded(void **state)
{
    (void)state;
    const cloud_case c = {
        .count = 300, .center = 1000, .spread = 5, .scale_low = 0.05f, .scale_high = 0.3f, .flatness = 1};
    gaussians g = {0};
    proxy_boxes boxes = {0};
    fill_cloud(&c, 4, &g);
    assert_ok(proxy_boxes_make(&g, alpha_min, 2000, &boxes, NULL));
    const double pad = (double)bvh_box_pad(2000);
    for (size_t b = 0; b < boxes.count; b++) {
        const struct RTCBuildPrimitive *box = &boxes.box[b];
        const size_t i = box->primID;
        const float lower[3] = {box->lower_x, box->lower_y, box->lower_z},
                    upper[3] = {box->upper_x, box->upper_y, box->upper_z},
                    mean[3] = {g.mean_x[i], g.mean_y[i], g.mean_z[i]},
                    scale[3] = {g.scale_x[i], g.scale_y[i], g.scale_z[i]},
                    quat[4] = {g.quat_w[i], g.quat_x[i], g.quat_y[i], g.quat_z[i]};
        const double reach = sqrt(2 * log((double)g.opacity[i] / (double)alpha_min));
        float turn[9];
        quat_to_matrix(quat, turn);
        for (int k = 0; k < 3; k++) {
            double square = 0;
            for (int j = 0; j < 3; j++)
                square += pow((double)turn[3 * k + j] * (double)scale[j], 2);
            const double half = reach * sqrt(square), below = (double)mean[k] - half - (double)lower[k],
                         above = (double)upper[k] - (double)mean[k] - half;
            assert_true(below > 0.5 * pad && below < 1.5 * pad + 1e-4 * half);
            assert_true(above > 0.5 * pad && above < 1.5 * pad + 1e-4 * half);
        }
    }
    assert_true(boxes.count > 250);
    proxy_boxes_free(&boxes);
    gaussians_free(&g);
}

int main(void)
{
    enum { CASES = sizeof cloud_cases / sizeof *cloud_cases };
    struct CMUnitTest tests[CASES + 9];
    for (size_t i = 0; i < CASES; i++)
        tests[i] = (struct CMUnitTest){.name = cloud_cases[i].name,
                                       .test_func = agrees_with_brute_force,
                                       .initial_state = (void *)(uintptr_t)&cloud_cases[i]};
    const struct CMUnitTest others[] = {
        cmocka_unit_test(the_same_for_every_thread_count),
        cmocka_unit_test(empty_scenes),
        cmocka_unit_test(boxes_are_tight),
        cmocka_unit_test(boxes_are_padded),
        cmocka_unit_test(bad_gaussians_are_counted),
        cmocka_unit_test(bad_rays_cross_nothing),
        cmocka_unit_test(memory_is_counted_and_limited),
        cmocka_unit_test(builds_are_whole_or_refused),
        cmocka_unit_test(no_memory_is_an_error),
    };
    memcpy(tests + CASES, others, sizeof others);
    return cmocka_run_group_tests_name("gaussian_scene", tests, NULL, NULL);
}
