/* SPDX-License-Identifier: Apache-2.0 */
/* tests/bvh/test_mesh.c -- rays against meshes: hand cases, brute force in double, closed meshes, ties, bad
   input. */
#include "test_support.h"

#include <float.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "bvh/mesh.h"

/* A right triangle at z = 5 seen from the origin, wound so that its normal is +z; the same at z = 7, number
   2; number 1 has no area. */
static const float hand_vertices[] = {0, 0, 5, 1, 0, 5, 0,    1, 5, 0, 0, 7,
                                      1, 0, 7, 0, 1, 7, 0.5f, 0, 5, 2, 0, 5};
static const uint32_t hand_triangles[] = {0, 1, 2, 0, 6, 7, 5, 4, 3};

typedef struct hand_case {
    const char *name;
    float origin[3], dir[3], t_max;
    bool hit;
    float t, u, v, normal_z;
    uint32_t triangle;
} hand_case;

static const hand_case hand_cases[] = {
    {"front", {0.25f, 0.5f, 0}, {0, 0, 1}, 100, true, 5, 0.25f, 0.5f, 1, 0},
    {"to infinity", {0.25f, 0.5f, 0}, {0, 0, 1}, INFINITY, true, 5, 0.25f, 0.5f, 1, 0},
    {"t in lengths of dir", {0.25f, 0.5f, 0}, {0, 0, 4}, 100, true, 1.25f, 0.25f, 0.5f, 1, 0},
    {"tiny dir", {0.25f, 0.5f, 0}, {0, 0, 0x1p-100f}, INFINITY, true, 5 * 0x1p100f, 0.25f, 0.5f, 1, 0},
    {"huge dir", {0.25f, 0.5f, 0}, {0, 0, 0x1p120f}, 1, true, 5 * 0x1p-120f, 0.25f, 0.5f, 1, 0},
    {"slanted, components far apart",
     {0.25f, 0.5f, 0},
     {0x1p-20f, 0, 0x1p30f},
     1,
     true,
     5 * 0x1p-30f,
     0.25f,
     0.5f,
     1,
     0},
    {"t beyond float32 is no hit", {0.25f, 0.5f, 0}, {0, 0, 0x1p-127f}, INFINITY, false, 0, 0, 0, 0, 0},
    {"from behind the other is first, normal stays",
     {0.25f, 0.5f, 10},
     {0, 0, -1},
     100,
     true,
     3,
     0.25f,
     0.25f,
     -1,
     2},
    {"between the two", {0.25f, 0.5f, 6}, {0, 0, 1}, 100, true, 1, 0.25f, 0.25f, -1, 2},
    {"t_max is included", {0.25f, 0.5f, 0}, {0, 0, 1}, 5, true, 5, 0.25f, 0.5f, 1, 0},
    {"just short of it", {0.25f, 0.5f, 0}, {0, 0, 1}, 4.9999995f, false, 0, 0, 0, 0, 0},
    {"0 is excluded", {0.25f, 0.5f, 5}, {0, 0, 1}, 100, true, 2, 0.25f, 0.25f, -1, 2},
    {"just before it", {0.25f, 0.5f, 4.9999995f}, {0, 0, 1}, 100, true, 0x1p-21f, 0.25f, 0.5f, 1, 0},
    {"behind", {0.25f, 0.5f, 8}, {0, 0, 1}, 100, false, 0, 0, 0, 0, 0},
    {"beside", {0.75f, 0.5f, 0}, {0, 0, 1}, 100, false, 0, 0, 0, 0, 0},
    {"no area, no hit", {1.5f, 0, 0}, {0, 0, 1}, 100, false, 0, 0, 0, 0, 0},
    {"parallel", {-1, 0.5f, 5}, {1, 0, 0}, 100, false, 0, 0, 0, 0, 0},
    {"empty range", {0.25f, 0.5f, 5}, {0, 0, 1}, 0, false, 0, 0, 0, 0, 0},
    {"bad: origin NaN", {NAN, 0.5f, 0}, {0, 0, 1}, 100, false, 0, 0, 0, 0, 0},
    {"bad: origin infinite", {0.25f, INFINITY, 0}, {0, 0, 1}, 100, false, 0, 0, 0, 0, 0},
    {"bad: origin out of range", {0.25f, 0.5f, -2e12f}, {0, 0, 1}, INFINITY, false, 0, 0, 0, 0, 0},
    {"bad: dir zero", {0.25f, 0.5f, 0}, {0, 0, 0}, 100, false, 0, 0, 0, 0, 0},
    {"bad: dir NaN", {0.25f, 0.5f, 0}, {0, NAN, 1}, 100, false, 0, 0, 0, 0, 0},
    {"bad: dir infinite", {0.25f, 0.5f, 0}, {0, 0, INFINITY}, 100, false, 0, 0, 0, 0, 0},
    {"bad: t_max NaN", {0.25f, 0.5f, 0}, {0, 0, 1}, NAN, false, 0, 0, 0, 0, 0},
    {"bad: t_max negative", {0.25f, 0.5f, 0}, {0, 0, 1}, -1, false, 0, 0, 0, 0, 0},
};

static void hand(void **state)
{
    const hand_case *c = *state;
    mesh_tree *tree = NULL;
    assert_ok(mesh_tree_build(hand_vertices, 8, hand_triangles, 3, &tree, NULL));
    mesh_hit hit, untouched;
    memset(&hit, 0x5a, sizeof hit);
    memset(&untouched, 0x5a, sizeof untouched);
    assert_int_equal(mesh_tree_trace(tree, c->origin, c->dir, c->t_max, &hit), c->hit);
    assert_int_equal(mesh_tree_blocked(tree, c->origin, c->dir, c->t_max), c->hit);
    if (c->hit) {
        assert_true(hit.t == c->t);
        assert_true((float)hit.u == c->u && (float)hit.v == c->v);
        assert_true(hit.normal[0] == 0 && hit.normal[1] == 0 && hit.normal[2] == c->normal_z);
        assert_int_equal(hit.triangle, c->triangle);
    } else {
        assert_memory_equal(&hit, &untouched, sizeof hit);
    }
    mesh_tree_free(tree);
}

static void empty_meshes(void **state)
{
    (void)state;
    const float origin[3] = {0.25f, 0.25f, 0}, dir[3] = {0, 0, 1};
    for (size_t vertex_count = 0; vertex_count <= 8; vertex_count += 8) {
        mesh_tree *tree = NULL;
        assert_ok(mesh_tree_build(hand_vertices, vertex_count, hand_triangles, 0, &tree, NULL));
        assert_non_null(tree);
        mesh_hit hit;
        assert_false(mesh_tree_trace(tree, origin, dir, 100, &hit));
        assert_false(mesh_tree_blocked(tree, origin, dir, 100));
        mesh_tree_free(tree);
    }
    mesh_tree_free(NULL);
}

static void bad_meshes_are_named(void **state)
{
    (void)state;
    const float bad[] = {NAN, INFINITY, -INFINITY, 1.0001e12f, -FLT_MAX};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        float vertices[24];
        memcpy(vertices, hand_vertices, sizeof vertices);
        vertices[13] = bad[i];
        mesh_tree *tree = (mesh_tree *)vertices;
        gbt_error err = {0};
        assert_int_equal(mesh_tree_build(vertices, 8, hand_triangles, 3, &tree, &err), GBT_ERR_ARGUMENT);
        assert_null(tree);
        assert_non_null(strstr(err.text, "vertex 4"));
    }
    mesh_tree *tree = (mesh_tree *)hand_vertices;
    gbt_error err = {0};
    assert_int_equal(mesh_tree_build(hand_vertices, 7, hand_triangles, 3, &tree, &err), GBT_ERR_ARGUMENT);
    assert_null(tree);
    assert_non_null(strstr(err.text, "triangle 1: bad vertex number (wanted < 7, got 7)"));
    err = (gbt_error){0};
    assert_int_equal(mesh_tree_build(hand_vertices, 0, hand_triangles, 1, &tree, &err), GBT_ERR_ARGUMENT);
    assert_int_equal(mesh_tree_build(hand_vertices, (size_t)UINT32_MAX, hand_triangles, 1, &tree, NULL),
                     GBT_ERR_ARGUMENT);
    float at_limit[24];
    memcpy(at_limit, hand_vertices, sizeof at_limit);
    at_limit[13] = -1e12f;
    assert_ok(mesh_tree_build(at_limit, 8, hand_triangles, 3, &tree, NULL));
    mesh_tree_free(tree);
}

enum { SOUP = 400, RAYS = 3000 };

static float uniform(uint64_t seed, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(seed, 7, index);
}

/* Ray against triangle in double: false when there is none, and the smallest of (u, v, 1 - u - v) to know how
   near an edge it is. */
static bool meet(const float *vertices, const uint32_t *corner, const float origin[3], const float dir[3],
                 double *t, double *inside)
{
    double a[3], e1[3], e2[3], o[3], d[3], p[3], q[3];
    for (int j = 0; j < 3; j++) {
        a[j] = (double)vertices[3 * corner[0] + (uint32_t)j];
        e1[j] = (double)vertices[3 * corner[1] + (uint32_t)j] - a[j];
        e2[j] = (double)vertices[3 * corner[2] + (uint32_t)j] - a[j];
        d[j] = (double)dir[j];
        o[j] = (double)origin[j] - a[j];
    }
    dvec_cross(d, e2, p);
    const double det = dvec_dot(e1, p);
    if (det == 0)
        return false;
    dvec_cross(o, e1, q);
    const double u = dvec_dot(o, p) / det, v = dvec_dot(d, q) / det;
    *t = dvec_dot(e2, q) / det;
    *inside = fmin(fmin(u, v), 1 - u - v);
    return true;
}

static void agrees_with_brute_force(void **state)
{
    (void)state;
    size_t hits = 0, misses = 0;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        static float vertices[SOUP * 9];
        static uint32_t triangles[SOUP * 3];
        const float size = seed % 2 ? 0.2f : 2;
        const float offset = seed == 3 ? 1000 : 0;
        for (uint32_t i = 0; i < SOUP; i++)
            for (uint32_t k = 0; k < 3; k++) {
                for (uint32_t j = 0; j < 3; j++)
                    vertices[9 * i + 3 * k + j] = offset + uniform(seed, 100 * i + j, -2, 2) +
                                                  uniform(seed, 100 * i + 10 * k + 10 + j, -size, size);
                triangles[3 * i + k] = 3 * i + k;
            }
        mesh_tree *tree = NULL;
        assert_ok(mesh_tree_build(vertices, 3 * SOUP, triangles, SOUP, &tree, NULL));
        for (uint64_t r = 0; r < RAYS; r++) {
            float origin[3], dir[3];
            for (uint64_t j = 0; j < 3; j++) {
                origin[j] = offset + uniform(seed + 50, 10 * r + j, -4, 4);
                dir[j] = uniform(seed + 50, 10 * r + 5 + j, -1, 1);
            }
            double best = INFINITY, second = INFINITY;
            uint32_t triangle = 0;
            bool clear = true; /* no candidate near an edge or near the ray's start */
            for (uint32_t i = 0; i < SOUP; i++) {
                double t, inside;
                if (!meet(vertices, triangles + 3 * i, origin, dir, &t, &inside) || t < -1e-3 ||
                    inside < -1e-2)
                    continue;
                if (inside < 1e-2 || t < 1e-3)
                    clear = false;
                else if (t < best) {
                    second = best;
                    best = t;
                    triangle = i;
                } else
                    second = fmin(second, t);
            }
            if (!clear || second - best < 1e-3)
                continue;
            mesh_hit hit;
            const bool got = mesh_tree_trace(tree, origin, dir, INFINITY, &hit);
            if (got != (bool)isfinite(best) || mesh_tree_blocked(tree, origin, dir, INFINITY) != got)
                fail_msg("seed %llu ray %llu: hit %d, wanted t %g", (unsigned long long)seed,
                         (unsigned long long)r, got, best);
            if (!got) {
                misses++;
                continue;
            }
            hits++;
            assert_int_equal(hit.triangle, triangle);
            assert_true(fabs((double)hit.t - best) <= 1e-7 * best);
            double normal[3], along = 0, length = 0;
            for (int j = 0; j < 3; j++) {
                normal[j] = (double)hit.normal[j];
                length += normal[j] * normal[j];
            }
            assert_true(fabs(length - 1) < 1e-6);
            for (uint32_t k = 1; k < 3; k++) {
                along = 0;
                for (uint32_t j = 0; j < 3; j++)
                    along += normal[j] * ((double)vertices[9 * triangle + 3 * k + j] -
                                          (double)vertices[9 * triangle + j]);
                assert_true(fabs(along) < 1e-6 * (1 + (double)size));
            }
            for (uint32_t j = 0; j < 3; j++) { /* the barycentric point is the point on the ray */
                const float *a = vertices + 9 * triangle;
                const double point =
                    (1 - hit.u - hit.v) * (double)a[j] + hit.u * (double)a[3 + j] + hit.v * (double)a[6 + j];
                assert_true(fabs(point - ((double)origin[j] + best * (double)dir[j])) <
                            1e-6 * (1 + best + (double)offset));
            }
        }
        mesh_tree_free(tree);
    }
    assert_true(hits > 1000 && misses > 1000);
}

/* A closed cube: no ray from inside escapes, not even through its edges and corners. */
static void closed_mesh_has_no_gaps(void **state)
{
    (void)state;
    float vertices[24];
    for (int i = 0; i < 8; i++)
        vertices[3 * i] = (i & 1) ? 1.1f : -0.9f, vertices[3 * i + 1] = (i & 2) ? 1.3f : -0.7f,
                     vertices[3 * i + 2] = (i & 4) ? 0.8f : -1.2f;
    const uint32_t triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                    2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    mesh_tree *tree = NULL;
    assert_ok(mesh_tree_build(vertices, 8, triangles, 12, &tree, NULL));
    for (uint64_t r = 0; r < 20000; r++) {
        float origin[3], dir[3];
        const uint32_t a = (uint32_t)(r % 8), b = (uint32_t)(r / 8 % 8);
        const float w =
            r % 3 == 0 ? 1 : uniform(9, 10 * r + 7, 0, 1); /* a corner, or a point of an edge or a diagonal */
        for (uint32_t j = 0; j < 3; j++) {
            origin[j] = uniform(9, 10 * r + j, -0.6f, 0.6f);
            dir[j] = w * vertices[3 * a + j] + (1 - w) * vertices[3 * b + j] - origin[j];
        }
        mesh_hit hit;
        if (!mesh_tree_trace(tree, origin, dir, INFINITY, &hit) ||
            !mesh_tree_blocked(tree, origin, dir, INFINITY))
            fail_msg("ray %llu escaped", (unsigned long long)r);
        double facing = 0; /* the cube is wound outwards */
        for (int j = 0; j < 3; j++)
            facing += (double)hit.normal[j] * (double)dir[j];
        assert_true(facing > 0);
    }
    mesh_tree_free(tree);
}

/* Many copies of one triangle among others: the lowest number wins, wherever the copies are. */
static void ties_go_to_the_lowest_number(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static uint32_t triangles[COUNT][3];
    for (uint32_t lowest = 0; lowest < COUNT; lowest += 83) {
        for (uint32_t i = 0; i < COUNT; i++)
            for (uint32_t j = 0; j < 3; j++)
                triangles[i][j] =
                    j + (i < lowest || (i > lowest && i % 5 == 0) ? 3 : 0); /* at z = 7, or at z = 5 */
        mesh_tree *tree = NULL;
        assert_ok(mesh_tree_build(hand_vertices, 8, &triangles[0][0], COUNT, &tree, NULL));
        const float origin[3] = {0.25f, 0.5f, 0}, dir[3] = {0, 0, 1};
        mesh_hit hit;
        assert_true(mesh_tree_trace(tree, origin, dir, 100, &hit));
        assert_int_equal(hit.triangle, lowest);
        assert_true(hit.t == 5);
        mesh_tree_free(tree);
    }
}

static void input_is_copied(void **state)
{
    (void)state;
    float *vertices = mem_alloc(24, sizeof *vertices, "test", NULL);
    uint32_t *triangles = mem_alloc(9, sizeof *triangles, "test", NULL);
    memcpy(vertices, hand_vertices, sizeof hand_vertices);
    memcpy(triangles, hand_triangles, sizeof hand_triangles);
    mesh_tree *tree = NULL;
    assert_ok(mesh_tree_build(vertices, 8, triangles, 3, &tree, NULL));
    memset(vertices, 0, sizeof hand_vertices);
    memset(triangles, 0xff, sizeof hand_triangles);
    mem_free(vertices);
    mem_free(triangles);
    const float origin[3] = {0.25f, 0.5f, 0}, dir[3] = {0, 0, 1};
    mesh_hit hit;
    assert_true(mesh_tree_trace(tree, origin, dir, 100, &hit));
    assert_true(hit.t == 5 && hit.normal[2] == 1);
    mesh_tree_free(tree);
}

static void no_memory(void **state)
{
    (void)state;
    gbt_status status = GBT_ERR_NO_MEMORY;
    long n = 0;
    for (; status != GBT_OK; n++) {
        assert_true(n < 100);
        mesh_tree *tree = (mesh_tree *)&n;
        gbt_error err = {0};
        mem_fail_after(n);
        status = mesh_tree_build(hand_vertices, 8, hand_triangles, 3, &tree, &err);
        mem_fail_after(-1);
        assert_true(status == GBT_OK || (status == GBT_ERR_NO_MEMORY && tree == NULL && err.text[0] != '\0'));
        mesh_tree_free(tree);
    }
    assert_true(n > 1);
}

typedef struct trace_job {
    const mesh_tree *tree;
    mesh_hit *hits;
} trace_job;

static void trace_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    trace_job *job = context;
    for (size_t r = begin; r < end; r++) {
        float origin[3], dir[3];
        for (uint64_t j = 0; j < 3; j++) {
            origin[j] = uniform(77, 10 * r + j, -4, 4);
            dir[j] = uniform(77, 10 * r + 5 + j, -1, 1);
        }
        memset(&job->hits[r], 0, sizeof job->hits[r]);
        mesh_tree_trace(job->tree, origin, dir, INFINITY, &job->hits[r]);
    }
}

/* The build too: a tree made by one thread answers as one made by two. */
static void same_bits_for_any_threads(void **state)
{
    (void)state;
    enum { COUNT = 20000, SIDE = 4000 };
    float *vertices = mem_alloc(9 * SIDE, sizeof *vertices, "test", NULL);
    uint32_t *triangles = mem_alloc(3 * SIDE, sizeof *triangles, "test", NULL);
    mesh_hit *hits[2];
    for (uint32_t i = 0; i < 9 * SIDE; i++)
        vertices[i] = uniform(5, i / 9 * 3 + i % 3, -2, 2) + uniform(6, i, -0.3f, 0.3f);
    for (uint32_t i = 0; i < 3 * SIDE; i++)
        triangles[i] = i;
    for (int run = 0; run < 2; run++) {
        parallel_set_threads(2 - run);
        hits[run] = mem_alloc(COUNT, sizeof **hits, "test", NULL);
        trace_job job = {.hits = hits[run]};
        mesh_tree *tree = NULL;
        assert_ok(mesh_tree_build(vertices, 3 * SIDE, triangles, SIDE, &tree, NULL));
        job.tree = tree;
        parallel_blocks(COUNT, 64, trace_block, &job);
        mesh_tree_free(tree);
    }
    size_t hit_count = 0;
    for (size_t r = 0; r < COUNT; r++) { /* value by value: there is room between them */
        const mesh_hit *a = &hits[0][r], *b = &hits[1][r];
        hit_count += a->t > 0;
        assert_true(a->u == b->u && a->v == b->v && a->t == b->t && a->triangle == b->triangle);
        assert_memory_equal(a->normal, b->normal, sizeof a->normal);
    }
    assert_true(hit_count > COUNT / 20);
    mem_free(hits[0]);
    mem_free(hits[1]);
    mem_free(vertices);
    mem_free(triangles);
}

int main(void)
{
    enum { HAND = sizeof hand_cases / sizeof *hand_cases };
    const struct CMUnitTest others[] = {
        cmocka_unit_test(empty_meshes),
        cmocka_unit_test(bad_meshes_are_named),
        cmocka_unit_test(agrees_with_brute_force),
        cmocka_unit_test(closed_mesh_has_no_gaps),
        cmocka_unit_test(ties_go_to_the_lowest_number),
        cmocka_unit_test(input_is_copied),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(same_bits_for_any_threads),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[HAND + OTHERS];
    for (size_t i = 0; i < HAND; i++)
        tests[i] = (struct CMUnitTest){
            .name = hand_cases[i].name, .test_func = hand, .initial_state = (void *)&hand_cases[i]};
    memcpy(tests + HAND, others, sizeof others);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
