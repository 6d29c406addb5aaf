/* SPDX-License-Identifier: Apache-2.0 */
/* tests/bvh/test_points.c -- queries on balls: exact boundaries, brute force in double, FLANN, ties, bad
   input, threads, real points. */
#include "test_support.h"

#include <float.h>
#include <stdbool.h>
#include <time.h>

#ifdef TEST_FLANN
#include <flann/flann.h>
#endif

#include "base/compare.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "bvh/point_tree.h"
#include "bvh/points.h"

enum { MAX_K = 64, MAX_COUNT = 600 };

static float uniform(uint64_t seed, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(seed, 3, index);
}

/* ---- exact boundaries, one ball ---- */

/* ---- as floats ---- */

static gbt_status build(const float *position, const float *radius, size_t count, point_tree **out,
                        gbt_error *err)
{
    return point_tree_build(number_floats(position), number_floats(radius), count, out, err);
}

static size_t nearest(const point_tree *tree, const float *q, size_t k, size_t skip, uint32_t *index,
                      double *d2)
{
    const double query[3] = {(double)q[0], (double)q[1], (double)q[2]};
    return point_tree_nearest(tree, query, k, skip, index, d2);
}

static gbt_status around(const point_tree *tree, point_question what, const float q[3], float radius,
                         point_list *out, gbt_error *err)
{
    const point_query query = {
        .what = what, .a = {(double)q[0], (double)q[1], (double)q[2]}, .radius = (double)radius};
    return point_tree_list(tree, &query, out, err);
}

static gbt_status within(const point_tree *tree, const float q[3], float radius, point_list *out,
                         gbt_error *err)
{
    return around(tree, POINTS_WITHIN, q, radius, out, err);
}

static gbt_status containing(const point_tree *tree, const float q[3], point_list *out, gbt_error *err)
{
    return around(tree, POINTS_CONTAINING, q, 0, out, err);
}

static gbt_status overlapping(const point_tree *tree, const float q[3], float radius, point_list *out,
                              gbt_error *err)
{
    return around(tree, POINTS_OVERLAPPING, q, radius, out, err);
}

static gbt_status crossed_by(const point_tree *tree, const float origin[3], const float dir[3], float t_min,
                             float t_max, point_list *out, gbt_error *err)
{
    const point_query query = {.what = POINTS_CROSSED,
                               .a = {(double)origin[0], (double)origin[1], (double)origin[2]},
                               .b = {(double)dir[0], (double)dir[1], (double)dir[2]},
                               .t_min = (double)t_min,
                               .t_max = (double)t_max};
    return point_tree_list(tree, &query, out, err);
}

typedef struct ball_case {
    const char *name;
    float center[3], ball_radius, query[3], radius;
    bool within, containing, overlapping;
} ball_case;

static const ball_case ball_cases[] = {
    {"within: at the radius", {3, 4, 0}, 0, {0, 0, 0}, 5, true, false, true},
    {"within: just beyond", {3, 4, 0}, 0, {0, 0, 0}, 4.9999995f, false, false, false},
    {"containing: on the surface", {1, 1, 1}, 3, {3, 2, 3}, 0, false, true, true},
    {"containing: just outside", {1, 1, 1}, 2.9999998f, {3, 2, 3}, 0, false, false, false},
    {"overlapping: touch", {10, 0, 0}, 4, {0, 0, 0}, 6, false, false, true},
    {"overlapping: just apart", {10, 0, 0}, 4, {0, 0, 0}, 5.9999995f, false, false, false},
    {"all zero", {0, 0, 0}, 0, {0, 0, 0}, 0, true, true, true},
    {"minus zero", {-0.0f, 0, -0.0f}, 0, {0, -0.0f, 0}, 0, true, true, true},
    {"infinite radius", {1e30f, 0, 0}, 0, {-1e30f, 1, 0}, INFINITY, true, false, true},
    {"far query", {0, 0, 0}, 1, {1e6f, 0, 0}, 1e6f, true, false, true},
    {"far query, short", {0, 0, 0}, 1, {1e6f, 0, 0}, 999998.9f, false, false, false},
    {"huge ball holds a far query", {1, 2, 3}, 1e30f, {5e29f, 5e29f, 5e29f}, 0, false, true, true},
    {"huge ball, query outside", {1, 2, 3}, 1e30f, {1e30f, 1e30f, 0}, 0, false, false, false},
    {"largest numbers", {FLT_MAX, 0, 0}, FLT_MAX, {0, 0, 0}, FLT_MAX, true, true, true},
    {"largest numbers, apart", {FLT_MAX, 0, 0}, 0, {-FLT_MAX, 0, 0}, FLT_MAX, false, false, false},
    {"smallest numbers", {1.4e-45f, 0, 0}, 0, {0, 0, 0}, 1.4e-45f, true, false, true},
    {"smallest numbers, apart", {2.8e-45f, 0, 0}, 0, {0, 0, 0}, 1.4e-45f, false, false, false},
};

static void one_ball(void **state)
{
    const ball_case *c = *state;
    point_tree *tree = NULL;
    assert_ok(build(c->center, &c->ball_radius, 1, &tree, NULL));
    point_list list = {0};
    gbt_error err = {0};
    assert_int_equal(within(tree, c->query, c->radius, &list, &err), GBT_OK);
    assert_int_equal(list.count, c->within);
    assert_int_equal(containing(tree, c->query, &list, &err), GBT_OK);
    assert_int_equal(list.count, c->containing);
    assert_int_equal(overlapping(tree, c->query, c->radius, &list, &err), GBT_OK);
    assert_int_equal(list.count, c->overlapping);
    point_list_free(&list);
    point_tree_free(tree);
}

/* Nodes keep a radius as a float: 0.7 is above the nearest one, and the query lies between them. */
static void radii_of_nodes_are_not_too_small(void **state)
{
    (void)state;
    const double center[3] = {0, 0, 0}, radius = 0.7, query[3] = {0.5 * ((double)0.7f + radius), 0, 0};
    assert_true((double)0.7f < radius);
    point_tree *tree = NULL;
    assert_ok(point_tree_build(number_doubles(center), number_doubles(&radius), 1, &tree, NULL));
    point_list list = {0};
    const point_query around_it = {.what = POINTS_CONTAINING, .a = {query[0], query[1], query[2]}};
    assert_ok(point_tree_list(tree, &around_it, &list, NULL));
    assert_int_equal(list.count, 1);
    point_list_free(&list);
    point_tree_free(tree);
}

typedef struct ray_case {
    const char *name;
    float center[3], radius, origin[3], dir[3], t_min, t_max;
    bool crossed;
} ray_case;

static const ray_case ray_cases[] = {
    {"through the centre", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 100, true},
    {"tangent", {0, 1, 5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 100, true},
    {"just missed", {0, 1.0000001f, 5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 100, false},
    {"end touches", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 4, true},
    {"end just short", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 3.9999998f, false},
    {"start touches", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 6, 100, true},
    {"start just past", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 6.0000005f, 100, false},
    {"whole segment inside", {0, 0, 5}, 10, {0, 0, 4}, {1, 0, 0}, 0, 0.5f, true},
    {"one point of a segment", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 5, 5, true},
    {"empty segment", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 1}, 6, 4, false},
    {"behind", {0, 0, -5}, 1, {0, 0, 0}, {0, 0, 1}, 0, 100, false},
    {"behind, negative start", {0, 0, -5}, 1, {0, 0, 0}, {0, 0, 1}, -4, 100, true},
    {"whole line", {0, 0, -5}, 1, {0, 0, 0}, {0, 0, 1}, -INFINITY, INFINITY, true},
    {"from infinity", {0, 0, -5}, 1, {0, 0, 0}, {0, 0, 1}, INFINITY, INFINITY, false},
    {"to minus infinity", {0, 0, -5}, 1, {0, 0, 0}, {0, 0, 1}, -INFINITY, -INFINITY, false},
    {"point on the ray", {0, 0, 5}, 0, {0, 0, 0}, {0, 0, 1}, 0, 100, true},
    {"point at the very end", {0, 0, 5}, 0, {0, 0, 0}, {0, 0, 1}, 0, 5, true},
    {"point off the ray", {0, 1e-30f, 5}, 0, {0, 0, 0}, {0, 0, 1}, 0, 100, false},
    {"huge dir", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 0x1p127f}, 0, 1, true},
    {"tiny dir, long way", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 0x1p-140f}, 0, INFINITY, true},
    {"tiny dir, short way", {0, 0, 5}, 1, {0, 0, 0}, {0, 0, 0x1p-140f}, 0, 1e30f, false},
    {"far origin", {0, 0, 5}, 1, {0, 1, -1e6f}, {0, 0, 1}, 0, INFINITY, true},
    {"very far origin", {0, 0, 5}, 1, {0, 0, -1e30f}, {0, 0, 3}, 0, INFINITY, true},
    {"very far origin, missed", {0, 0, 5}, 1, {0, 2, -1e30f}, {0, 0, 3}, 0, INFINITY, false},
    {"largest numbers", {FLT_MAX, 0, 0}, 1, {-FLT_MAX, 0, 0}, {FLT_MAX, 0, 0}, 0, 2, true},
    {"largest numbers, too short", {FLT_MAX, 0, 0}, 1, {-FLT_MAX, 0, 0}, {FLT_MAX, 0, 0}, 0, 1.9f, false},
    {"huge ball", {0, 0, 5}, 1e30f, {1e29f, 0, 0}, {0, 0, 1}, 0, 1, true},
};

static void one_ray(void **state)
{
    const ray_case *c = *state;
    point_tree *tree = NULL;
    assert_ok(build(c->center, &c->radius, 1, &tree, NULL));
    point_list list = {0};
    assert_ok(crossed_by(tree, c->origin, c->dir, c->t_min, c->t_max, &list, NULL));
    assert_int_equal(list.count, c->crossed);
    point_list_free(&list);
    point_tree_free(tree);
}

/* ---- bad input ---- */

typedef struct bad_ray {
    const char *name;
    float origin[3], dir[3], t_min, t_max;
} bad_ray;

static const bad_ray bad_rays[] = {
    {"origin NaN", {0, NAN, 0}, {0, 0, 1}, 0, 1}, {"origin infinite", {INFINITY, 0, 0}, {0, 0, 1}, 0, 1},
    {"dir NaN", {0, 0, 0}, {0, 0, NAN}, 0, 1},    {"dir infinite", {0, 0, 0}, {-INFINITY, 0, 1}, 0, 1},
    {"dir zero", {0, 0, 0}, {0, -0.0f, 0}, 0, 1}, {"t_min NaN", {0, 0, 0}, {0, 0, 1}, NAN, 1},
    {"t_max NaN", {0, 0, 0}, {0, 0, 1}, 0, NAN},
};

static void bad_queries_are_refused(void **state)
{
    (void)state;
    const float position[6] = {0, 0, 0, 1, 1, 1}, radius[2] = {1, 2}, good[3] = {0, 0, 0};
    for (int with_points = 0; with_points < 2; with_points++) {
        point_tree *tree = NULL;
        assert_ok(build(position, radius, with_points ? 2 : 0, &tree, NULL));
        point_list list = {0};
        assert_ok(within(tree, good, 9, &list, NULL));
        assert_int_equal(list.count, with_points ? 2 : 0);
        for (size_t i = 0; i < sizeof bad_rays / sizeof *bad_rays; i++) {
            const bad_ray *b = &bad_rays[i];
            gbt_error err = {0};
            if (crossed_by(tree, b->origin, b->dir, b->t_min, b->t_max, &list, &err) != GBT_ERR_ARGUMENT ||
                list.count != 0 || strstr(err.text, "points: bad ray") != err.text)
                fail_msg("%s: taken", b->name);
        }
        const float bad[] = {NAN, INFINITY, -INFINITY};
        for (int i = 0; i < 9; i++) {
            float query[3] = {0, 0, 0}, spare;
            query[i % 3] = bad[i / 3];
            gbt_error err = {0};
            assert_int_equal(within(tree, query, 1, &list, &err), GBT_ERR_ARGUMENT);
            assert_int_equal(containing(tree, query, &list, &err), GBT_ERR_ARGUMENT);
            assert_int_equal(overlapping(tree, query, 1, &list, &err), GBT_ERR_ARGUMENT);
            assert_non_null(strstr(err.text, "points: bad query"));
            uint32_t index;
            double d2;
            assert_int_equal(nearest(tree, query, 1, SIZE_MAX, &index, &d2), 0);
            err = (gbt_error){0};
            assert_int_equal(point_tree_spacing(tree, number_floats(position), i % 2 ? 0 : 65, &spare, &err),
                             GBT_ERR_ARGUMENT);
            assert_non_null(strstr(err.text, "1..64"));
        }
        gbt_error err = {0};
        assert_int_equal(within(tree, good, NAN, &list, &err), GBT_ERR_ARGUMENT);
        assert_int_equal(within(tree, good, -1e-30f, &list, NULL), GBT_ERR_ARGUMENT);
        assert_int_equal(overlapping(tree, good, -1, &list, NULL), GBT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "points: bad search radius"));
        point_list_free(&list);
        assert_null(list.item);
        point_tree_free(tree);
    }
    point_tree_free(NULL);
}

static void bad_points_are_named(void **state)
{
    (void)state;
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        float position[30] = {0}, radius[10] = {0};
        position[3 * 7 + 2] = bad[i];
        point_tree *tree = (point_tree *)position;
        gbt_error err = {0};
        assert_int_equal(build(position, NULL, 10, &tree, &err), GBT_ERR_ARGUMENT);
        assert_null(tree);
        assert_non_null(strstr(err.text, "point 7: bad coordinate"));
        position[3 * 7 + 2] = 0;
        radius[4] = i == 0 ? -1 : bad[i - 1];
        err = (gbt_error){0};
        assert_int_equal(build(position, radius, 10, &tree, &err), GBT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "point 4: bad radius"));
    }
    point_tree *tree = NULL;
    gbt_error err = {0};
    assert_int_equal(build(NULL, NULL, UINT32_MAX, &tree, &err), GBT_ERR_ARGUMENT);
}

/* ---- brute force in double ---- */

typedef enum shape {
    RANDOM,
    CLUSTERS,
    LINE,
    PLANE,
    GRID,
    STACK,
    FAR,
    OUTLIER,
    TINY,
    HUGE_SIZE,
    SHAPE_COUNT
} shape;
static const char *const shape_names[] = {"random",    "clusters", "line",    "plane", "grid with copies",
                                          "one stack", "far",      "outlier", "tiny",  "huge"};

static void make_points(shape kind, uint64_t seed, size_t count, float *position)
{
    for (size_t i = 0; i < count; i++) {
        float *p = position + 3 * i, a[3];
        for (uint64_t j = 0; j < 3; j++)
            a[j] = uniform(seed, 8 * i + j, -1, 1);
        for (size_t j = 0; j < 3; j++) {
            switch (kind) {
            case RANDOM:
                p[j] = a[j];
                break;
            case CLUSTERS:
                p[j] = (float)((i % 5) * (j + 1)) + 0.001f * a[j];
                break;
            case LINE:
                p[j] = a[0] * (float)(j + 1);
                break;
            case PLANE:
                p[j] = j == 2 ? 0.5f : a[j];
                break;
            case GRID:
                p[j] = floorf(2.5f * a[j]);
                break;
            case STACK:
                p[j] = 0.3f;
                break;
            case FAR:
                p[j] = 1e6f + 20 * a[j];
                break;
            case OUTLIER:
                p[j] = i == count / 2 ? 1e9f : a[j];
                break;
            case TINY:
                p[j] = 1e-38f * a[j];
                break;
            case HUGE_SIZE:
                p[j] = 3e38f * a[j];
                break;
            case SHAPE_COUNT:
                break;
            }
        }
    }
}

static float size_of(shape kind)
{
    return kind == TINY        ? 1e-38f
           : kind == HUGE_SIZE ? 1e38f
           : kind == FAR       ? 10
           : kind == CLUSTERS  ? 0.002f
                               : 1;
}

/* 0: none, 1: all zero, 2: moderate, 3: zero to huge. */
static void make_radii(int mode, uint64_t seed, size_t count, float size, float *radius)
{
    for (size_t i = 0; i < count; i++) {
        const float u = uniform(seed + 1000, i, 0, 1);
        radius[i] = mode == 1     ? 0
                    : mode == 2   ? 0.3f * size * u
                    : i % 7 == 0  ? 0
                    : i % 31 == 0 ? FLT_MAX * u
                                  : size * u * u * u;
    }
}

static void make_query(shape kind, uint64_t seed, size_t q, const float *position, size_t count, float out[3])
{
    for (size_t j = 0; j < 3; j++)
        out[j] = uniform(seed + 2000, 8 * q + j, -1.2f, 1.2f) * (kind == HUGE_SIZE  ? 2.5e38f
                                                                 : kind == CLUSTERS ? 5
                                                                                    : size_of(kind)) +
                 (kind == FAR ? 1e6f : 0);
    if (count > 0 && q % 3 == 0) /* on a point */
        memcpy(out, position + 3 * (q * 31 % count), 3 * sizeof *out);
    if (count > 0 && q % 3 == 1) /* beside a point */
        for (size_t j = 0; j < 3; j++)
            out[j] = position[3 * (q * 17 % count) + j] +
                     0.05f * size_of(kind) * uniform(seed + 2000, 8 * q + 5 + j, -1, 1);
    if (q % 20 == 7)
        out[q % 3] = 1e6f;
    if (q % 20 == 13)
        out[q % 3] = -1e30f;
}

static double brute_distance_squared(const float *p, const float q[3])
{
    const double x = (double)p[0] - (double)q[0], y = (double)p[1] - (double)q[1],
                 z = (double)p[2] - (double)q[2];
    return x * x + y * y + z * z;
}

typedef struct ranked {
    double d2;
    uint32_t index;
} ranked;

static int compare_ranked(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    return x->d2 != y->d2 ? (x->d2 > y->d2) - (x->d2 < y->d2) : (x->index > y->index) - (x->index < y->index);
}

static void expect_list(const char *what, const char *where, size_t q, const point_list *list,
                        const bool *wanted, size_t count)
{
    size_t at = 0;
    for (size_t i = 0; i < count; i++) {
        const bool got = at < list->count && point_list_index(list, at) == i;
        at += got;
        if (got != wanted[i])
            fail_msg("%s, %s, query %zu: point %zu is %s", where, what, q, i,
                     got ? "there and should not be" : "missing");
    }
    assert_int_equal(at, list->count); /* ascending, nothing twice */
}

static void compare_one_set(shape kind, int mode, uint64_t seed, size_t count)
{
    static float position[3 * MAX_COUNT], radius[MAX_COUNT];
    static bool wanted[MAX_COUNT];
    static ranked rank[MAX_COUNT];
    char where[128];
    snprintf(where, sizeof where, "%s, radii %d, %zu points, seed %llu", shape_names[kind], mode, count,
             (unsigned long long)seed);
    make_points(kind, seed, count, position);
    make_radii(mode, seed, count, size_of(kind), radius);
    point_tree *tree = NULL;
    gbt_error err = {0};
    if (build(position, mode > 0 ? radius : NULL, count, &tree, &err) != GBT_OK)
        fail_msg("%s: %s", where, err.text);
    point_list list = {0};
    for (size_t q = 0; q < 40; q++) {
        float query[3];
        make_query(kind, seed, q, position, count, query);
        for (size_t i = 0; i < count; i++)
            rank[i] = (ranked){brute_distance_squared(position + 3 * i, query), (uint32_t)i};
        qsort(rank, count, sizeof *rank, compare_ranked);

        const size_t ks[] = {1, 3, 8, MAX_K};
        for (size_t n = 0; n < 4; n++) {
            const size_t k = ks[n],
                         skip = q % 2 == 0 || count == 0 ? SIZE_MAX : rank[q % (count < 3 ? count : 3)].index;
            uint32_t index[MAX_K];
            double d2[MAX_K];
            const size_t found = nearest(tree, query, k, skip, index, d2);
            const size_t there = count - (skip != SIZE_MAX);
            assert_int_equal(found, k < there ? k : there);
            for (size_t i = 0, r = 0; i < found; i++, r++) {
                r += rank[r].index == skip;
                if (index[i] != rank[r].index || d2[i] != rank[r].d2)
                    fail_msg("%s, query %zu, k %zu: rank %zu is %u at %.17g, wanted %u at %.17g", where, q, k,
                             i, index[i], d2[i], rank[r].index, rank[r].d2);
            }
        }

        /* A radius that is exactly some distance (or as near as float32 has it), so that boundaries are
           met. */
        float reach = count == 0 ? 1 : (float)sqrt(rank[q * 7 % count].d2);
        reach = q % 10 == 9 ? 1e30f : q % 10 == 8 ? 0 : isfinite(reach) ? reach : FLT_MAX;
        for (size_t i = 0; i < count; i++)
            wanted[i] = brute_distance_squared(position + 3 * i, query) <= (double)reach * (double)reach;
        assert_ok(within(tree, query, reach, &list, NULL));
        expect_list("within", where, q, &list, wanted, count);
        for (size_t i = 0; i < count; i++) {
            const double r = mode > 0 ? (double)radius[i] : 0;
            wanted[i] = brute_distance_squared(position + 3 * i, query) <= r * r;
        }
        assert_ok(containing(tree, query, &list, NULL));
        expect_list("containing", where, q, &list, wanted, count);
        for (size_t i = 0; i < count; i++) {
            const double r = (double)reach + (mode > 0 ? (double)radius[i] : 0);
            wanted[i] = brute_distance_squared(position + 3 * i, query) <= r * r;
        }
        assert_ok(overlapping(tree, query, reach, &list, NULL));
        expect_list("overlapping", where, q, &list, wanted, count);
    }
    point_list_free(&list);
    point_tree_free(tree);
}

static void agrees_with_brute_force(void **state)
{
    const shape kind = (shape)(intptr_t)*state;
    const size_t counts[] = {0, 1, 2, 3, 17, 64, MAX_COUNT};
    for (size_t n = 0; n < sizeof counts / sizeof *counts; n++)
        for (int mode = 0; mode < 4; mode++)
            compare_one_set(kind, mode, 10 * n + (uint64_t)mode, counts[n]);
}

/* Signed distance of the ball to the segment in long double, by the formula of another road: the foot of the
   perpendicular, or an end. */
static long double clearance(const float *c, float radius, const float origin[3], const float dir[3],
                             float t_min, float t_max, long double *size)
{
    long double md = 0, dd = 0, mm = 0;
    for (int j = 0; j < 3; j++) {
        const long double m = (long double)c[j] - (long double)origin[j], d = (long double)dir[j];
        md += m * d;
        dd += d * d;
        mm += m * m;
    }
    long double t = md / dd;
    t = t < (long double)t_min ? (long double)t_min : t > (long double)t_max ? (long double)t_max : t;
    long double e2 = 0;
    for (int j = 0; j < 3; j++) {
        const long double e = ((long double)c[j] - (long double)origin[j]) - t * (long double)dir[j];
        e2 += e * e;
    }
    *size = sqrtl(mm) + fabsl(t) * sqrtl(dd) + (long double)radius;
    return sqrtl(e2) - (long double)radius;
}

static void rays_agree_with_brute_force(void **state)
{
    const shape kind = (shape)(intptr_t)*state;
    static float position[3 * MAX_COUNT], radius[MAX_COUNT];
    size_t crossed = 0, passed = 0, near = 0;
    for (int mode = 0; mode < 4; mode++) {
        const size_t count = MAX_COUNT;
        const uint64_t seed = 100 + (uint64_t)mode;
        make_points(kind, seed, count, position);
        make_radii(mode, seed, count, size_of(kind), radius);
        point_tree *tree = NULL;
        assert_ok(build(position, mode > 0 ? radius : NULL, count, &tree, NULL));
        point_list list = {0};
        for (size_t q = 0; q < 200; q++) {
            float origin[3], target[3], dir[3];
            make_query(kind, seed + 1, q, position, count, origin);
            make_query(kind, seed + 2, q + 1, position, count, target);
            bool some = false;
            for (int j = 0; j < 3; j++) {
                dir[j] =
                    target[j] * 0.5f - origin[j] * 0.5f; /* halved: no overflow between the largest numbers */
                if (q % 5 == 4)
                    dir[j] = j == (int)(q % 3) ? 1e-3f : 0; /* along an axis */
                some = some || dir[j] != 0;
            }
            if (!some)
                continue;
            const float t_min = q % 4 == 1 ? 0.5f : q % 4 == 2 ? -1 : 0, t_max = q % 2 ? INFINITY : 2;
            gbt_error err = {0};
            if (crossed_by(tree, origin, dir, t_min, t_max, &list, &err) != GBT_OK)
                fail_msg("%s: %s", shape_names[kind], err.text);
            size_t at = 0;
            for (size_t i = 0; i < count; i++) {
                const bool got = at < list.count && point_list_index(&list, at) == i;
                at += got;
                long double size;
                const long double gap =
                    clearance(position + 3 * i, mode > 0 ? radius[i] : 0, origin, dir, t_min, t_max, &size);
                if (fabsl(gap) <= 1e-14L * size) { /* a matter of rounding */
                    near++;
                    continue;
                }
                crossed += gap < 0;
                passed += gap > 0;
                if (got != (gap < 0))
                    fail_msg("%s, radii %d, ray %zu, ball %zu: %d, gap %Lg", shape_names[kind], mode, q, i,
                             got, gap);
            }
            assert_int_equal(at, list.count);
        }
        point_list_free(&list);
        point_tree_free(tree);
    }
    assert_true(crossed > 1000 && passed > 1000 && near < crossed + passed);
}

/* ---- another library's answer ---- */

static void agrees_with_flann(void **state)
{
    (void)state;
#ifndef TEST_FLANN
    print_message("FLANN is not there: skipped\n");
    skip();
#else
    enum { COUNT = 5000, K = 8 };
    static float position[3 * COUNT], query[3 * COUNT], flann_d2[COUNT * K];
    static int flann_index[COUNT * K];
    for (int kind = RANDOM; kind <= PLANE; kind++) { /* distinct points: FLANN does not finish on stacks */
        make_points((shape)kind, 5, COUNT, position);
        make_points((shape)kind, 6, COUNT, query);
        struct FLANNParameters p = DEFAULT_FLANN_PARAMETERS;
        p.algorithm = FLANN_INDEX_KDTREE_SINGLE;
        p.checks = -1; /* exact */
        p.cores = 1;
        p.log_level = FLANN_LOG_NONE;
        float speedup;
        flann_index_t flann = flann_build_index_float(position, COUNT, 3, &speedup, &p);
        assert_non_null(flann);
        assert_int_equal(
            flann_find_nearest_neighbors_index_float(flann, query, COUNT, flann_index, flann_d2, K, &p), 0);
        point_tree *tree = NULL;
        assert_ok(build(position, NULL, COUNT, &tree, NULL));
        size_t same = 0;
        for (size_t q = 0; q < COUNT; q++) {
            uint32_t index[K];
            double d2[K];
            assert_int_equal(nearest(tree, query + 3 * q, K, SIZE_MAX, index, d2), K);
            for (size_t i = 0; i < K; i++) {
                same += (int)index[i] == flann_index[q * K + i];
                assert_true(fabs(d2[i] - (double)flann_d2[q * K + i]) <= 1e-5 * d2[i] + 1e-12);
            }
        }
        assert_true(same > COUNT * K * 99 / 100); /* float32 ties aside */
        point_tree_free(tree);
        flann_free_index_float(flann, &p);
    }
#endif
}

/* ---- spacing ---- */

typedef struct spacing_case {
    const char *name;
    size_t count, k;
    float x[8], spacing[8]; /* points on a line; root of the mean square of k distances */
} spacing_case;

static const spacing_case spacing_cases[] = {
    {"no point", 0, 3, {0}, {0}},
    {"lone point", 1, 3, {5}, {0}},
    {"two points", 2, 3, {5, 8}, {3, 3}},
    {"two points in one place", 2, 1, {5, 5}, {0, 0}},
    {"k = 1", 4, 1, {0, 1, 3, 7}, {1, 1, 2, 4}},
    {"k = 2", 3, 2, {0, 1, 8}, {5.70087713f, 5, 7.51664819f}},
    {"pair and another, k = 1", 3, 1, {2, 2, 9}, {0, 0, 7}},
    {"pair and another, k = 2", 3, 2, {2, 2, 9}, {4.94974747f, 4.94974747f, 7}},
    {"stack of k + 1", 4, 2, {2, 2, 2, 9}, {0, 0, 0, 7}},
    {"stack of k", 4, 3, {2, 2, 2, 9}, {4.04145188f, 4.04145188f, 4.04145188f, 7}},
    {"more neighbours than points", 3, 64, {0, 3, 4}, {3.53553391f, 2.23606798f, 2.91547595f}},
};

static void spacing_by_hand(void **state)
{
    const spacing_case *c = *state;
    float position[24] = {0}, spacing[9];
    for (size_t i = 0; i < c->count; i++)
        position[3 * i + 1] = c->x[i];
    for (size_t i = 0; i < 9; i++)
        spacing[i] = -1;
    point_tree *tree = NULL;
    assert_ok(build(position, NULL, c->count, &tree, NULL));
    assert_ok(point_tree_spacing(tree, number_floats(position), c->k, spacing, NULL));
    for (size_t i = 0; i < c->count; i++)
        assert_float_equal(spacing[i], c->spacing[i], 1e-6);
    assert_true(spacing[c->count] == -1);
    point_tree_free(tree);
}

static void spacing_agrees_with_brute_force(void **state)
{
    const shape kind = (shape)(intptr_t)*state;
    static float position[3 * MAX_COUNT], spacing[MAX_COUNT];
    static double d2[MAX_COUNT];
    static ranked rank[MAX_COUNT];
    make_points(kind, 31, MAX_COUNT, position);
    point_tree *tree = NULL;
    assert_ok(build(position, NULL, MAX_COUNT, &tree, NULL));
    for (size_t k = 1; k <= MAX_K; k += 21) {
        assert_ok(point_tree_spacing(tree, number_floats(position), k, spacing, NULL));
        for (size_t i = 0; i < MAX_COUNT; i++) {
            size_t others = 0;
            for (size_t j = 0; j < MAX_COUNT; j++)
                if (j != i)
                    rank[others++] =
                        (ranked){brute_distance_squared(position + 3 * i, position + 3 * j), (uint32_t)j};
            qsort(rank, others, sizeof *rank, compare_ranked);
            double sum = 0;
            for (size_t j = 0; j < k; j++)
                sum += rank[j].d2;
            d2[i] = sqrt(sum / (double)k);
            if (spacing[i] != (float)d2[i])
                fail_msg("%s, k %zu, point %zu: %.9g, wanted %.9g", shape_names[kind], k, i,
                         (double)spacing[i], d2[i]);
        }
    }
    point_tree_free(tree);
}

/* ---- cost, memory, threads ---- */

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double wall_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* All points in a few places: processor time of a tree, of all spacings and of one query; and what they are.
 */
static double stack_seconds(float *position, float *spacing, size_t count, size_t stacks)
{
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < 3; j++)
            position[3 * i + j] = (float)(i % stacks) * 0.25f;
    const double start = cpu_seconds();
    point_tree *tree = NULL;
    assert_ok(build(position, NULL, count, &tree, NULL));
    assert_ok(point_tree_spacing(tree, number_floats(position), 3, spacing, NULL));
    const float query[3] = {0, 0, 0};
    uint32_t index[MAX_K];
    double d2[MAX_K];
    assert_int_equal(nearest(tree, query, MAX_K, 0, index, d2), MAX_K);
    const double seconds = cpu_seconds() - start;
    for (uint32_t i = 0; i < MAX_K; i++) {
        assert_true(d2[i] == 0);
        assert_int_equal(index[i], (i + 1) * (uint32_t)stacks); /* the lowest of the stack, without number 0
                                                                 */
    }
    for (size_t i = 0; i < count; i++)
        assert_true(spacing[i] == 0);
    point_tree_free(tree);
    return seconds;
}

/* Ten times as many points take about ten times as long, in place of a hundred. */
static void stacks_are_not_quadratic(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    float *position = mem_alloc(3 * COUNT, sizeof *position, "test", NULL),
          *spacing = mem_alloc(COUNT, sizeof *spacing, "test", NULL);
    for (size_t stacks = 1; stacks <= 100; stacks *= 10) {
        const double few = stack_seconds(position, spacing, COUNT / 10, stacks),
                     many = stack_seconds(position, spacing, COUNT, stacks);
        if (!(many < 40 * few))
            fail_msg("%zu stacks: %g s for ten times the points of %g s", stacks, many, few);
    }
    mem_free(position);
    mem_free(spacing);
}

/* Every outlier takes a node of the tree, which is as deep as there are outliers of other sizes. */
static void many_coincide_among_outliers(void **state)
{
    (void)state;
    enum { SAME = 3000, SIZES = 27, COUNT = SAME + 6 * SIZES };
    static float position[3 * COUNT];
    static ranked rank[COUNT];
    static bool wanted[COUNT];
    for (int i = 0; i < SIZES; i++)
        for (size_t side = 0; side < 6; side++)
            position[3 * (SAME + 6 * (size_t)i + side) + side / 2] =
                (float)((side % 2 == 0 ? 1 : -1) * pow(30, i - 6));
    point_tree *tree = NULL;
    gbt_error err = {0};
    if (build(position, NULL, COUNT, &tree, &err) != GBT_OK)
        fail_msg("%s", err.text);
    point_list list = {0};
    for (size_t q = 0; q < COUNT; q += q < SAME ? 750 : 1) {
        const float *query = position + 3 * q, reach = 1.5f * (fabsf(query[0]) + fabsf(query[1]));
        uint32_t index[MAX_K];
        double d2[MAX_K];
        for (size_t i = 0; i < COUNT; i++) {
            rank[i] = (ranked){brute_distance_squared(position + 3 * i, query), (uint32_t)i};
            wanted[i] = rank[i].d2 <= (double)reach * (double)reach;
        }
        assert_ok(within(tree, query, reach, &list, NULL));
        expect_list("within", "outliers", q, &list, wanted, COUNT);
        qsort(rank, COUNT, sizeof *rank, compare_ranked);
        assert_int_equal(nearest(tree, query, MAX_K, SIZE_MAX, index, d2), MAX_K);
        for (size_t i = 0; i < MAX_K; i++)
            assert_true(index[i] == rank[i].index && d2[i] == rank[i].d2);
    }
    point_list_free(&list);
    point_tree_free(tree);
}

static void no_memory(void **state)
{
    (void)state;
    static float position[300], radius[100];
    make_points(RANDOM, 1, 100, position);
    make_radii(2, 1, 100, 1, radius);
    gbt_status status = GBT_ERR_NO_MEMORY;
    long n = 0;
    point_tree *tree = NULL;
    for (; status != GBT_OK; n++) {
        assert_true(n < 100);
        tree = (point_tree *)position;
        gbt_error err = {0};
        mem_fail_after(n);
        status = build(position, radius, 100, &tree, &err);
        mem_fail_after(-1);
        assert_true(status == GBT_OK || (status == GBT_ERR_NO_MEMORY && tree == NULL && err.text[0] != '\0'));
    }
    assert_true(n > 5);
    /* Lists grow while they are filled: every growth may fail, and then nothing is answered. */
    const float query[3] = {0, 0, 0}, dir[3] = {1, 0, 0};
    for (int kind = 0; kind < 4; kind++) {
        point_list list = {0};
        status = GBT_ERR_NO_MEMORY;
        for (n = 0; status != GBT_OK; n++) {
            assert_true(n < 100);
            gbt_error err = {0};
            mem_fail_after(n);
            status = kind == 0   ? within(tree, query, 10, &list, &err)
                     : kind == 1 ? overlapping(tree, query, 10, &list, &err)
                     : kind == 2 ? containing(tree, query, &list, &err)
                                 : crossed_by(tree, query, dir, -10, 10, &list, &err);
            mem_fail_after(-1);
            assert_true(status == GBT_OK ||
                        (status == GBT_ERR_NO_MEMORY && list.count == 0 && err.status == status));
            if (status != GBT_OK)
                point_list_free(&list); /* begin again with the least memory */
        }
        assert_true(n > 1);
        assert_true(list.count > 0);
        point_list_free(&list);
    }
    point_tree_free(tree);
}

typedef struct thread_job {
    const point_tree *tree;
    const float *position;
    uint64_t *hash; /* of all answers to a query */
} thread_job;

static void mix(uint64_t *hash, uint64_t value)
{
    *hash = (*hash ^ value) * 0x9E3779B97F4A7C15u;
    *hash ^= *hash >> 31;
}

static void ask(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const thread_job *job = context;
    point_list list = {0};
    for (size_t q = begin; q < end; q++) {
        const float *query = job->position + 3 * q, dir[3] = {query[1], 1, query[0]};
        uint64_t hash = q;
        uint32_t index[5];
        double d2[5];
        const size_t found = nearest(job->tree, query, 5, q, index, d2);
        for (size_t i = 0; i < found; i++)
            mix(&hash, index[i]);
        gbt_status status = overlapping(job->tree, query, 0.05f, &list, NULL);
        for (size_t i = 0; i < list.count; i++)
            mix(&hash, point_list_index(&list, i));
        if (status == GBT_OK)
            status = crossed_by(job->tree, query, dir, 0, 1, &list, NULL); /* the first of all threads
                                                                                      builds */
        for (size_t i = 0; i < list.count; i++)
            mix(&hash, point_list_index(&list, i));
        job->hash[q] = status == GBT_OK ? hash : 0;
    }
    point_list_free(&list);
}

static void same_answers_for_any_threads(void **state)
{
    (void)state;
    enum { COUNT = 10000 };
    float *position = mem_alloc(3 * COUNT, sizeof *position, "test", NULL),
          *radius = mem_alloc(COUNT, sizeof *radius, "test", NULL);
    float *spacing[4];
    uint64_t *hash[4];
    make_points(RANDOM, 8, COUNT, position);
    make_radii(2, 8, COUNT, 0.1f, radius);
    const int threads[4] = {2, 1, 3, 8};
    for (int run = 0; run < 4; run++) {
        parallel_set_threads(threads[run]);
        spacing[run] = mem_alloc(COUNT, sizeof **spacing, "test", NULL);
        hash[run] = mem_alloc(COUNT, sizeof **hash, "test", NULL);
        point_tree *tree = NULL;
        assert_ok(build(position, radius, COUNT, &tree, NULL));
        thread_job job = {.tree = tree, .position = position, .hash = hash[run]};
        parallel_blocks(COUNT, 16, ask, &job);
        assert_ok(point_tree_spacing(tree, number_floats(position), 3, spacing[run], NULL));
        point_tree_free(tree);
        for (size_t i = 0; i < COUNT; i++)
            assert_true(hash[run][i] != 0);
        assert_memory_equal(hash[run], hash[0], COUNT * sizeof **hash);
        assert_memory_equal(spacing[run], spacing[0], COUNT * sizeof **spacing);
    }
    for (int run = 0; run < 4; run++) {
        mem_free(spacing[run]);
        mem_free(hash[run]);
    }
    mem_free(position);
    mem_free(radius);
}

/* ---- real points ---- */

static void garden(void **state)
{
    (void)state;
    enum { COUNT = 138766, RECORD = 15 };
    const char *path = shared_path("data/garden_points/points.ply");
    if (path == NULL)
        skip();
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char line[256];
    bool counted = false, little = false;
    int properties = 0;
    while (fgets(line, sizeof line, file) != NULL && strcmp(line, "end_header\n") != 0) {
        counted = counted || strcmp(line, "element vertex 138766\n") == 0;
        little = little || strcmp(line, "format binary_little_endian 1.0\n") == 0;
        properties += strncmp(line, "property ", 9) == 0;
    }
    assert_true(counted && little && properties == 6); /* float x y z, uchar red green blue */
    float *position = mem_alloc(3 * COUNT, sizeof *position, "test", NULL),
          *spacing = mem_alloc(COUNT, sizeof *spacing, "test", NULL);
    for (size_t i = 0; i < COUNT; i++) {
        unsigned char record[RECORD];
        assert_int_equal(fread(record, RECORD, 1, file), 1);
        memcpy(position + 3 * i, record, 12);
    }
    fclose(file);

    const double t0 = wall_seconds();
    point_tree *tree = NULL;
    assert_ok(build(position, NULL, COUNT, &tree, NULL));
    const double t1 = wall_seconds();
    assert_ok(point_tree_spacing(tree, number_floats(position), 3, spacing, NULL));
    const double t2 = wall_seconds();
    assert_ok(point_tree_spacing(tree, number_floats(position), 1, spacing, NULL));
    const double t3 = wall_seconds();
    print_message("garden, %d threads: build %.0f ms, spacing k = 3 %.0f ms, k = 1 %.0f ms\n",
                  parallel_threads(), 1e3 * (t1 - t0), 1e3 * (t2 - t1), 1e3 * (t3 - t2));
    for (size_t i = 0; i < COUNT; i += 3001) { /* a sample against every point */
        double best = INFINITY;
        for (size_t j = 0; j < COUNT; j++)
            if (j != i)
                best = fmin(best, brute_distance_squared(position + 3 * i, position + 3 * j));
        assert_true(spacing[i] == (float)sqrt(best));
    }
    qsort(spacing, COUNT, sizeof *spacing, compare_floats);
    assert_float_equal(spacing[COUNT / 2], 0.0052808, 1e-7); /* as another tool reported it */
    point_tree_free(tree);
    mem_free(position);
    mem_free(spacing);
}

enum {
    BALLS = sizeof ball_cases / sizeof *ball_cases,
    RAYS = sizeof ray_cases / sizeof *ray_cases,
    SPACINGS = sizeof spacing_cases / sizeof *spacing_cases
};

int main(void)
{
    const struct CMUnitTest others[] = {
        cmocka_unit_test(radii_of_nodes_are_not_too_small),
        cmocka_unit_test(bad_queries_are_refused),
        cmocka_unit_test(bad_points_are_named),
        cmocka_unit_test(agrees_with_flann),
        cmocka_unit_test(stacks_are_not_quadratic),
        cmocka_unit_test(many_coincide_among_outliers),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(garden),
        cmocka_unit_test(same_answers_for_any_threads),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[BALLS + RAYS + SPACINGS + 3 * SHAPE_COUNT + OTHERS];
    size_t count = 0;
    for (size_t i = 0; i < BALLS; i++)
        tests[count++] = (struct CMUnitTest){
            .name = ball_cases[i].name, .test_func = one_ball, .initial_state = (void *)&ball_cases[i]};
    for (size_t i = 0; i < RAYS; i++)
        tests[count++] = (struct CMUnitTest){
            .name = ray_cases[i].name, .test_func = one_ray, .initial_state = (void *)&ray_cases[i]};
    for (size_t i = 0; i < SPACINGS; i++)
        tests[count++] = (struct CMUnitTest){.name = spacing_cases[i].name,
                                             .test_func = spacing_by_hand,
                                             .initial_state = (void *)&spacing_cases[i]};
    for (intptr_t kind = 0; kind < SHAPE_COUNT; kind++) {
        tests[count++] = (struct CMUnitTest){
            .name = shape_names[kind], .test_func = agrees_with_brute_force, .initial_state = (void *)kind};
        tests[count++] = (struct CMUnitTest){.name = shape_names[kind],
                                             .test_func = rays_agree_with_brute_force,
                                             .initial_state = (void *)kind};
        tests[count++] = (struct CMUnitTest){.name = shape_names[kind],
                                             .test_func = spacing_agrees_with_brute_force,
                                             .initial_state = (void *)kind};
    }
    memcpy(tests + count, others, sizeof others);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
