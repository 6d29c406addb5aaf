/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/bench_gb.c -- points per second of this room on random points; run by hand, judged by nobody.
   usage: bench_gb [POINTS] */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "gb/balls.h"

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    const size_t count = argc > 1 ? (size_t)strtoull(argv[1], NULL, 10) : 1000000;
    float *position = mem_alloc(count, 3 * sizeof *position, "position", NULL),
          *color = mem_alloc(count, 3 * sizeof *color, "color", NULL);
    if (position == NULL || color == NULL)
        return EXIT_FAILURE;
    for (size_t i = 0; i < 3 * count; i++) {
        position[i] = (float)rng_normal(1, 0, i);
        color[i] = rng_uniform(1, 1, i);
    }
#ifndef NDEBUG
    fputs("warning: built without NDEBUG, these times mean nothing\n", stderr);
#endif
    printf("%-22s %9s %8s %10s %14s\n", "what", "points", "threads", "seconds", "points/second");
    for (int threads = 1; threads <= 2; threads++) {
        parallel_set_threads(threads);
        double best[3] = {1e30, 1e30, 1e30};
        for (int run = 0; run < 3; run++) {
            gbt_error err = {0};
            balls_def def = balls_def_default();
            const double start = seconds();
            if (balls_voxel_size(position, count, GBT_VOXEL_RULE_MEDIAN, &def.voxel_size, &err) != GBT_OK)
                return EXIT_FAILURE;
            const double sized = seconds();
            balls b;
            if (balls_build(position, color, count, &def, &b, &err) != GBT_OK)
                return EXIT_FAILURE;
            const double built = seconds();
            balls_free(&b);
            float *centers;
            size_t center_count;
            const double again = seconds();
            if (voxel_centers(position, count, def.voxel_size, &centers, &center_count, &err) != GBT_OK)
                return EXIT_FAILURE;
            const double took[3] = {sized - start, built - sized, seconds() - again};
            mem_free(centers);
            for (int i = 0; i < 3; i++)
                best[i] = took[i] < best[i] ? took[i] : best[i];
        }
        static const char *const names[3] = {"balls_voxel_size", "balls_build", "voxel_centers"};
        for (int i = 0; i < 3; i++)
            printf("%-22s %9zu %8d %10.3f %14.3e\n", names[i], count, threads, best[i],
                   (double)count / best[i]);
    }
    mem_free(position);
    mem_free(color);
    return EXIT_SUCCESS;
}
