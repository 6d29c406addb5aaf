/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_symmetric.c -- eigenvectors and Cholesky factors multiply back to what they came from. */
#include "base/near.h"
#include "base/rng.h"
#include "base/symmetric.h"
#include "test_support.h"

enum { MOST = 32 };

/* B B^T of random B with `rank` columns. */
static void make(int n, int rank, uint64_t seed, double *m)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            m[i * n + j] = 0;
            for (int k = 0; k < rank; k++)
                m[i * n + j] += rng_normal(seed, 1, (uint64_t)(i * MOST + k)) *
                                rng_normal(seed, 1, (uint64_t)(j * MOST + k));
        }
}

static void check_eigen(int n, const double *m)
{
    double a[MOST * MOST], v[MOST * MOST], largest = 0;
    memcpy(a, m, (size_t)(n * n) * sizeof *a);
    for (int i = 0; i < n * n; i++)
        largest = fmax(largest, fabs(m[i]));
    symmetric_eigen(a, v, n, 1e-15);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double dot = 0, product = 0;
            for (int k = 0; k < n; k++) {
                dot += v[k * n + i] * v[k * n + j];
                product += m[i * n + k] * v[k * n + j];
            }
            assert_near(dot, i == j, 1e-13);
            assert_near(product, v[i * n + j] * a[j * n + j], 1e-13 * (double)n * largest);
        }
}

static void eigenvectors(void **state)
{
    (void)state;
    static const int sizes[] = {1, 2, 3, 6, MOST};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (uint64_t seed = 0; seed < 20; seed++) {
            double m[MOST * MOST];
            const int n = sizes[s];
            make(n, seed % 3 == 0 ? (n + 1) / 2 : n, seed, m); /* some with eigenvalues of 0 */
            for (int i = 0; i < n * n; i++)
                m[i] *= seed % 2 ? 1e-30 : 1e20;
            check_eigen(n, m);
        }
    static const double zero[9], equal[9] = {5, 0, 0, 0, 5, 0, 0, 0, 5};
    check_eigen(3, zero);
    check_eigen(3, equal);
}

static void cholesky(void **state)
{
    (void)state;
    for (int n = 1; n <= MOST; n++) {
        double m[MOST * MOST], l[MOST * MOST];
        make(n, n, (uint64_t)n, m);
        for (int i = 0; i < n; i++)
            m[i * n + i] += 1;
        symmetric_cholesky(m, l, n, 1e-300);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                double sum = 0;
                for (int k = 0; k < n; k++)
                    sum += l[i * n + k] * l[j * n + k];
                assert_near(sum, m[i * n + j], 1e-12 * (double)n);
                assert_true(j <= i || !(fabs(l[i * n + j]) > 0));
            }
        double x[MOST], b[MOST] = {0};
        for (int i = 0; i < n; i++) {
            x[i] = i - 1.5;
            for (int j = 0; j < n; j++)
                b[i] += m[i * n + j] * (j - 1.5);
        }
        symmetric_cholesky(m, m, n, 1e-300);
        assert_memory_equal(m, l, (size_t)(n * n) * sizeof *m);
        symmetric_solve(l, b, n);
        for (int i = 0; i < n; i++)
            assert_near(b[i], x[i], 1e-10 * (double)n);
    }
    const double singular[4] = {1, 1, 1, 1};
    double l[4];
    symmetric_cholesky(singular, l, 2, 0.25);
    assert_near(l[3], 0.5, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(eigenvectors), cmocka_unit_test(cholesky)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
