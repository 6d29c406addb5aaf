/* SPDX-License-Identifier: Apache-2.0 */
/* bench/machine.c -- what one core of this machine can do: fused multiply-adds per second, and bytes per
   second and latency at each level of memory. These are the ceilings in docs/performance.md. Build and run:
   cc -O3 -march=native bench/machine.c -o build/machine && build/machine */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { LANES = 16, CHAINS = 10, LINE_FLOATS = 16 };
typedef float vec __attribute__((vector_size(LANES * sizeof(float))));

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* CHAINS independent chains of operations hide the latency of each. Returns 1e9 vector operations per second,
   each a multiply-add of 16 floats. */
static double fma_rate(float *keep)
{
    vec sum[CHAINS], factor, term;
    for (int k = 0; k < LANES; k++) {
        factor[k] = 0.999f;
        term[k] = 0.001f;
    }
    for (int i = 0; i < CHAINS; i++)
        sum[i] = term;
    const long rounds = 20000000;
    const double start = seconds();
    for (long r = 0; r < rounds; r++)
#pragma GCC unroll 16
        for (int i = 0; i < CHAINS; i++)
            sum[i] = sum[i] * factor + term;
    const double passed = seconds() - start;
    for (int i = 1; i < CHAINS; i++)
        sum[0] += sum[i];
    *keep += sum[0][0];
    return 1e-9 * (double)rounds * CHAINS / passed;
}

static void memory(size_t bytes, float *keep)
{
    const size_t floats = bytes / sizeof(float), lines = floats / LINE_FLOATS,
                 times = ((size_t)1 << 29) / bytes + 1;
    float *data = aligned_alloc(64, bytes);
    uint32_t *order = malloc(lines * sizeof *order);
    if (data == NULL || order == NULL)
        exit(EXIT_FAILURE);
    for (size_t i = 0; i < floats; i++)
        data[i] = 1;
    vec sum[4] = {{0}};
    double start = seconds();
    for (size_t t = 0; t < times; t++)
        for (size_t i = 0; i < floats; i += 4 * LANES)
            for (size_t k = 0; k < 4; k++)
                sum[k] += *(const vec *)(const void *)(data + i + k * LANES);
    const double rate = 1e-9 * (double)(times * bytes) / (seconds() - start);
    *keep += sum[0][0] + sum[1][0] + sum[2][0] + sum[3][0];
    /* A cycle through all cache lines in random order, so that each load must wait for the previous one. */
    uint32_t *ring = (uint32_t *)(void *)data, state = 1;
    for (size_t i = 0; i < lines; i++)
        order[i] = (uint32_t)i;
    for (size_t i = lines - 1; i > 0; i--) {
        state = state * 1664525u + 1013904223u;
        const size_t j = (size_t)((uint64_t)state * i >> 32);
        const uint32_t swap = order[i];
        order[i] = order[j];
        order[j] = swap;
    }
    for (size_t i = 0; i < lines; i++)
        ring[(size_t)order[i] * LINE_FLOATS] = order[(i + 1) % lines] * LINE_FLOATS;
    uint32_t at = order[0] * LINE_FLOATS;
    const int steps = 3000000;
    start = seconds();
    for (int i = 0; i < steps; i++)
        at = ring[at];
    printf("%8zu KB  %6.1f GB/s  %6.1f ns\n", bytes >> 10, rate, 1e9 * (seconds() - start) / steps);
    *keep += (float)at;
    free(data);
    free(order);
}

int main(void)
{
    float keep = 0;
    double best = 0;
    for (int run = 0; run < 5; run++) {
        const double rate = fma_rate(&keep);
        best = rate > best ? rate : best;
    }
    printf("multiply-add of 16 floats: %.2f e9 a second = %.0f GFLOP/s\n", best, best * 2 * LANES);
    static const size_t sizes[] = {32, 768, 8 << 10, 32 << 10, 256 << 10};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        memory(sizes[i] << 10, &keep);
    return keep == 0.12345f; /* so that nothing is optimised away */
}
