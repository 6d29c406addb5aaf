/* SPDX-License-Identifier: Apache-2.0 */
/* image/window.c -- the inner loops of SSIM and of its adjoint.

   The bodies are plain loops that GCC turns into vectors of whatever width the calling function is compiled
   for. `ivdep` says what the interface says, that outputs are apart from inputs: GCC gives up on run-time
   checks between this many arrays. */
#include "image/window.h"

#include <math.h>
#include <stdbool.h>

#include "base/cpu.h"

#define BODY static inline __attribute__((always_inline))

/* exp(-k^2 / (2 1.5^2)) / sum; the sum of all eleven is 1 to the last bit but one. */
#define TAP0 0.2660117248617943
#define TAP1 0.21300553771125366
#define TAP2 0.1093606895097
#define TAP3 0.03600077212843082
#define TAP4 0.007598758135239184
#define TAP5 0.0010283800844791099

static const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;

BODY void moments_body(const float *const x[WINDOW_TAPS], const float *const y[WINDOW_TAPS], size_t count,
                       double *const out[WINDOW_MOMENTS])
{
    static const double taps[WINDOW_TAPS] = {TAP5, TAP4, TAP3, TAP2, TAP1, TAP0,
                                             TAP1, TAP2, TAP3, TAP4, TAP5};
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
    return TAP0 * p[0] + TAP1 * (p[-step] + p[step]) + TAP2 * (p[-2 * step] + p[2 * step]) +
           TAP3 * (p[-3 * step] + p[3 * step]) + TAP4 * (p[-4 * step] + p[4 * step]) +
           TAP5 * (p[-5 * step] + p[5 * step]);
}

BODY double down(const double *const rows[WINDOW_TAPS], size_t i)
{
    return TAP0 * rows[5][i] + TAP1 * (rows[4][i] + rows[6][i]) + TAP2 * (rows[3][i] + rows[7][i]) +
           TAP3 * (rows[2][i] + rows[8][i]) + TAP4 * (rows[1][i] + rows[9][i]) +
           TAP5 * (rows[0][i] + rows[10][i]);
}

typedef struct map_point {
    double similarity, by_mean, by_variance, by_covariance;
} map_point;

BODY map_point map_at(const double *const in[WINDOW_MOMENTS], size_t i, ptrdiff_t step)
{
    const double a = across(in[0] + i, step), b = across(in[1] + i, step);
    const double variance_x = across(in[2] + i, step) - a * a, variance_y = across(in[3] + i, step) - b * b;
    const double covariance = across(in[4] + i, step) - a * b;
    const double n1 = 2 * (a * b) + c1, n2 = 2 * covariance + c2;
    const double d1 = a * a + b * b + c1, d2 = variance_x + variance_y + c2;
    const double similarity =
        (n1 * n2) / (d1 * d2); /* x = y makes both products the same number, so this is exactly 1 */
    const double inverse = 1 / (d1 * d2), inverse_d1 = d2 * inverse, inverse_d2 = d1 * inverse;
    const double by_variance = -similarity * inverse_d2, by_covariance = 2 * n1 * inverse;
    const double by_mean =
        2 * (b * n2 * inverse - a * similarity * inverse_d1); /* at fixed variance and covariance */
    return (map_point){similarity, by_mean - 2 * a * by_variance - b * by_covariance, by_variance,
                       by_covariance};
}

BODY void map_body(const double *const in[WINDOW_MOMENTS], size_t count, size_t step, double *restrict map)
{
    const double *const rows[WINDOW_MOMENTS] = {in[0], in[1], in[2], in[3], in[4]};
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++)
        map[i] = map_at(rows, i, (ptrdiff_t)step).similarity;
}

BODY void map_partials_body(const double *const in[WINDOW_MOMENTS], size_t count, size_t step,
                            double *restrict map, double *const partials[WINDOW_PARTIALS])
{
    const double *const rows[WINDOW_MOMENTS] = {in[0], in[1], in[2], in[3], in[4]};
    double *restrict by_mean = partials[0], *restrict by_variance = partials[1],
                     *restrict by_covariance = partials[2];
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++) {
        const map_point p = map_at(rows, i, (ptrdiff_t)step);
        map[i] = p.similarity;
        by_mean[i] = p.by_mean;
        by_variance[i] = p.by_variance;
        by_covariance[i] = p.by_covariance;
    }
}

BODY void filter_body(const double *const in[WINDOW_PARTIALS], size_t count, size_t step,
                      double *const out[WINDOW_PARTIALS])
{
    const double *in0 = in[0], *in1 = in[1], *in2 = in[2];
    double *restrict out0 = out[0], *restrict out1 = out[1], *restrict out2 = out[2];
    const ptrdiff_t s = (ptrdiff_t)step;
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++) {
        out0[i] = across(in0 + i, s);
        out1[i] = across(in1 + i, s);
        out2[i] = across(in2 + i, s);
    }
}

BODY void gradient_body(const double *const partials[WINDOW_PARTIALS][WINDOW_TAPS], const float *restrict x,
                        const float *restrict y, size_t count, double l1, double ssim, float *restrict d_x,
                        double *restrict absolute, double *restrict square)
{
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++) {
        const double a = (double)x[i], b = (double)y[i], difference = a - b;
        const double sum = down(partials[0], i) + 2 * a * down(partials[1], i) + b * down(partials[2], i);
        d_x[i] = (float)((difference != 0 ? copysign(l1, difference) : 0) + ssim * sum);
        absolute[i] = fabs(difference);
        square[i] = difference * difference;
    }
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
    attribute static void map_partials_##isa(const double *const in[WINDOW_MOMENTS], size_t count,           \
                                             size_t step, double *map,                                       \
                                             double *const partials[WINDOW_PARTIALS])                        \
    {                                                                                                        \
        map_partials_body(in, count, step, map, partials);                                                   \
    }                                                                                                        \
    attribute static void filter_##isa(const double *const in[WINDOW_PARTIALS], size_t count, size_t step,   \
                                       double *const out[WINDOW_PARTIALS])                                   \
    {                                                                                                        \
        filter_body(in, count, step, out);                                                                   \
    }                                                                                                        \
    attribute static void gradient_##isa(const double *const partials[WINDOW_PARTIALS][WINDOW_TAPS],         \
                                         const float *x, const float *y, size_t count, double l1,            \
                                         double ssim, float *d_x, double *absolute, double *square)          \
    {                                                                                                        \
        gradient_body(partials, x, y, count, l1, ssim, d_x, absolute, square);                               \
    }                                                                                                        \
    static const window_kernels kernels_##isa = {moments_##isa, map_##isa, map_partials_##isa, filter_##isa, \
                                                 gradient_##isa};

WINDOW_VARIANT(plain, )
WINDOW_VARIANT(avx2, __attribute__((target("avx2"))))
WINDOW_VARIANT(avx512, __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512"))))

const window_kernels *window_kernels_best(void)
{
    switch (cpu_best_isa()) {
    case CPU_AVX512:
        return &kernels_avx512;
    case CPU_AVX2:
        return &kernels_avx2;
    default:
        return &kernels_plain;
    }
}

void window_rows(const float *pixels, size_t count, size_t height, size_t row, const float *zeros,
                 const float *rows[WINDOW_TAPS])
{
    for (size_t k = 0; k < WINDOW_TAPS; k++) {
        const size_t shifted = row + k; /* by WINDOW_RADIUS, so that it cannot be negative */
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
