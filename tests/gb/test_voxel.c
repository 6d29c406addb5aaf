/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/test_voxel.c -- the base spatial scale against brute force, and voxel centres. */
#include <float.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "clouds.h"
#include "gb/balls.h"

/* Every pair, in double: squared distances of point i to the others, ascending, in `squared`. */
static void all_distances(const float *position, size_t count, size_t i, double *squared)
{
    size_t n = 0;
    for (size_t j = 0; j < count; j++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            const double d = (double)position[3 * i + (size_t)k] - (double)position[3 * j + (size_t)k];
            sum += d * d;
        }
        if (j != i)
            squared[n++] = sum;
    }
    qsort(squared, n, sizeof *squared, compare_doubles);
}

static double brute_scale(const float *position, size_t count, gbt_voxel_rule rule)
{
    double *squared = malloc(count * sizeof *squared), *value = malloc(count * sizeof *value);
    assert_true(squared != NULL && value != NULL);
    for (size_t i = 0; i < count; i++) {
        all_distances(position, count, i, squared);
        const size_t k = count - 1 < 3 ? count - 1 : 3;
        double mean = 0;
        for (size_t j = 0; j < k; j++)
            mean += squared[j] / (double)k;
        value[i] = rule == GBT_VOXEL_RULE_SQUARED ? mean : sqrt(squared[0]);
    }
    qsort(value, count, sizeof *value, compare_doubles);
    size_t rank = rule == GBT_VOXEL_RULE_SQUARED ? (count / 2 > 0 ? count / 2 - 1 : 0) : (count - 1) / 2;
    double got = value[rank];
    if (got == 0) { /* the median of the positive ones */
        size_t zeros = 0;
        while (zeros < count && value[zeros] == 0)
            zeros++;
        const size_t left = count - zeros;
        assert_true(left > 0);
        got = value[zeros +
                    (rule == GBT_VOXEL_RULE_SQUARED ? (left / 2 > 0 ? left / 2 - 1 : 0) : (left - 1) / 2)];
    }
    free(squared);
    free(value);
    return got;
}

static void scale_equals_brute_force(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 40; seed++)
        for (int rule = 0; rule < 2; rule++) {
            const size_t n = 2 + (size_t)(seed * seed) / 2;
            cloud c = cloud_random(n, seed, seed % 4 == 1 ? 4.5e6 : 0, seed % 4 == 1 ? 1e4 : 1);
            if (seed % 4 == 2) /* duplicates, some of them many times; the first point stays alone */
                for (size_t i = 1; i < n; i++)
                    memcpy(c.position + 3 * i, c.position + 3 * (1 + i % (n / 3 + 1)), 3 * sizeof(float));
            if (seed % 4 == 3) /* a lattice: ties everywhere */
                for (size_t i = 0; i < 3 * n; i++)
                    c.position[i] = rintf(2 * c.position[i]);
            float got = 0;
            const double want = brute_scale(c.position, n, (gbt_voxel_rule)rule);
            assert_ok(balls_voxel_size(c.position, n, (gbt_voxel_rule)rule, &got, &assert_ok_err_));
            if (!(fabs((double)got - want) <= 1e-6 * want))
                fail_msg("seed %llu, %zu points, rule %d: wanted %.9g, got %.9g", (unsigned long long)seed, n,
                         rule, want, (double)got);
            cloud_free(&c);
        }
}

typedef struct scale_case {
    const char *name;
    float x[8]; /* points on the x axis */
    size_t count;
    float spacing, squared;
} scale_case;

static scale_case scale_cases[] = {
    {"no points: 1", {0}, 0, 1, 1},
    {"one point: 1", {5}, 1, 1, 1},
    {"identical points: 1", {5, 5, 5, 5, 5}, 5, 1, 1},
    {"0 and -0 are one place", {0.0f, -0.0f}, 2, 1, 1},
    {"two points: their distance, one neighbour to average", {1, 4}, 2, 3, 9},
    {"three points: two neighbours to average", {0, 1, 3}, 3, 1, 2.5f}, /* spacing 1 1 2; squares 5, 2.5, 6.5:
                                                                           first of 3 */
    {"even count: the lower of the two in the middle", {0, 1, 3, 8}, 4, 1, 18}, /* spacing 1 1 2 5; squares 74
                                                                                   54 38 138 / 3 */
    {"most points doubled: the median of the others", {0, 0, 0, 0, 7, 9, 13}, 7, 2, 89 / 3.0f},
    {"every point doubled: the distinct points", {0, 0, 3, 3, 7, 7}, 6, 3, 6},
    {"every point four times: the distinct points", {0, 0, 0, 0, 2, 2, 2, 2}, 8, 2, 4},
};

static void scale_of_a_line(void **state)
{
    const scale_case *c = *state;
    float position[24] = {0}, got = -1;
    for (size_t i = 0; i < c->count; i++)
        position[3 * i] = c->x[i];
    assert_ok(balls_voxel_size(position, c->count, GBT_VOXEL_RULE_MEDIAN, &got, &assert_ok_err_));
    assert_float_equal(got, c->spacing, 0);
    assert_ok(balls_voxel_size(position, c->count, GBT_VOXEL_RULE_SQUARED, &got, &assert_ok_err_));
    assert_float_equal(got, c->squared, 1e-6f * c->squared);
}

static void scale_is_positive_and_finite_at_the_ends_of_float(void **state)
{
    (void)state;
    const float far[6] = {-FLT_MAX, 0, 0, FLT_MAX, 0, 0}, near[6] = {0, 0, 0, FLT_TRUE_MIN, 0, 0};
    for (int rule = 0; rule < 2; rule++) {
        float got = -1;
        assert_ok(balls_voxel_size(far, 2, (gbt_voxel_rule)rule, &got, &assert_ok_err_));
        assert_true(got == FLT_MAX);
        assert_ok(balls_voxel_size(near, 2, (gbt_voxel_rule)rule, &got, &assert_ok_err_));
        assert_true(got == FLT_TRUE_MIN);
    }
}

/* A tree that must list all points at distance 0 to break the tie would need minutes here. */
static void many_duplicates_are_quick(void **state)
{
    (void)state;
    enum { N = 200000 };
    cloud c = cloud_random(N, 3, 0, 1);
    for (size_t i = 0; i < N / 2; i++)
        memcpy(c.position + 3 * i, c.position, 3 * sizeof(float));
    float got = 0;
    assert_ok(balls_voxel_size(c.position, N, GBT_VOXEL_RULE_SQUARED, &got, &assert_ok_err_));
    assert_true(got > 0 && got < 1);
    cloud_free(&c);
}

static void same_scale_for_any_thread_count(void **state)
{
    (void)state;
    const int before = parallel_threads();
    cloud c = cloud_random(20000, 8, 0, 1);
    for (int rule = 0; rule < 2; rule++) {
        float want = 0, got = 0;
        parallel_set_threads(1);
        assert_ok(balls_voxel_size(c.position, c.count, (gbt_voxel_rule)rule, &want, &assert_ok_err_));
        for (int threads = 2; threads <= 8; threads += 3) {
            parallel_set_threads(threads);
            assert_ok(balls_voxel_size(c.position, c.count, (gbt_voxel_rule)rule, &got, &assert_ok_err_));
            assert_memory_equal(&got, &want, sizeof got);
        }
    }
    parallel_set_threads(before);
    cloud_free(&c);
}

static void centers_are_the_distinct_cells(void **state)
{
    (void)state;
    /* Halves go to the even cell; -0.1 and 0.1 share cell 0, whose centre is +0; order is by x, then y, then
       z. */
    const float position[] = {0.25f, 0,    0,  0.75f, 0,    0,  -0.1f, 0.1f, 0,  1.2f, 0,
                              0,     0.9f, -3, 0,     0.9f, -3, 2,     0.9f, -3, -2};
    const float want[] = {0, 0, 0, 1, -3, -2, 1, -3, 0, 1, -3, 2, 1, 0, 0};
    float *got;
    size_t count;
    assert_ok(voxel_centers(position, 7, 0.5f, &got, &count, &assert_ok_err_));
    assert_int_equal(count, 5); /* 0.25 / 0.5 -> 0, 0.75 / 0.5 -> 2, 1.2 / 0.5 -> 2, 0.9 / 0.5 -> 2 */
    assert_memory_equal(got, want, sizeof want);
    mem_free(got);
    assert_ok(voxel_centers(NULL, 0, 0.5f, &got, &count, &assert_ok_err_));
    assert_int_equal(count, 0);
    assert_non_null(got);
    mem_free(got);
}

/* Every point lies within half a cell of a centre, every centre is a cell, strictly ascending; the input
   order does not matter. */
static void centers_cover_the_cloud(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 6; seed++) {
        const double size = pow(10, (double)seed - 3);
        cloud c = cloud_random(800, seed, 0, size);
        const float v = (float)(0.37 * size);
        float *got, *again;
        size_t count, count_again;
        assert_ok(voxel_centers(c.position, c.count, v, &got, &count, &assert_ok_err_));
        assert_true(count > 100 && count < 800);
        unsigned char *used = calloc(count, 1);
        assert_non_null(used);
        for (size_t i = 0; i < c.count; i++) {
            size_t homes = 0;
            for (size_t j = 0; j < count; j++) {
                int inside = 1;
                for (size_t k = 0; k < 3; k++)
                    inside = inside && fabsf(got[3 * j + k] - c.position[3 * i + k]) <= 0.50001f * v;
                homes += inside != 0;
                used[j] |= inside != 0;
            }
            assert_true(homes >= 1);
        }
        for (size_t j = 0; j < count; j++) {
            assert_int_equal(used[j], 1);
            for (size_t k = 0; k < 3; k++)
                assert_true(got[3 * j + k] == rintf(got[3 * j + k] / v) * v);
            const float *a = got + 3 * j - 3, *b = got + 3 * j;
            if (j > 0)
                assert_true(a[0] < b[0] || (a[0] == b[0] && (a[1] < b[1] || (a[1] == b[1] && a[2] < b[2]))));
        }
        for (size_t i = 0; i < c.count / 2; i++)
            for (size_t k = 0; k < 3; k++) {
                const float keep = c.position[3 * i + k];
                c.position[3 * i + k] = c.position[3 * (c.count - 1 - i) + k];
                c.position[3 * (c.count - 1 - i) + k] = keep;
            }
        assert_ok(voxel_centers(c.position, c.count, v, &again, &count_again, &assert_ok_err_));
        assert_int_equal(count_again, count);
        assert_memory_equal(again, got, 3 * count * sizeof *got);
        free(used);
        mem_free(got);
        mem_free(again);
        cloud_free(&c);
    }
}

static void bad_input_is_refused(void **state)
{
    (void)state;
    const float fine[6] = {1, 2, 3, 4, 5, 6}, nan_point[6] = {1, 2, 3, 4, NAN, 6}, far[3] = {1e30f, 0, 0},
                edge[3] = {0, FLT_MAX, 0};
    const struct {
        const float *position;
        size_t count;
        float voxel_size;
        const char *text;
    } rows[] = {
        {fine, 2, 0, "voxel_size"},
        {fine, 2, -1, "voxel_size"},
        {fine, 2, NAN, "voxel_size"},
        {fine, 2, INFINITY, "voxel_size"},
        {nan_point, 2, 1, "point 1 "},
        {far, 1, 1e-30f, "point 0 "},
        {edge, 1, 0.66f * FLT_MAX, "point 0 "},
        {NULL, 2, 1, "no positions"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_error err = {0};
        float *centers = (float *)8;
        size_t count = 77;
        assert_int_equal(
            voxel_centers(rows[i].position, rows[i].count, rows[i].voxel_size, &centers, &count, &err),
            GBT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, rows[i].text));
        assert_null(centers);
        assert_int_equal(count, 0);
    }
    gbt_error err = {0};
    float scale = -1;
    assert_int_equal(balls_voxel_size(nan_point, 2, GBT_VOXEL_RULE_MEDIAN, &scale, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "point 1 "));
    assert_true(scale == 1.0f);
    err = (gbt_error){0};
    assert_int_equal(balls_voxel_size(fine, 2, (gbt_voxel_rule)7, &scale, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "rule 7"));
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    cloud c = cloud_random(300, 31, 0, 1);
    long failures = 0;
    for (long k = 0;; k++) {
        gbt_error err = {0};
        float scale = -1;
        mem_fail_after(k);
        const gbt_status status = balls_voxel_size(c.position, c.count, GBT_VOXEL_RULE_MEDIAN, &scale, &err);
        mem_fail_after(-1);
        if (status == GBT_OK)
            break;
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_true(err.text[0] != '\0' && scale == 1.0f);
        failures++;
    }
    assert_true(failures >= 2);
    gbt_error err = {0};
    float *centers;
    size_t count;
    mem_fail_after(0);
    const gbt_status status = voxel_centers(c.position, c.count, 0.5f, &centers, &count, &err);
    mem_fail_after(-1);
    assert_int_equal(status, GBT_ERR_NO_MEMORY);
    assert_true(centers == NULL && count == 0 && err.text[0] != '\0');
    cloud_free(&c);
}

/* The true median spacing of the garden points, by an independent implementation in double: 0.0052808. */
static void garden_has_the_known_spacing(void **state)
{
    (void)state;
    cloud c = cloud_garden();
    if (c.position == NULL)
        skip();
    float spacing = 0, squared = 0;
    assert_ok(balls_voxel_size(c.position, c.count, GBT_VOXEL_RULE_MEDIAN, &spacing, &assert_ok_err_));
    assert_ok(balls_voxel_size(c.position, c.count, GBT_VOXEL_RULE_SQUARED, &squared, &assert_ok_err_));
    print_message("garden: median spacing %.9g, reference code's quantity %.9g\n", (double)spacing,
                  (double)squared);
    assert_float_equal(spacing, 0.0052808f, 5e-8f);
    assert_true(squared > 0 && squared < 10 * spacing * spacing);
    cloud_free(&c);
}

/* What the reference implementation counts, in the world's coordinates. */
static void garden_has_the_references_voxels(void **state)
{
    (void)state;
    static const struct {
        float voxel_size;
        size_t count;
    } wanted[] = {{0.001f, 132996}, {0.00528082391f, 115131}};
    cloud c = cloud_garden();
    if (c.position == NULL)
        skip();
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        float *centers;
        size_t count;
        assert_ok(
            voxel_centers(c.position, c.count, wanted[i].voxel_size, &centers, &count, &assert_ok_err_));
        assert_int_equal(count, wanted[i].count);
        mem_free(centers);
    }
    cloud_free(&c);
}

int main(void)
{
    enum { SCALES = sizeof scale_cases / sizeof *scale_cases };
    static const struct CMUnitTest others[] = {
        cmocka_unit_test(scale_equals_brute_force),
        cmocka_unit_test(scale_is_positive_and_finite_at_the_ends_of_float),
        cmocka_unit_test(many_duplicates_are_quick),
        cmocka_unit_test(same_scale_for_any_thread_count),
        cmocka_unit_test(centers_are_the_distinct_cells),
        cmocka_unit_test(centers_cover_the_cloud),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(garden_has_the_known_spacing),
        cmocka_unit_test(garden_has_the_references_voxels),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[SCALES + OTHERS];
    for (int i = 0; i < SCALES; i++)
        tests[i] = (struct CMUnitTest){
            .name = scale_cases[i].name, .test_func = scale_of_a_line, .initial_state = &scale_cases[i]};
    for (int i = 0; i < OTHERS; i++)
        tests[SCALES + i] = others[i];
    return _cmocka_run_group_tests("voxel", tests, SCALES + OTHERS, NULL, NULL);
}
