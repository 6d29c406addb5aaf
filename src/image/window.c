/* SPDX-License-Identifier: Apache-2.0 */
/* image/window.c -- the inner loops of SSIM.

   The bodies are plain loops, which GCC vectorises with the width of the function they are inlined into.
   `ivdep` states what the interface requires, that outputs do not overlap inputs: GCC gives up on run-time
   checks between this many arrays. */
#include "image/window.h"

#include <stdbool.h>

#include "base/cpu.h"

#define BODY static inline __attribute__((always_inline))

static const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;

BODY void moments_body(const float *const x[WINDOW_TAPS], const float *const y[WINDOW_TAPS], size_t count,
                       double *const out[WINDOW_MOMENTS])
{
    static const double taps[WINDOW_TAPS] = {WINDOW_TAP5, WINDOW_TAP4, WINDOW_TAP3, WINDOW_TAP2,
                                             WINDOW_TAP1, WINDOW_TAP0, WINDOW_TAP1, WINDOW_TAP2,
                                             WINDOW_TAP3, WINDOW_TAP4, WINDOW_TAP5};
    double *restrict out_x = out[0], *restrict out_y = out[1];
    double *restrict out_xx = out[2], *restrict out_yy = out[3], *restrict out_xy = out[4];
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++) {
        double sum_x = 0, sum_y = 0, sum_xx = 0, sum_yy = 0, sum_xy = 0;
#pragma GCC unroll 11
        for (int k = 0; k < WINDOW_TAPS; k++) {
            const double a = (double)x[k][i], b = (double)y[k][i], wa = taps[k] * a, wb = taps[k] * b;
            sum_x += wa;
            sum_y += wb;
            sum_xx += wa * a;
            sum_yy += wb * b;
            sum_xy += wa * b;
        }
        out_x[i] = sum_x;
        out_y[i] = sum_y;
        out_xx[i] = sum_xx;
        out_yy[i] = sum_yy;
        out_xy[i] = sum_xy;
    }
}

/* Row pass at p, for samples `step` apart. */
BODY double across(const double *p, ptrdiff_t step)
{
    return WINDOW_TAP0 * p[0] + WINDOW_TAP1 * (p[-step] + p[step]) +
           WINDOW_TAP2 * (p[-2 * step] + p[2 * step]) + WINDOW_TAP3 * (p[-3 * step] + p[3 * step]) +
           WINDOW_TAP4 * (p[-4 * step] + p[4 * step]) + WINDOW_TAP5 * (p[-5 * step] + p[5 * step]);
}

BODY double similarity_at(const double *const in[WINDOW_MOMENTS], size_t i, ptrdiff_t step)
{
    const double a = across(in[0] + i, step), b = across(in[1] + i, step);
    const double variance_x = across(in[2] + i, step) - a * a, variance_y = across(in[3] + i, step) - b * b;
    const double covariance = across(in[4] + i, step) - a * b;
    const double n1 = 2 * (a * b) + c1, n2 = 2 * covariance + c2;
    const double d1 = a * a + b * b + c1, d2 = variance_x + variance_y + c2;
    return (n1 * n2) / (d1 * d2); /* for x = y both products are the same number, so this is exactly 1 */
}

BODY void map_body(const double *const in[WINDOW_MOMENTS], size_t count, size_t step, double *restrict map)
{
    const double *const rows[WINDOW_MOMENTS] = {in[0], in[1], in[2], in[3], in[4]};
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++)
        map[i] = similarity_at(rows, i, (ptrdiff_t)step);
}

#define WINDOW_VARIANT(isa, attribute)                                                                       \
    attribute static void moments_##isa(const float *const x[WINDOW_TAPS],                                   \
                                        const float *const y[WINDOW_TAPS], size_t count,                     \
                                        double *const out[WINDOW_MOMENTS])                                   \
    {                                                                                                        \
        moments_body(x, y, count, out);                                                                      \
    }                                                                                                        \
    attribute static void map_##isa(const double *const in[WINDOW_MOMENTS], size_t count, size_t step,       \
                                    double *map)                                                             \
    {                                                                                                        \
        map_body(in, count, step, map);                                                                      \
    }                                                                                                        \
    static const window_kernels kernels_##isa = {moments_##isa, map_##isa};

WINDOW_VARIANT(plain, )
#if defined(__x86_64__)
WINDOW_VARIANT(avx2, __attribute__((target("avx2"))))
WINDOW_VARIANT(avx512, __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512"))))
#endif

const window_kernels *window_kernels_best(void) { return CPU_CLONE(kernels, cpu_best_isa()); }

void window_rows(const float *pixels, size_t count, size_t height, size_t row, const float *zeros,
                 const float *rows[WINDOW_TAPS])
{
    for (size_t k = 0; k < WINDOW_TAPS; k++) {
        const size_t shifted = row + k; /* shifted by WINDOW_RADIUS, so that it cannot be negative */
        const bool is_inside = shifted >= WINDOW_RADIUS && shifted - WINDOW_RADIUS < height;
        rows[k] = is_inside ? pixels + (shifted - WINDOW_RADIUS) * count : zeros;
    }
}

double window_sum(const double *values, size_t count)
{
    double parts[8] = {0};
    size_t i = 0;
    for (; i + 8 <= count; i += 8)
        for (int j = 0; j < 8; j++)
            parts[j] += values[i + (size_t)j];
    for (int j = 0; i < count; i++, j++)
        parts[j] += values[i];
    return ((parts[0] + parts[4]) + (parts[2] + parts[6])) + ((parts[1] + parts[5]) + (parts[3] + parts[7]));
}
