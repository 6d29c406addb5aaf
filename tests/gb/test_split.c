/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/test_split.c -- rank selection, principal axes, and the cut at the median. */
#include "base/compare.h"
#include "clouds.h"
#include "gb/split.h"

/* Shapes that defeat careless quickselects: sorted, reversed, organ pipe, few values, all equal, saw,
   random. */
static double shaped(int shape, size_t i, size_t n, uint64_t seed)
{
    switch (shape) {
    case 0:
        return (double)i;
    case 1:
        return (double)(n - i);
    case 2:
        return (double)(i < n / 2 ? i : n - i);
    case 3:
        return (double)(i * 7919 % 3);
    case 4:
        return 1.5;
    case 5:
        return (double)(i % 17) - 1e6 * (double)(i == n / 3);
    default:
        return rng_normal(seed, 2, i);
    }
}

static void check_select(size_t n, int shape, size_t rank)
{
    double *keys = malloc(n * sizeof *keys), *sorted = malloc(n * sizeof *sorted);
    assert_true(keys != NULL && sorted != NULL);
    for (size_t i = 0; i < n; i++)
        sorted[i] = keys[i] = shaped(shape, i, n, 5);
    qsort(sorted, n, sizeof *sorted, compare_doubles);
    const double got = split_select(keys, n, rank);
    if (got != sorted[rank])
        fail_msg("n %zu shape %d rank %zu: wanted %g, got %g", n, shape, rank, sorted[rank], got);
    assert_true(keys[rank] == got);
    for (size_t i = 0; i < n; i++)
        assert_true(i < rank ? keys[i] <= got : keys[i] >= got);
    qsort(keys, n, sizeof *keys, compare_doubles); /* nothing lost, nothing doubled */
    assert_memory_equal(keys, sorted, n * sizeof *keys);
    free(keys);
    free(sorted);
}

static void select_finds_every_rank(void **state)
{
    (void)state;
    for (int shape = 0; shape < 7; shape++) {
        for (size_t n = 1; n <= 40; n++)
            for (size_t rank = 0; rank < n; rank++)
                check_select(n, shape, rank);
        for (size_t n = 255; n <= 20001; n = n * 3 + 1) {
            check_select(n, shape, 0);
            check_select(n, shape, (n - 1) / 2);
            check_select(n, shape, n - 1);
        }
    }
}

/* An adversary (after McIlroy): plays the selection on keys that are not yet decided, and makes whatever it
   samples the smallest so far. Each round then drops a handful of keys. A selection that does not notice
   would need n^2 / 20 steps. */
static void select_survives_bad_pivots(void **state)
{
    (void)state;
    enum { N = 40000, ROUNDS = 120 };
    double *key = malloc(N * sizeof *key),
           *keys = malloc(N * sizeof *keys); /* key of an element; keys in input order */
    size_t *at = malloc(N * sizeof *at);     /* element at a place, as the selection moves them */
    assert_true(key != NULL && keys != NULL && at != NULL);
    for (size_t i = 0; i < N; i++) {
        key[i] = INFINITY;
        at[i] = i;
    }
    double next = 0;
    ptrdiff_t low = 0;
    const ptrdiff_t high = N - 1;
    for (int round = 0; round < ROUNDS; round++) {
        const ptrdiff_t n = high - low, middle = low + n / 2, step = n / 8;
        const ptrdiff_t sampled[9] = {low,           low + step,      low + 2 * step, middle - step, middle,
                                      middle + step, high - 2 * step, high - step,    high};
        double sample[9];
        for (int i = 0; i < 9; i++) {
            if (isinf(key[at[sampled[i]]]))
                key[at[sampled[i]]] = next++;
            sample[i] = key[at[sampled[i]]];
        }
        double medians[3];
        for (int i = 0; i < 3; i++) {
            qsort(sample + 3 * i, 3, sizeof *sample, compare_doubles);
            medians[i] = sample[3 * i + 1];
        }
        qsort(medians, 3, sizeof *medians, compare_doubles);
        ptrdiff_t i = low, j = high;
        while (i <= j) {
            while (key[at[i]] < medians[1])
                i++;
            while (key[at[j]] > medians[1])
                j--;
            if (i <= j) {
                const size_t keep = at[i];
                at[i++] = at[j];
                at[j--] = keep;
            }
        }
        low = i; /* the rank is far above: the selection goes on to the right */
    }
    assert_true(low < N / 10);
    for (size_t i = 0; i < N; i++)
        if (isinf(key[i]))
            key[i] = next++;
    memcpy(keys, key, N * sizeof *keys);
    assert_true(split_select(keys, N, N / 2) == N / 2); /* the keys are 0 .. N - 1 */
    free(key);
    free(keys);
    free(at);
}

typedef struct axes_case {
    const char *name;
    double covariance[6];
    double first[3];
} axes_case;

static axes_case axes_cases[] = {
    {"zero matrix: x", {0, 0, 0, 0, 0, 0}, {1, 0, 0}},
    {"three equal eigenvalues: x", {2, 0, 0, 2, 0, 2}, {1, 0, 0}},
    {"two equal eigenvalues: the lower axis", {1, 0, 0, 2, 0, 2}, {0, 1, 0}},
    {"z is longest", {1, 0, 0, 2, 0, 3}, {0, 0, 1}},
    {"line along x = y", {1, 1, 0, 1, 0, 0}, {0.70710678118654752, 0.70710678118654752, 0}},
    {"line along x = -y: the tie in size makes x positive",
     {1, -1, 0, 1, 0, 0},
     {0.70710678118654752, -0.70710678118654752, 0}},
    {"a tie up to rounding is a tie: x positive",
     {1, -1 - 1e-12, 0, 1 + 2e-12, 0, 0},
     {0.70710678118654752, -0.70710678118654752, 0}},
    {"line along (1, -2, 2): y and z tie, y positive", {1, -2, 2, 4, -4, 4}, {-1 / 3.0, 2 / 3.0, -2 / 3.0}},
    {"line along (-1, -3, 2): the largest is positive",
     {1, 3, -2, 9, -6, 4},
     {0.26726124191242440, 0.80178372573727319, -0.53452248382484879}},
    {"tiny units",
     {1e-90, 3e-90, -2e-90, 9e-90, -6e-90, 4e-90},
     {0.26726124191242440, 0.80178372573727319, -0.53452248382484879}},
    {"huge units",
     {1e77, 3e77, -2e77, 9e77, -6e77, 4e77},
     {0.26726124191242440, 0.80178372573727319, -0.53452248382484879}},
};

static void first_axis(void **state)
{
    const axes_case *c = *state;
    double axes[3][3];
    split_axes(c->covariance, axes);
    for (int k = 0; k < 3; k++)
        if (!(fabs(axes[0][k] - c->first[k]) < 1e-12))
            fail_msg("axis: wanted %.17g %.17g %.17g, got %.17g %.17g %.17g", c->first[0], c->first[1],
                     c->first[2], axes[0][0], axes[0][1], axes[0][2]);
}

/* C u = lambda u, lambda falling, u orthonormal, largest component positive; matrices of any rank and scale
   ratio. */
static void axes_are_eigenvectors(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 2000; seed++) {
        double b[3][3], c[6], axes[3][3], lambda[3];
        for (int i = 0; i < 9; i++)
            b[i / 3][i % 3] = rng_normal(seed, 3, (uint64_t)i) * pow(10, (double)(seed % 7) * (i / 3) * -1.0);
        const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (int i = 0; i < 3; i++)
            for (int j = i; j < 3; j++)
                c[at[i][j]] = b[0][i] * b[0][j] + b[1][i] * b[1][j] + b[2][i] * b[2][j];
        split_axes(c, axes);
        for (int a = 0; a < 3; a++) {
            double product[3], largest = 0;
            lambda[a] = 0;
            for (int i = 0; i < 3; i++) {
                product[i] = c[at[i][0]] * axes[a][0] + c[at[i][1]] * axes[a][1] + c[at[i][2]] * axes[a][2];
                lambda[a] += product[i] * axes[a][i];
                if (fabs(axes[a][i]) > fabs(largest))
                    largest = axes[a][i];
            }
            const double norm = c[0] + c[3] + c[5];
            for (int i = 0; i < 3; i++)
                if (!(fabs(product[i] - lambda[a] * axes[a][i]) < 1e-13 * norm))
                    fail_msg("seed %llu axis %d: residual %g", (unsigned long long)seed, a,
                             product[i] - lambda[a] * axes[a][i]);
            assert_true(largest > 0);
            for (int d = 0; d < 3; d++) {
                const double dot =
                    axes[a][0] * axes[d][0] + axes[a][1] * axes[d][1] + axes[a][2] * axes[d][2];
                assert_true(fabs(dot - (a == d)) < 1e-13);
            }
            if (a > 0)
                assert_true(lambda[a] <= lambda[a - 1] + 1e-13 * norm);
        }
    }
}

/* The first axis of these moments separates nothing, so the second one must. */
static void an_axis_that_separates_nothing_gives_way(void **state)
{
    (void)state;
    cloud_point points[5];
    double keys[5];
    for (uint32_t i = 0; i < 5; i++)
        points[i] = (cloud_point){{7.0f, (float)(i * 3 % 5), 2.0f}, i};
    const moments m = {{7, 2, 2}, {9, 0, 0, 4, 0, 1}};
    assert_int_equal(split_at_median(points, keys, 5, &m, false), 3);
    for (int i = 0; i < 5; i++)
        assert_true(i < 3 ? points[i].position[1] <= 2.0f : points[i].position[1] > 2.0f);
    const moments third = {{7, 2, 2}, {9, 0, 0, 4, 0, 1}};
    for (uint32_t i = 0; i < 5; i++)
        points[i] = (cloud_point){{7.0f, 2.0f, i == 4 ? 3.0f : 1.0f}, i};
    assert_int_equal(split_at_median(points, keys, 5, &third, false), 4);
    for (uint32_t i = 0; i < 5; i++)
        points[i] = (cloud_point){{7.0f, 2.0f, 1.0f}, i};
    assert_int_equal(split_at_median(points, keys, 5, &third, false), 0); /* no axis */
}

/* {1, 4, 4}: the median is the maximum. A set that the first axis does not separate at all is not such a
   tie. */
static void a_tied_set_may_be_kept(void **state)
{
    (void)state;
    cloud_point points[3];
    double keys[3];
    for (uint32_t i = 0; i < 3; i++)
        points[i] = (cloud_point){{i == 1 ? 1.0f : 4.0f, 2.0f, 0.0f}, i};
    const moments m = {{3, 2, 0}, {2, 0, 0, 0, 0, 0}};
    assert_int_equal(split_at_median(points, keys, 3, &m, true), 0);
    assert_int_equal(split_at_median(points, keys, 3, &m, false), 1);
    assert_int_equal(points[0].index, 1);
    const moments other_axis = {{3, 2, 0}, {0, 0, 0, 0, 0, 9}};
    assert_int_equal(split_at_median(points, keys, 3, &other_axis, true), 0); /* x comes second and ties */
    for (uint32_t i = 0; i < 3; i++)
        points[i] = (cloud_point){{(float)i, 2.0f, 0.0f}, i};
    assert_int_equal(split_at_median(points, keys, 3, &other_axis, true), 2); /* x comes second and cuts */
}

int main(void)
{
    enum { AXES = sizeof axes_cases / sizeof *axes_cases };
    struct CMUnitTest tests[AXES + 5];
    for (int i = 0; i < AXES; i++)
        tests[i] = (struct CMUnitTest){
            .name = axes_cases[i].name, .test_func = first_axis, .initial_state = &axes_cases[i]};
    tests[AXES] = (struct CMUnitTest)cmocka_unit_test(select_finds_every_rank);
    tests[AXES + 1] = (struct CMUnitTest)cmocka_unit_test(select_survives_bad_pivots);
    tests[AXES + 2] = (struct CMUnitTest)cmocka_unit_test(axes_are_eigenvectors);
    tests[AXES + 3] = (struct CMUnitTest)cmocka_unit_test(an_axis_that_separates_nothing_gives_way);
    tests[AXES + 4] = (struct CMUnitTest)cmocka_unit_test(a_tied_set_may_be_kept);
    return _cmocka_run_group_tests("split", tests, AXES + 5, NULL, NULL);
}
