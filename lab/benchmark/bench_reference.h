/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_reference.h -- some pixels of a picture in double, and how far another picture is from
   them. */
#ifndef LAB_BENCHMARK_BENCH_REFERENCE_H
#define LAB_BENCHMARK_BENCH_REFERENCE_H

#include "base/gaussians.h"
#include "base/image.h"
#include "trace/rays.h"
#include "trace/settings.h"

/** Every 8th pixel in both directions of a picture, in double. Start from {0}. */
typedef struct bench_reference {
    ray_image rays; /* of those pixels */
    double *rgb;    /* [rays][3] */
    bool *left_out; /* optional (NULL), [rays]: what does not count in bench_reference_compare() */
} bench_reference;

/** The same without cut-offs but that of alpha_max, which is the model's: every Gaussian counts on every ray.
 */
trace_settings bench_settings_without_cuts(const trace_settings *settings);

gbt_status bench_reference_make(const gaussians *g, const trace_settings *settings, const ray_image *rays,
                                bench_reference *out, gbt_error *err);

/** Leave out the rays of the rounding band (trace/rounding_band.h), on which a picture in float32 may be
    right in another way. */
gbt_status bench_reference_leave_band(const gaussians *g, const trace_settings *settings,
                                      bench_reference *reference, gbt_error *err);

void bench_reference_free(bench_reference *reference);

typedef struct bench_error {
    double psnr, max; /* psnr: of values in [0, 1], at most 200 dB */
} bench_error;

/** From the sum of the squared errors of `values` values, and the largest of them. */
bench_error bench_error_of(double square_sum, double max, size_t values);

/** Error of a picture of all rays; only the pixels of the reference count. */
bench_error bench_reference_compare(const bench_reference *reference, const image *rgb);

#endif
