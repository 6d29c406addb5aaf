/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_passes.h -- time several ways to render the same Gaussians and rays, traced or splatted,
   taking turns. */
#ifndef GBT_BENCHMARK_BENCH_PASSES_H
#define GBT_BENCHMARK_BENCH_PASSES_H

#include "base/cpu.h"
#include "raster/raster.h"
#include "trace/trace.h"

typedef struct bench_figures {
    double build_ms, forward_seconds, adjoint_seconds; /* wall time, medians */
    double build_us, forward_us,
        adjoint_us; /* core-microseconds per ray: CPU time of all threads / number of rays, medians */
    kernel_counters counters; /* of one forward pass */
    size_t tree_bytes, record_bytes;
    size_t list_bytes; /* list_builder_bytes() */
} bench_figures;

/** How to splat, for a way that does not trace. */
typedef struct bench_splat {
    const gbt_camera *camera; /* pinhole with the same rays as the other ways */
    const gaussians *g; /* the Gaussians without a footprint, which the dilation of splatting replaces */
    raster_form form;
} bench_splat;

/** One way to render the picture. Start from the fields of the first line, the rest 0; free with
    bench_way_free(). */
typedef struct bench_way {
    trace_kernel kernel;
    cpu_isa isa;
    trace_settings settings;
    const bench_splat *splat; /* NULL: traced */
    bench_figures figures;
    image rgb;          /* of the last pass */
    trace_scene traced; /* built for this way */
    raster_scene splatted;
    double *samples; /* internal */
} bench_way;

/**
 * Time build, forward and adjoint of every way. In each of `repeats` rounds every way gets one pass, so that
 * slow changes of the machine's speed affect all alike. A first round, which warms up caches and memory, is
 * not counted.
 *
 * @param g, rays [in] borrowed until bench_way_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 * Only one call at a time per process: it sets the instruction set of the whole process for each way, and
 * resets it at the end.
 */
gbt_status bench_measure(bench_way *ways, size_t count, const gaussians *g, const ray_image *rays,
                         int repeats, gbt_error *err);

void bench_way_free(bench_way *way);

/** What can be timed: a trace_kernel; splats; the kernel "list" with trace_settings.packet_order. */
enum { BENCH_SPLATS = TRACE_EMBREE + 1, BENCH_PACKET_ORDER, BENCH_KERNELS };

/** "list", "tree", "single", "embree", "splats" or "packet". */
const char *bench_kernel_name(int kernel);

/** Parse a comma-separated list of at most `capacity` kernels, "tree,embree". Returns how many; 0 if one is
    unknown or given twice. */
size_t bench_kernels_parse(const char *list, int *out, size_t capacity);

#endif
