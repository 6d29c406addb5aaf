/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_passes.h -- time passes over the same Gaussians and rays, traced or splatted in several
   ways in turn. */
#ifndef LAB_BENCHMARK_BENCH_PASSES_H
#define LAB_BENCHMARK_BENCH_PASSES_H

#include "base/cpu.h"
#include "raster/raster.h"
#include "trace/trace.h"

typedef struct bench_figures {
    double build_ms, forward_seconds, adjoint_seconds; /* wall time, medians */
    double build_us, forward_us, adjoint_us; /* core-microseconds per ray: processor time of all threads /
                                                rays, medians */
    kernel_counters counters;                /* of one forward pass */
    size_t tree_bytes, record_bytes;
    size_t list_bytes; /* list_builder_bytes() */
} bench_figures;

/** Splats in place of rays. */
typedef struct bench_splat {
    const gbt_camera *camera; /* pinhole, whose rays are those of the other ways */
    const gaussians *g;       /* what is splatted: without the footprint that its dilation stands for */
    raster_form form;
} bench_splat;

/** One way of making the picture. Start from the fields of the first line, the rest 0; free with
    bench_way_free(). */
typedef struct bench_way {
    trace_kernel kernel;
    cpu_isa isa;
    trace_settings settings;
    const bench_splat *splat; /* NULL: traced */
    bench_figures figures;
    image rgb;          /* of the last pass */
    trace_scene traced; /* as built for it */
    raster_scene splatted;
    double *samples; /* internal */
} bench_way;

/**
 * Time every way: build, forward, adjoint; one pass of each after the other, `repeats` times over, so that
 * all of them see the machine in the same state. A first round is not counted: it warms caches and memory up.
 *
 * @param g, rays [in] borrowed until bench_way_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL One at a time per process: the instruction set is set
 *         for all of it while a way is timed, and set back at the end.
 */
gbt_status bench_measure(bench_way *ways, size_t count, const gaussians *g, const ray_image *rays,
                         int repeats, gbt_error *err);

void bench_way_free(bench_way *way);

/** What is measured: a trace_kernel; splats in their place; lists with trace_settings.packet_order. */
enum { BENCH_SPLATS = TRACE_EMBREE + 1, BENCH_PACKET_ORDER, BENCH_KERNELS };

/** "list", "tree", "single", "embree", "splats" or "packet". */
const char *bench_kernel_name(int kernel);

/** A list of kernels, "tree,embree", of at most `capacity`; 0 when there is another word in it, or one
    twice. */
size_t bench_kernels_parse(const char *list, int *out, size_t capacity);

#endif
