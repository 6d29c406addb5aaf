/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/test_dense.c -- the matrix product and the activations: against double, and the same bits on
   every instruction set. */
#include "fixture.h"

#include "anchor/activations.h"
#include "anchor/dense.h"
#include "base/cpu.h"

static const dense_kernels *kernels_of(int isa) { return CPU_VARIANT(dense_kernels, isa); }

/* Distance in units of the last place of `want`. */
static double ulps(float got, double want)
{
    int exponent;
    frexp(want, &exponent);
    return fabs((double)got - want) / ldexp(1.0, exponent - 24);
}

static void activations_are_accurate(void **state)
{
    (void)state;
    double worst_exp = 0, worst_tanh = 0, worst_sigmoid = 0;
    for (int i = -300000; i <= 300000; i++) {
        const float x = (float)i * 1e-4f;
        const double e = exp((double)x);
        worst_exp = fmax(worst_exp, ulps(activation_exp(x), e));
        worst_sigmoid = fmax(worst_sigmoid, ulps(activation_sigmoid(x), 1 / (1 + exp(-(double)x))));
        if (i != 0)
            worst_tanh = fmax(worst_tanh, ulps(activation_tanh(x), tanh((double)x)));
    }
    for (int power = -60; power < 0; power++) { /* tanh is accurate relative to itself near 0, where it
                                                   decides what exists */
        worst_tanh =
            fmax(worst_tanh, ulps(activation_tanh(ldexpf(1.3f, power)), tanh(ldexp((double)1.3f, power))));
        assert_true(activation_tanh(-ldexpf(1.3f, power)) == -activation_tanh(ldexpf(1.3f, power)));
    }
    if (worst_exp > 2 || worst_tanh > 4 || worst_sigmoid > 4)
        fail_msg("exp %.2f, tanh %.2f, sigmoid %.2f ulp", worst_exp, worst_tanh, worst_sigmoid);
}

static void activations_at_their_ends(void **state)
{
    (void)state;
    assert_true(activation_exp(0.0f) == 1.0f && activation_sigmoid(0.0f) == 0.5f &&
                activation_tanh(0.0f) == 0.0f);
    assert_true(activation_exp(1e30f) == activation_exp(30.0f) &&
                activation_exp(-INFINITY) == activation_exp(-30.0f));
    assert_true(activation_sigmoid(INFINITY) == 1.0f &&
                activation_sigmoid(-1e30f) == activation_sigmoid(-30.0f));
    assert_true(activation_exp(-30.0f) * activation_sigmoid(-30.0f) > 1e-30f);
    assert_true(activation_tanh(INFINITY) == 1.0f && activation_tanh(-INFINITY) == -1.0f &&
                activation_tanh(9.5f) == 1.0f);
    assert_true(activation_tanh(NAN) == -1.0f && isfinite(activation_exp(NAN)) &&
                isfinite(activation_sigmoid(NAN)));
}

/* Shapes that hit every tile: rows 10, 5, 3, 1 and columns 16 and 32. */
static void products(void **state)
{
    (void)state;
    const size_t ms[] = {1, 2, 3, 4, 5, 9, 10, 13, 23, 30}, ns[] = {16, 32, 48, 80}, ks[] = {0, 1, 7, 36};
    enum { SIZE = 80 * 80 };
    static float a[SIZE], b[SIZE], start[SIZE], gate[SIZE], got[CPU_ISA_COUNT][SIZE];
    for (size_t i = 0; i < SIZE; i++) {
        a[i] = spread(1, 0, i, -1, 1);
        b[i] = spread(1, 1, i, -1, 1);
        start[i] = spread(1, 2, i, -1, 1);
        gate[i] = i % 7 == 0 ? (i % 2 == 0 ? NAN : 0.0f) : spread(1, 3, i, -1, 1);
    }
    const int best = (int)cpu_best_isa();
    for (size_t mi = 0; mi < 10; mi++)
        for (size_t ni = 0; ni < 4; ni++)
            for (size_t ki = 0; ki < 4; ki++)
                for (int mode = 0; mode < 16; mode++) {
                    const bool transposed = mode & 1, biased = mode & 2, relu = mode & 4, gated = mode & 8;
                    dense_product job = {.m = ms[mi],
                                         .n = ns[ni],
                                         .k = ks[ki],
                                         .a = a,
                                         .a_row = transposed ? 1 : 37,
                                         .a_step = transposed ? 41 : 1,
                                         .b = b,
                                         .b_row = 80,
                                         .bias = biased ? start : NULL,
                                         .relu = relu,
                                         .gate = gated ? gate : NULL,
                                         .c_row = 80};
                    for (int isa = 0; isa <= best; isa++) {
                        memcpy(got[isa], start, sizeof start);
                        job.c = got[isa];
                        kernels_of(isa)->product(&job);
                        assert_memory_equal(got[isa], got[0], sizeof start);
                    }
                    for (size_t i = 0; i < 80; i++)
                        for (size_t j = 0; j < 80; j++) {
                            double want = (double)start[biased && i < job.m && j < job.n ? j : i * 80 + j];
                            if (i < job.m && j < job.n) {
                                for (size_t t = 0; t < job.k; t++)
                                    want += (double)a[i * job.a_row + t * job.a_step] * (double)b[t * 80 + j];
                                want = relu ? fmax(want, 0) : want;
                                want = !gated || gate[i * 80 + j] > 0.0f ? want : 0;
                            }
                            if (!(fabs((double)got[0][i * 80 + j] - want) <= 3e-6))
                                fail_msg("m %zu n %zu k %zu mode %d: [%zu][%zu] is %g, not %g", job.m, job.n,
                                         job.k, mode, i, j, (double)got[0][i * 80 + j], want);
                        }
                }
}

static void relu_stops_nan(void **state)
{
    (void)state;
    const float a[1] = {1.0f};
    float b[16], c[16];
    const float bias[16] = {0};
    for (int i = 0; i < 16; i++)
        b[i] = i % 2 == 0 ? NAN : -0.0f;
    for (int isa = 0; isa <= (int)cpu_best_isa(); isa++) {
        kernels_of(isa)->product(&(dense_product){.m = 1,
                                                  .n = 16,
                                                  .k = 1,
                                                  .a = a,
                                                  .a_row = 1,
                                                  .a_step = 1,
                                                  .b = b,
                                                  .b_row = 16,
                                                  .bias = bias,
                                                  .relu = true,
                                                  .c = c,
                                                  .c_row = 16});
        for (int i = 0; i < 16; i++)
            assert_true(c[i] == 0.0f);
    }
}

static void elementwise_same_bits(void **state)
{
    (void)state;
    enum { COUNT = 1003 };
    static float x[5][COUNT], got[CPU_ISA_COUNT][5][COUNT];
    const float special[] = {0.0f,    -0.0f, INFINITY, -INFINITY, NAN,    1e-30f,
                             -1e-30f, 3e38f, -3e38f,   30.0f,     -30.0f, 1e-41f};
    for (int row = 0; row < 5; row++)
        for (size_t i = 0; i < COUNT; i++)
            x[row][i] = i < 12 ? special[(i + (size_t)row) % 12]
                               : spread(2, (uint64_t)row, i, -40, 40) * (i % 3 == 0 ? 1e-3f : 1.0f);
    for (int isa = 0; isa <= (int)cpu_best_isa(); isa++) {
        const dense_kernels *k = kernels_of(isa);
        void (*const maps[3])(float *, size_t) = {k->exp, k->tanh, k->sigmoid};
        for (int m = 0; m < 3; m++) {
            memcpy(got[isa], x, sizeof x);
            maps[m](got[isa][0], COUNT);
            for (size_t i = 0; i < COUNT; i++) {
                const float one = m == 0   ? activation_exp(x[0][i])
                                  : m == 1 ? activation_tanh(x[0][i])
                                           : activation_sigmoid(x[0][i]);
                assert_memory_equal(&got[isa][0][i], &one, sizeof one);
            }
        }
        memcpy(got[isa], x, sizeof x);
        k->normalize(got[isa][0], got[isa][1], got[isa][2], got[isa][3], got[isa][4], COUNT);
        assert_memory_equal(got[isa], got[0], sizeof x);
        for (size_t i = 0; i < COUNT; i++) {
            double square = 0;
            for (int c = 0; c < 4; c++)
                square += (double)got[isa][c][i] * (double)got[isa][c][i];
            assert_true(fabs(square - 1) < 1e-6);
        }
    }
    float w = 1e-13f, p = 0, q = 0, r = 0, inverse = 5; /* below the floor: no direction, no gradient */
    dense_best()->normalize(&w, &p, &q, &r, &inverse, 1);
    assert_true(w == 1.0f && inverse == 0.0f);
    w = 0;
    p = -2e-12f;
    dense_best()->normalize(&w, &p, &q, &r, &inverse, 1);
    assert_true(w == 0.0f && fabsf(p + 1.0f) < 1e-6f && fabsf(inverse * 2e-12f - 1.0f) < 1e-6f);
}

static void dispatch_follows_the_limit(void **state)
{
    (void)state;
    const cpu_isa best = cpu_best_isa();
    for (int isa = 0; isa <= (int)best; isa++) {
        cpu_limit_isa((cpu_isa)isa);
        assert_ptr_equal(dense_best(), kernels_of(isa));
    }
    cpu_limit_isa(best);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(activations_are_accurate),
        cmocka_unit_test(activations_at_their_ends),
        cmocka_unit_test(products),
        cmocka_unit_test(relu_stops_nan),
        cmocka_unit_test(elementwise_same_bits),
        cmocka_unit_test(dispatch_follows_the_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
