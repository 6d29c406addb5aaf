/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/bench_dense.c -- rate of the matrix products that the decoder makes, one thread; run by hand,
   judged by nobody. */
#include <stdio.h>
#include <stdlib.h>

#include "anchor/dense.h"
#include "base/clock.h"
#include "base/memory.h"

typedef struct shape {
    const char *what;
    size_t m, n, k;
} shape;

/* Best of ten runs of `repeats` products over `m` anchors, in units of 1e9 operations a second. */
static double rate(const dense_kernels *kernels, const shape *s, size_t repeats)
{
    float *a = mem_calloc(s->m * s->k, sizeof *a, "a", NULL),
          *b = mem_calloc(s->k * s->n, sizeof *b, "b", NULL),
          *bias = mem_calloc(s->n, sizeof *bias, "bias", NULL);
    float *c = mem_calloc(s->m * s->n, sizeof *c, "c", NULL);
    if (a == NULL || b == NULL || bias == NULL || c == NULL)
        exit(EXIT_FAILURE);
    double best = 1e30;
    for (int run = 0; run < 10; run++) {
        const double start = clock_process();
        for (size_t i = 0; i < repeats; i++)
            kernels->product(&(dense_product){.m = s->m,
                                              .n = s->n,
                                              .k = s->k,
                                              .a = a,
                                              .a_row = s->k,
                                              .a_step = 1,
                                              .b = b,
                                              .b_row = s->n,
                                              .bias = bias,
                                              .c = c,
                                              .c_row = s->n});
        const double passed = clock_process() - start;
        best = passed < best ? passed : best;
    }
    mem_free(a);
    mem_free(b);
    mem_free(bias);
    mem_free(c);
    return 2e-9 * (double)(s->m * s->n * s->k * repeats) / best;
}

int main(void)
{
    static const shape shapes[] = {
        {"input -> hidden", 240, 96, 36},
        {"hidden -> opacity", 240, 16, 32},
        {"hidden -> scale, rotation", 240, 32, 32},
        {"hidden -> scale, rotation, K=10", 240, 80, 32},
    };
#ifndef NDEBUG
    fputs("warning: built without NDEBUG, these times mean nothing\n", stderr);
#endif
    printf("%-34s %6s %4s %4s %10s\n", "product", "m", "n", "k", "GFLOP/s");
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
        printf("%-34s %6zu %4zu %4zu %10.1f\n", shapes[i].what, shapes[i].m, shapes[i].n, shapes[i].k,
               rate(dense_best(), &shapes[i], 2000));
    return EXIT_SUCCESS;
}
