/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_reference.h -- render some pixels in double precision, and measure the error of other
   pictures against them. */
#ifndef GBT_BENCHMARK_BENCH_REFERENCE_H
#define GBT_BENCHMARK_BENCH_REFERENCE_H

#include "base/gaussians.h"
#include "base/image.h"
#include "trace/rays.h"
#include "trace/settings.h"

/** Every 8th pixel of a picture in both directions, in double precision. Start from {0}. */
typedef struct bench_reference {
    ray_image rays; /* of those pixels */
    double *rgb;    /* [rays][3] */
    bool *left_out; /* optional (NULL), [rays]: rays that bench_reference_compare() ignores */
} bench_reference;

/** The same settings without cut-offs, so that every Gaussian counts on every ray. alpha_max stays: it is
    part of the model. */
trace_settings bench_settings_without_cuts(const trace_settings *settings);

gbt_status bench_reference_make(const gaussians *g, const trace_settings *settings, const ray_image *rays,
                                bench_reference *out, gbt_error *err);

/** Exclude the rays of the rounding band (trace/rounding_band.h), where rounding in float32 may legitimately
    change which Gaussians are blended. */
gbt_status bench_reference_leave_band(const gaussians *g, const trace_settings *settings,
                                      bench_reference *reference, gbt_error *err);

void bench_reference_free(bench_reference *reference);

typedef struct bench_error {
    double psnr, max; /* psnr: for values in [0, 1], at most 200 dB */
} bench_error;

/** From the sum of squared errors over `values` values, and the largest absolute error. */
bench_error bench_error_of(double square_sum, double max, size_t values);

/** Error of a picture of all rays, measured at the pixels of the reference. */
bench_error bench_reference_compare(const bench_reference *reference, const image *rgb);

#endif
