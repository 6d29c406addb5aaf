/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/bench_loss.c -- what the training loss and its gradient cost; run by hand, judged by nobody. */
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "image/metrics.h"

enum { RUNS = 7 };

static image noise(int width, int height, uint64_t seed)
{
    image im;
    gbt_error err = {0};
    if (image_alloc(&im, width, height, 3, &err) != GBT_OK)
        exit(EXIT_FAILURE);
    for (size_t i = 0; i < (size_t)width * (size_t)height * 3; i++)
        im.pixels[i] = rng_uniform(seed, 0, i);
    return im;
}

/* Best of some runs, in ms of one processor. */
static double cost(int width, int height)
{
    image x = noise(width, height, 1), y = noise(width, height, 2), d_x = noise(width, height, 3);
    loss_scratch scratch = {0};
    image_loss_result out;
    gbt_error err = {0};
    double best = 1e30;
    for (int run = 0; run < RUNS; run++) {
        const double start = clock_process();
        if (image_loss(&x, &y, NULL, 0.2, &scratch, &d_x, &out, &err) != GBT_OK)
            exit(EXIT_FAILURE);
        const double passed = clock_process() - start;
        best = passed < best ? passed : best;
    }
    loss_scratch_free(&scratch);
    image_free(&x);
    image_free(&y);
    image_free(&d_x);
    return 1e3 * best;
}

int main(void)
{
    static const int sizes[][2] = {{480, 320}, {1080, 1920}, {3072, 2048}};
#ifndef NDEBUG
    fputs("warning: built without NDEBUG, these times mean nothing\n", stderr);
#endif
    printf("%-8s %7s %12s %10s %10s\n", "isa", "threads", "size", "ms", "ns/value");
    for (int isa = CPU_PLAIN; isa <= CPU_AVX512; isa++)
        for (int threads = 1; threads <= 2; threads++)
            for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
                if (isa == CPU_PLAIN && i > 0)
                    continue;
                cpu_limit_isa((cpu_isa)isa);
                parallel_set_threads(threads);
                const double ms = cost(sizes[i][0], sizes[i][1]);
                printf("%-8s %7d %5d x %4d %10.2f %10.2f\n", cpu_isa_name(cpu_best_isa()), threads,
                       sizes[i][0], sizes[i][1], ms, 1e6 * ms / (3.0 * sizes[i][0] * sizes[i][1]));
            }
    return EXIT_SUCCESS;
}
