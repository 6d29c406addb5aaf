/* SPDX-License-Identifier: Apache-2.0 */
/* image/loss_rows.c -- the inner loops of the training loss.

   The bodies are plain loops, which GCC vectorises with the width of the function they are inlined into.
   `ivdep` states what the interface requires, that outputs do not overlap inputs: GCC gives up on run-time
   checks between this many arrays. */
#include "image/loss_rows.h"

#include <math.h>
#include <string.h>

#include "base/cpu.h"

#define BODY static inline __attribute__((always_inline))

/* Number of values of a row processed at a time when arithmetic follows a column pass, so that they stay in
   the first-level cache. */
enum { PART = LOSS_GROUP * LOSS_STEP };

static const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;

/* The Gaussian window over eleven values, summed from the centre outwards. */
#define WINDOW(a, b, c, d, e, f, g, h, i, j, k)                                                              \
    __builtin_fma(WINDOW_TAP5, (a) + (k),                                                                    \
                  __builtin_fma(WINDOW_TAP4, (b) + (j),                                                      \
                                __builtin_fma(WINDOW_TAP3, (c) + (i),                                        \
                                              __builtin_fma(WINDOW_TAP2, (d) + (h),                          \
                                                            __builtin_fma(WINDOW_TAP1, (e) + (g),            \
                                                                          WINDOW_TAP0 * (f))))))

/* Window results at LOSS_GROUP neighbouring positions from LOSS_SPAN values. */
#define WINDOW_GROUP(v, out0, out1, out2, out3)                                                              \
    do {                                                                                                     \
        const double v0 = v(0), v1 = v(1), v2 = v(2), v3 = v(3), v4 = v(4), v5 = v(5), v6 = v(6);            \
        const double v7 = v(7), v8 = v(8), v9 = v(9), v10 = v(10), v11 = v(11), v12 = v(12), v13 = v(13);    \
        out0 = WINDOW(v0, v1, v2, v3, v4, v5, v6, v7, v8, v9, v10);                                          \
        out1 = WINDOW(v1, v2, v3, v4, v5, v6, v7, v8, v9, v10, v11);                                         \
        out2 = WINDOW(v2, v3, v4, v5, v6, v7, v8, v9, v10, v11, v12);                                        \
        out3 = WINDOW(v3, v4, v5, v6, v7, v8, v9, v10, v11, v12, v13);                                       \
    } while (0)

BODY void row_pass_body(const double *restrict in, size_t count, double *restrict out)
{
    for (size_t begin = 0; begin < count; begin += PART) {
        const double *p = in + begin - LOSS_MARGIN;
        double *q = out + begin;
#define AT(k) p[i + (k)*LOSS_STEP]
#pragma GCC ivdep
        for (size_t i = 0; i < LOSS_STEP; i++)
            WINDOW_GROUP(AT, q[i], q[i + LOSS_STEP], q[i + 2 * LOSS_STEP], q[i + 3 * LOSS_STEP]);
#undef AT
    }
}

/* Column pass for PART values of LOSS_GROUP rows from `begin` on. */
BODY void column_pass(const double *const rows[LOSS_SPAN], size_t begin, double out[LOSS_GROUP][PART])
{
    const double *r[LOSS_SPAN];
    for (int k = 0; k < LOSS_SPAN; k++)
        r[k] = rows[k] + begin;
    double *restrict a = out[0], *restrict b = out[1], *restrict c = out[2], *restrict d = out[3];
#define AT(k) r[k][i]
#pragma GCC ivdep
    for (size_t i = 0; i < PART; i++)
        WINDOW_GROUP(AT, a[i], b[i], c[i], d[i]);
#undef AT
}

BODY void products_body(const float *restrict x, const float *restrict y, size_t count,
                        double *const out[LOSS_MOMENTS])
{
    double *restrict out_x = out[0], *restrict out_y = out[1], *restrict squares = out[2],
                     *restrict product = out[3];
#pragma GCC ivdep
    for (size_t i = 0; i < count; i++) {
        const double a = (double)x[i], b = (double)y[i];
        out_x[i] = a;
        out_y[i] = b;
        squares[i] = a * a + b * b;
        product[i] = a * b;
    }
}

/* For x = y the sum of squares is exactly twice the product, so numerator and denominator are the same
   number, and the correction step of the quotient makes the similarity exactly 1. */
BODY void map_body(const double *const moments[LOSS_MOMENTS][LOSS_SPAN],
                   const double *const counts[LOSS_GROUP], const double weight[LOSS_GROUP], size_t count,
                   double *const partials[LOSS_GROUP][LOSS_PARTIALS], double *restrict sum)
{
    _Alignas(64) double filtered[LOSS_MOMENTS][LOSS_GROUP][PART];
    for (size_t begin = 0; begin < count; begin += PART) {
        for (int m = 0; m < LOSS_MOMENTS; m++)
            column_pass(moments[m], begin, filtered[m]);
        double *restrict total = sum + begin;
        for (int row = 0; row < LOSS_GROUP; row++) {
            const double *restrict mean_x = filtered[0][row], *restrict mean_y = filtered[1][row];
            const double *restrict squares = filtered[2][row], *restrict product = filtered[3][row];
            const double *restrict counted = counts[row] + begin, row_weight = weight[row];
            double *restrict by_mean = partials[row][0] + begin,
                             *restrict by_variance = partials[row][1] + begin,
                             *restrict by_covariance = partials[row][2] + begin;
#pragma GCC ivdep
            for (size_t i = 0; i < PART; i++) {
                const double a = mean_x[i], b = mean_y[i], w = counted[i];
                const double ab = a * b, square = a * a + b * b;
                const double n1 = 2 * ab + c1, n2 = 2 * (product[i] - ab) + c2;
                const double d1 = square + c1, d2 = (squares[i] - square) + c2;
                const double above = n1 * n2, below = d1 * d2, inverse = 1 / below,
                             quotient = above * inverse;
                const double similarity =
                    __builtin_fma(__builtin_fma(-quotient, below, above), inverse, quotient);
                const double over_d1 = similarity * (d2 * inverse), over_d2 = similarity * (d1 * inverse);
                const double covariance = 2 * (n1 * inverse);
                const double mean_part = __builtin_fma(2 * inverse, n2, -covariance);
                total[i] += row_weight * (w * similarity);
                by_mean[i] = w * __builtin_fma(b, mean_part, 2 * a * (over_d2 - over_d1));
                by_variance[i] = w * -over_d2;
                by_covariance[i] = w * covariance;
            }
        }
    }
}

BODY void gradient_body(const double *const partials[LOSS_PARTIALS][LOSS_SPAN],
                        const float *const x[LOSS_GROUP], const float *const y[LOSS_GROUP],
                        const double weight[LOSS_GROUP], size_t count, double l1, double ssim,
                        float *const d_x[LOSS_GROUP], double *restrict absolute, double *restrict square)
{
    _Alignas(64) double filtered[LOSS_PARTIALS][LOSS_GROUP][PART];
    for (size_t begin = 0; begin < count; begin += PART) {
        for (int m = 0; m < LOSS_PARTIALS; m++)
            column_pass(partials[m], begin, filtered[m]);
        double *restrict total_absolute = absolute + begin, *restrict total_square = square + begin;
        for (int row = 0; row < LOSS_GROUP; row++) {
            const double *restrict by_mean = filtered[0][row], *restrict by_variance = filtered[1][row],
                                   *restrict by_covariance = filtered[2][row], row_weight = weight[row];
            const float *restrict row_x = x[row] + begin, *restrict row_y = y[row] + begin;
            float *restrict out = d_x[row] + begin;
#pragma GCC ivdep
            for (size_t i = 0; i < PART; i++) {
                const double a = (double)row_x[i], b = (double)row_y[i], difference = a - b;
                const double sum =
                    __builtin_fma(b, by_covariance[i], __builtin_fma(2 * a, by_variance[i], by_mean[i]));
                const double sign = difference != 0 ? copysign(l1, difference) : 0;
                out[i] = (float)__builtin_fma(ssim, sum, sign);
                total_absolute[i] += row_weight * fabs(difference);
                total_square[i] += row_weight * (difference * difference);
            }
        }
    }
}

typedef double place8 __attribute__((vector_size(64)));

/* Fill one margin from the neighbouring lane; the outermost lane, `edge`, gets the given values. */
BODY void margin(const double *from, int edge, const double *values, double *restrict out)
{
    for (int i = 0; i < LOSS_MARGIN / LOSS_LANES; i++) {
        place8 place;
        memcpy(&place, from + i * LOSS_LANES, sizeof place);
        memcpy(out + i * LOSS_LANES, &place, sizeof place);
        out[i * LOSS_LANES + edge] = values[i];
    }
}

BODY void margins_body(double *row, size_t count, const double *left, const double *right)
{
    margin(row + count - LOSS_MARGIN - 1, 0, left, row - LOSS_MARGIN);
    margin(row + 1, LOSS_LANES - 1, right, row + count);
}

typedef float vec8 __attribute__((vector_size(32)));

#define LOW1(a, b) __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define HIGH1(a, b) __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define LOW2(a, b) __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define HIGH2(a, b) __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#define LOW4(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11)
#define HIGH4(a, b) __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15)

/* Transpose 8 x 8 values by exchanging blocks of 1, 2 and 4 values; only the last step crosses 128-bit
   halves, which is expensive. */
BODY void transpose8(const float *in, size_t in_row, float *out, size_t out_row)
{
    vec8 x[8], y[8];
#pragma GCC unroll 8
    for (int i = 0; i < 8; i++)
        memcpy(&x[i], in + (size_t)i * in_row, sizeof x[i]);
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        y[2 * i] = LOW1(x[2 * i], x[2 * i + 1]);
        y[2 * i + 1] = HIGH1(x[2 * i], x[2 * i + 1]);
    }
#pragma GCC unroll 2
    for (int i = 0; i < 8; i += 4)
#pragma GCC unroll 2
        for (int k = 0; k < 2; k++) {
            x[i + 2 * k] = LOW2(y[i + k], y[i + 2 + k]);
            x[i + 2 * k + 1] = HIGH2(y[i + k], y[i + 2 + k]);
        }
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        y[i] = LOW4(x[i], x[4 + i]);
        y[4 + i] = HIGH4(x[i], x[4 + i]);
    }
#pragma GCC unroll 8
    for (int i = 0; i < 8; i++)
        memcpy(out + (size_t)i * out_row, &y[i], sizeof y[i]);
}

/* The last group of eight of a segment may overlap the previous one. */
BODY void to_lanes_body(const float *pixels, size_t count, float *lanes)
{
    const size_t segment = count / LOSS_LANES;
    for (size_t k = 0; k < segment; k += 8) {
        const size_t at = k + 8 <= segment ? k : segment - 8;
        transpose8(pixels + at, segment, lanes + at * LOSS_LANES, LOSS_LANES);
    }
}

BODY void from_lanes_body(const float *lanes, size_t count, float *pixels)
{
    const size_t segment = count / LOSS_LANES;
    for (size_t k = 0; k < segment; k += 8) {
        const size_t at = k + 8 <= segment ? k : segment - 8;
        transpose8(lanes + at * LOSS_LANES, LOSS_LANES, pixels + at, segment);
    }
}

#define LOSS_VARIANT(isa, attribute)                                                                         \
    attribute static void to_lanes_##isa(const float *pixels, size_t count, float *lanes)                    \
    {                                                                                                        \
        to_lanes_body(pixels, count, lanes);                                                                 \
    }                                                                                                        \
    attribute static void from_lanes_##isa(const float *lanes, size_t count, float *pixels)                  \
    {                                                                                                        \
        from_lanes_body(lanes, count, pixels);                                                               \
    }                                                                                                        \
    attribute static void products_##isa(const float *x, const float *y, size_t count,                       \
                                         double *const out[LOSS_MOMENTS])                                    \
    {                                                                                                        \
        products_body(x, y, count, out);                                                                     \
    }                                                                                                        \
    attribute static void row_pass_##isa(const double *in, size_t count, double *out)                        \
    {                                                                                                        \
        row_pass_body(in, count, out);                                                                       \
    }                                                                                                        \
    attribute static void margins_##isa(double *row, size_t count, const double *left, const double *right)  \
    {                                                                                                        \
        margins_body(row, count, left, right);                                                               \
    }                                                                                                        \
    attribute static void map_##isa(const double *const moments[LOSS_MOMENTS][LOSS_SPAN],                    \
                                    const double *const counts[LOSS_GROUP], const double weight[LOSS_GROUP], \
                                    size_t count, double *const partials[LOSS_GROUP][LOSS_PARTIALS],         \
                                    double *sum)                                                             \
    {                                                                                                        \
        map_body(moments, counts, weight, count, partials, sum);                                             \
    }                                                                                                        \
    attribute static void gradient_##isa(                                                                    \
        const double *const partials[LOSS_PARTIALS][LOSS_SPAN], const float *const x[LOSS_GROUP],            \
        const float *const y[LOSS_GROUP], const double weight[LOSS_GROUP], size_t count, double l1,          \
        double ssim, float *const d_x[LOSS_GROUP], double *absolute, double *square)                         \
    {                                                                                                        \
        gradient_body(partials, x, y, weight, count, l1, ssim, d_x, absolute, square);                       \
    }                                                                                                        \
    static const loss_kernels kernels_##isa = {to_lanes_##isa, from_lanes_##isa, products_##isa,             \
                                               row_pass_##isa, margins_##isa,    map_##isa,                  \
                                               gradient_##isa};

LOSS_VARIANT(plain, )
#if defined(__x86_64__)
LOSS_VARIANT(avx2, __attribute__((target("avx2,fma"))))
LOSS_VARIANT(avx512, __attribute__((target("fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"))))
#endif

const loss_kernels *loss_kernels_best(void) { return CPU_CLONE(kernels, cpu_best_isa()); }
