/* SPDX-License-Identifier: Apache-2.0 */
/* bench/versus_blas.c -- the decoder's matrix products by our kernels and by OpenBLAS, taking turns, on one
   thread. Needs libopenblas-dev. Build and run: cc -O3 -march=native -Isrc -Iinclude bench/versus_blas.c
   build/release/libgbtrace.a -lopenblas -lm -o build/versus_blas && build/versus_blas */
#include <cblas.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "anchor/dense.h"

extern void openblas_set_num_threads(int threads);

enum { ROWS = 4096, REPEATS = 9, PASSES = 40 };

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static float *numbers(size_t count)
{
    float *out = aligned_alloc(64, (count * sizeof *out + 63) / 64 * 64);
    for (size_t i = 0; out != NULL && i < count; i++)
        out[i] = (float)(rand() % 2001 - 1000) * 1e-3f;
    return out;
}

/* One layer: m rows, k inputs, n outputs. */
static void compare(const char *name, size_t m, size_t k, size_t n)
{
    float *a = numbers(m * k), *b = numbers(k * n), *ours = numbers(m * n), *theirs = numbers(m * n);
    if (a == NULL || b == NULL || ours == NULL || theirs == NULL)
        exit(EXIT_FAILURE);
    const dense_product job = {
        .m = m, .n = n, .k = k, .a = a, .a_row = k, .a_step = 1, .b = b, .b_row = n, .c = ours, .c_row = n};
    double times[2][REPEATS], worst = 0;
    for (int r = 0; r < REPEATS; r++) {
        double start = seconds();
        for (int pass = 0; pass < PASSES; pass++) {
            for (size_t i = 0; i < m * n; i++)
                ours[i] = 0;
            dense_best()->product(&job);
        }
        times[0][r] = seconds() - start;
        start = seconds();
        for (int pass = 0; pass < PASSES; pass++)
            cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)k, b,
                        (int)n, 0, theirs, (int)n);
        times[1][r] = seconds() - start;
    }
    for (size_t i = 0; i < m * n; i++)
        worst = fmax(worst, fabs((double)ours[i] - (double)theirs[i]));
    for (int way = 0; way < 2; way++)
        qsort(times[way], REPEATS, sizeof(double), by_size);
    const double flops = 2e-9 * (double)(m * k * n) * PASSES;
    printf("| %s | %zu x %zu x %zu | %.0f | %.0f | %.2f | %.1g |\n", name, m, k, n,
           flops / times[0][REPEATS / 2], flops / times[1][REPEATS / 2],
           times[1][REPEATS / 2] / times[0][REPEATS / 2], worst);
    free(a);
    free(b);
    free(ours);
    free(theirs);
}

int main(void)
{
    openblas_set_num_threads(1);
    printf("| product | rows x inputs x outputs | ours, GFLOP/s | OpenBLAS | ours faster by | largest "
           "difference |\n|---|---|---|---|---|---|\n");
    compare("hidden layer", ROWS, 36, 32);
    compare("scales and rotations, K = 2", ROWS, 32, 16);
    compare("the same, K = 10", ROWS, 32, 80);
    compare("gradient of weights", 36, ROWS, 32);
    return 0;
}
