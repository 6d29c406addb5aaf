/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_passes.c -- time several ways to render the same Gaussians and rays, traced or splatted,
   taking turns. */
#include "benchmark/bench_passes.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "bvh/device.h"
#include "frame/frame.h"

enum {
    SAMPLE_BUILD,
    SAMPLE_FORWARD,
    SAMPLE_ADJOINT,
    SAMPLE_FORWARD_CPU,
    SAMPLE_ADJOINT_CPU,
    SAMPLE_BUILD_CPU,
    SAMPLE_COUNT
};

static const char *const kernel_names[] = {
    [TRACE_LIST] = "list",     [TRACE_TREE] = "tree",     [TRACE_SINGLE] = "single",
    [TRACE_EMBREE] = "embree", [BENCH_SPLATS] = "splats", [BENCH_PACKET_ORDER] = "packet"};

const char *bench_kernel_name(int kernel) { return kernel_names[kernel]; }

size_t bench_kernels_parse(const char *list, int *out, size_t capacity)
{
    size_t count = 0;
    for (const char *word = list;; word++) {
        const size_t length = strcspn(word, ",");
        size_t kernel = 0;
        while (kernel < sizeof kernel_names / sizeof *kernel_names &&
               (strlen(kernel_names[kernel]) != length || strncmp(word, kernel_names[kernel], length) != 0))
            kernel++;
        if (kernel == sizeof kernel_names / sizeof *kernel_names || count == capacity)
            return 0;
        for (size_t i = 0; i < count; i++)
            if (out[i] == (int)kernel)
                return 0;
        out[count++] = (int)kernel;
        word += length;
        if (*word == '\0')
            return count;
    }
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return values[count / 2];
}

typedef struct passes {
    const gaussians *g;
    const ray_image *rays;
    image d_rgb;
    gaussians d_gaussians;
    float reach;
    int repeats;
} passes;

static gbt_status build(passes *p, bench_way *w, gbt_error *err)
{
    memset(&w->figures.counters, 0, sizeof w->figures.counters);
    return w->splat != NULL ? GBT_OK : trace_build(&w->traced, p->g, &w->settings, p->reach, err);
}

static gbt_status forward(passes *p, bench_way *w, gbt_error *err)
{
    if (w->splat == NULL)
        return trace_forward(&w->traced, p->rays, true, &(trace_outputs){.rgb = &w->rgb},
                             &w->figures.counters, err);
    const raster_settings s = frame_splat_settings(&w->settings, w->splat->form);
    raster_counters counted = {0};
    GBT_TRY(
        raster_forward(&w->splatted, w->splat->g, w->splat->camera, &s, true, &w->rgb, NULL, &counted, err));
    w->figures.counters.rays = counted.pixels;
    w->figures.counters.blended = counted.blended;
    return GBT_OK;
}

static gbt_status backward(passes *p, bench_way *w, gbt_error *err)
{
    return w->splat != NULL ? raster_backward(&w->splatted, &p->d_rgb, &p->d_gaussians, NULL, err)
                            : trace_backward(&w->traced, p->rays, &p->d_rgb, &p->d_gaussians, NULL, err);
}

/* Time one pass: build, forward, adjoint. `sample` counts from 0; -1 is the warm-up, whose times are dropped.
 */
static gbt_status pass(passes *p, bench_way *w, int sample, gbt_error *err)
{
    cpu_limit_isa(w->isa);
    const size_t embree_bytes = bvh_memory_bytes();
    const double t0 = clock_wall(), c0 = clock_process();
    GBT_TRY(build(p, w, err));
    const double t1 = clock_wall(), c1 = clock_process();
    GBT_TRY(forward(p, w, err));
    const double t2 = clock_wall(), c2 = clock_process();
    GBT_TRY(backward(p, w, err));
    const double t3 = clock_wall(), c3 = clock_process();
    if (sample < 0) { /* the first build: all memory that Embree has allocated since then is for this tree */
        w->figures.tree_bytes =
            w->kernel == TRACE_EMBREE ? bvh_memory_bytes() - embree_bytes : w->traced.tree.bytes;
        w->figures.list_bytes = w->traced.listed ? list_builder_bytes(&w->traced.lists) : 0;
        w->figures.record_bytes = p->g->count * RECORD_FLOATS * sizeof(float);
        return GBT_OK;
    }
    const double taken[SAMPLE_COUNT] = {t1 - t0, t2 - t1, t3 - t2, c2 - c1, c3 - c2, c1 - c0};
    for (int i = 0; i < SAMPLE_COUNT; i++)
        w->samples[i * p->repeats + sample] = taken[i];
    return GBT_OK;
}

static gbt_status prepare(passes *p, bench_way *ways, size_t count, gbt_error *err)
{
    const size_t values = 3 * ray_image_count(p->rays);
    GBT_TRY(image_alloc(&p->d_rgb, p->rays->width, p->rays->height, 3, err));
    for (size_t i = 0; i < values; i++)
        p->d_rgb.pixels[i] = 3 / (float)values;
    for (size_t i = 0; i < count; i++) {
        bench_way *w = &ways[i];
        w->traced.kernel = w->kernel;
        GBT_TRY(image_alloc(&w->rgb, p->rays->width, p->rays->height, 3, err));
        w->samples = mem_alloc((size_t)p->repeats, SAMPLE_COUNT * sizeof *w->samples, "timings", err);
        if (w->samples == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    return GBT_OK;
}

static void find_medians(const passes *p, bench_way *w)
{
    double at[SAMPLE_COUNT];
    for (int i = 0; i < SAMPLE_COUNT; i++)
        at[i] = median(w->samples + i * p->repeats, p->repeats);
    const double rays = (double)ray_image_count(p->rays);
    w->figures.build_ms = 1000 * at[SAMPLE_BUILD];
    w->figures.forward_seconds = at[SAMPLE_FORWARD];
    w->figures.adjoint_seconds = at[SAMPLE_ADJOINT];
    w->figures.forward_us = 1e6 * at[SAMPLE_FORWARD_CPU] / rays;
    w->figures.adjoint_us = 1e6 * at[SAMPLE_ADJOINT_CPU] / rays;
    w->figures.build_us = 1e6 * at[SAMPLE_BUILD_CPU] / rays;
}

gbt_status bench_measure(bench_way *ways, size_t count, const gaussians *g, const ray_image *rays,
                         int repeats, gbt_error *err)
{
    passes p = {.g = g, .rays = rays, .reach = ray_image_reach(rays), .repeats = repeats};
    const cpu_isa best = cpu_best_isa();
    gbt_status status = prepare(&p, ways, count, err);
    for (int sample = -1; sample < repeats; sample++)
        for (size_t i = 0; i < count && status == GBT_OK; i++)
            status = pass(&p, &ways[i], sample, err);
    cpu_limit_isa(best);
    for (size_t i = 0; i < count && status == GBT_OK; i++)
        find_medians(&p, &ways[i]);
    gaussians_free(&p.d_gaussians);
    image_free(&p.d_rgb);
    return status;
}

void bench_way_free(bench_way *way)
{
    trace_scene_free(&way->traced);
    raster_scene_free(&way->splatted);
    image_free(&way->rgb);
    mem_free(way->samples);
    way->samples = NULL;
}
