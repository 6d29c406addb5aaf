/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/bench_decode.c -- what decoding the anchors of a view costs, and its adjoint; run by hand,
   judged by nobody. */
#include <stdio.h>
#include <stdlib.h>

#include "anchor/decode.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"

enum { OFFSETS = 2, RUNS = 15 };

static void fill(float *values, size_t count, uint64_t stream, float low, float high)
{
    for (size_t i = 0; i < count; i++)
        values[i] = low + (high - low) * rng_uniform(1, stream, i);
}

static void need(gbt_status status)
{
    if (status != GBT_OK)
        exit(EXIT_FAILURE);
}

/* Best of some runs, in ms of one processor. */
static void cost(size_t count)
{
    gbt_error err = {0};
    anchors a = {.offset_count = OFFSETS}, d_a = {.offset_count = OFFSETS};
    need(anchors_resize(&a, count, &err));
    need(anchors_resize(&d_a, count, &err));
    fill(a.position, 3 * count, 1, -2, 2);
    fill(a.feature, ANCHOR_FEATURE_DIM * count, 2, -1, 1);
    fill(a.offset, 3 * OFFSETS * count, 3, -1, 1);
    fill(a.scale_log, 6 * count, 4, -6, -3);
    decoder d;
    need(decoder_init(&d, OFFSETS, false, 1, &err));
    uint32_t *visible = mem_alloc(count, sizeof *visible, "visible", &err);
    float *d_params = mem_calloc(d.param_count, sizeof *d_params, "gradient", &err);
    if (visible == NULL || d_params == NULL)
        exit(EXIT_FAILURE);
    for (size_t i = 0; i < count; i++)
        visible[i] = (uint32_t)i;
    const float camera[3] = {0, 0, -4};
    gaussians g = {0};
    decode_tape tape = {0};
    double forward = 1e30, backward = 1e30;
    for (int run = 0; run < RUNS; run++) {
        const double start = clock_process();
        need(decode_forward(&a, &d, camera, visible, count, 1.0f / 255, &g, &tape, &err));
        const double middle = clock_process();
        need(decode_backward(&a, &d, &tape, &g, &d_a, d_params, &err));
        const double end = clock_process();
        forward = middle - start < forward ? middle - start : forward;
        backward = end - middle < backward ? end - middle : backward;
    }
    printf("%8zu %10zu %10.2f %10.2f\n", count, g.count, 1e3 * forward, 1e3 * backward);
    mem_free(visible);
    mem_free(d_params);
    gaussians_free(&g);
    decode_tape_free(&tape);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&d_a);
}

int main(void)
{
#ifndef NDEBUG
    fputs("warning: built without NDEBUG, these times mean nothing\n", stderr);
#endif
    parallel_set_threads(1);
    printf("%8s %10s %10s %10s\n", "anchors", "Gaussians", "ms", "adjoint");
    cost(20000);
    cost(80000);
    return EXIT_SUCCESS;
}
