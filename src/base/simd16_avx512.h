/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16_avx512.h -- simd16.h for AVX-512: one register. */
#ifndef GBT_BASE_SIMD16_AVX512_H
#define GBT_BASE_SIMD16_AVX512_H

#include "base/simd8_sum.h"

typedef __m512 vfloat16;
typedef __mmask16 vmask16;

static inline vfloat16 vfloat16_load(const float *p) { return _mm512_load_ps(p); }
static inline void vfloat16_store(float *p, vfloat16 a) { _mm512_store_ps(p, a); }
static inline vfloat16 vfloat16_set1(float a) { return _mm512_set1_ps(a); }
static inline vfloat16 vfloat16_add(vfloat16 a, vfloat16 b) { return _mm512_add_ps(a, b); }
static inline vfloat16 vfloat16_sub(vfloat16 a, vfloat16 b) { return _mm512_sub_ps(a, b); }
static inline vfloat16 vfloat16_mul(vfloat16 a, vfloat16 b) { return _mm512_mul_ps(a, b); }
static inline vfloat16 vfloat16_div(vfloat16 a, vfloat16 b) { return _mm512_div_ps(a, b); }
static inline vfloat16 vfloat16_sqrt(vfloat16 a) { return _mm512_sqrt_ps(a); }
static inline vfloat16 vfloat16_fma(vfloat16 a, vfloat16 b, vfloat16 c)
{
    return _mm512_fmadd_ps(a, b, c);
} /* a b + c */
static inline vfloat16 vfloat16_fnma(vfloat16 a, vfloat16 b, vfloat16 c)
{
    return _mm512_fnmadd_ps(a, b, c);
} /* c - a b */
static inline vfloat16 vfloat16_min(vfloat16 a, vfloat16 b) { return _mm512_min_ps(a, b); }
static inline vfloat16 vfloat16_max(vfloat16 a, vfloat16 b) { return _mm512_max_ps(a, b); }
static inline vmask16 vfloat16_le(vfloat16 a, vfloat16 b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
static inline vmask16 vfloat16_lt(vfloat16 a, vfloat16 b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
static inline vfloat16 vfloat16_select(vmask16 m, vfloat16 yes, vfloat16 no)
{
    return _mm512_mask_blend_ps(m, no, yes);
}
#define VFLOAT16_WHERE
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return _mm512_mask_mul_ps(a, m, a, b);
} /* m ? a b : a */
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return _mm512_mask_add_ps(a, m, a, b);
} /* m ? a + b : a */
static inline vfloat16 vfloat16_add_unless(vmask16 m, vfloat16 a, vfloat16 b)
{
    return vfloat16_add_where((vmask16)~m, a, b);
}
static inline vfloat16 vfloat16_less_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return _mm512_mask_fnmadd_ps(a, m, b, a);
} /* m ? a - a b : a, rounded once */
static inline vfloat16 vfloat16_less_unless(vmask16 m, vfloat16 a, vfloat16 b)
{
    return vfloat16_less_where((vmask16)~m, a, b);
}
static inline vfloat16 vfloat16_round(vfloat16 a)
{
    return _mm512_roundscale_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
static inline vfloat16 vfloat16_scale_pow2(vfloat16 a, vfloat16 n) /* a * 2^n for integer n with a normal
                                                                      result */
{
    return _mm512_castsi512_ps(
        _mm512_add_epi32(_mm512_castps_si512(a), _mm512_slli_epi32(_mm512_cvtps_epi32(n), 23)));
}
static inline float vfloat16_lowest(vfloat16 a) { return _mm512_reduce_min_ps(a); }
static inline float vfloat16_highest(vfloat16 a) { return _mm512_reduce_max_ps(a); }

static inline vmask16 vmask16_and(vmask16 a, vmask16 b) { return a & b; }
static inline vmask16 vmask16_or(vmask16 a, vmask16 b) { return a | b; }
static inline vmask16 vmask16_andnot(vmask16 a, vmask16 b) { return (vmask16)(b & ~a); } /* b and not a */
static inline unsigned vmask16_bits(vmask16 m) { return m; }
static inline vmask16 vmask16_from_bits(unsigned bits) { return (vmask16)bits; }

/* Write first + lane number for every true lane, in order; all sixteen elements of `out` are overwritten.
   Returns the number of true lanes. */
#define VMASK16_NUMBERS
static inline unsigned vmask16_numbers(vmask16 m, uint32_t first, uint32_t *out)
{
    const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    _mm512_storeu_si512(
        out, _mm512_maskz_compress_epi32(m, _mm512_add_epi32(lane, _mm512_set1_epi32((int)first))));
    return (unsigned)__builtin_popcount(m);
}

/* Write the values of every true lane, in order; up to sixteen elements of `out` are overwritten. Returns the
   number of true lanes. */
#define VMASK16_PACK
static inline unsigned vmask16_pack(vmask16 m, const uint32_t *from, uint32_t *out)
{
    _mm512_storeu_si512(out, _mm512_maskz_compress_epi32(m, _mm512_loadu_si512(from)));
    return (unsigned)__builtin_popcount(m);
}

/* Rows k, k + 4, k + 8, k + 12 of each of four vectors, so that the last step leaves them in order. */
#define VFLOAT16_REDUCE_ROWS(name, op)                                                                       \
    static inline vfloat16 name(const vfloat16 in[16])                                                       \
    {                                                                                                        \
        vfloat16 x[8], y[4], z[2];                                                                           \
        for (int j = 0; j < 8; j++) { /* two rows of eight lanes */                                          \
            const vfloat16 first = in[j / 2 + 8 * (j % 2)], second = in[j / 2 + 8 * (j % 2) + 4];            \
            x[j] = op(_mm512_shuffle_f32x4(first, second, 0x44), _mm512_shuffle_f32x4(first, second, 0xEE)); \
        }                                                                                                    \
        for (int j = 0; j < 4; j++) /* four rows of four */                                                  \
            y[j] = op(_mm512_shuffle_f32x4(x[2 * j], x[2 * j + 1], 0x88),                                    \
                      _mm512_shuffle_f32x4(x[2 * j], x[2 * j + 1], 0xDD));                                   \
        for (int j = 0; j < 2; j++)                                                                          \
            z[j] =                                                                                           \
                op(_mm512_unpacklo_ps(y[2 * j], y[2 * j + 1]), _mm512_unpackhi_ps(y[2 * j], y[2 * j + 1]));  \
        const __m512d a = _mm512_castps_pd(z[0]), b = _mm512_castps_pd(z[1]);                                \
        return op(_mm512_castpd_ps(_mm512_unpacklo_pd(a, b)), _mm512_castpd_ps(_mm512_unpackhi_pd(a, b)));   \
    }
VFLOAT16_REDUCE_ROWS(vfloat16_min_rows, _mm512_min_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_max_rows, _mm512_max_ps)
#undef VFLOAT16_REDUCE_ROWS

typedef __m256 vfloat8;
static inline vfloat8 vfloat16_fold(vfloat16 x)
{
    return _mm256_add_ps(_mm512_castps512_ps256(x), _mm512_extractf32x8_ps(x, 1));
}
static inline vfloat8 vfloat16_fold_product(vfloat16 x, vfloat16 y)
{
    return _mm256_fmadd_ps(_mm512_extractf32x8_ps(x, 1), _mm512_extractf32x8_ps(y, 1),
                           _mm256_mul_ps(_mm512_castps512_ps256(x), _mm512_castps512_ps256(y)));
}
static inline vfloat16 vfloat8_sum_rows(const vfloat8 in[16])
{
    return _mm512_insertf32x8(_mm512_castps256_ps512(sum8_rows(in)), sum8_rows(in + 8), 1);
}

/* Transpose 16 x 16 floats: lane i of out[j] = rows[i][j]. */
static inline void vfloat16_load_transposed(const float *const rows[16], vfloat16 out[16])
{
    vfloat16 x[16], y[16];
    for (int i = 0; i < 16; i++)
        x[i] = _mm512_loadu_ps(rows[i]);
    for (int i = 0; i < 8; i++) {
        y[2 * i] = _mm512_unpacklo_ps(x[2 * i], x[2 * i + 1]);
        y[2 * i + 1] = _mm512_unpackhi_ps(x[2 * i], x[2 * i + 1]);
    }
    for (int i = 0; i < 4; i++) {
        const __m512d a = _mm512_castps_pd(y[4 * i]), b = _mm512_castps_pd(y[4 * i + 1]);
        const __m512d c = _mm512_castps_pd(y[4 * i + 2]), d = _mm512_castps_pd(y[4 * i + 3]);
        x[4 * i] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, c));
        x[4 * i + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, c));
        x[4 * i + 2] = _mm512_castpd_ps(_mm512_unpacklo_pd(b, d));
        x[4 * i + 3] = _mm512_castpd_ps(_mm512_unpackhi_pd(b, d));
    }
    for (int i = 0; i < 4; i++) {
        y[i] = _mm512_shuffle_f32x4(x[i], x[4 + i], 0x88);
        y[4 + i] = _mm512_shuffle_f32x4(x[i], x[4 + i], 0xDD);
        y[8 + i] = _mm512_shuffle_f32x4(x[8 + i], x[12 + i], 0x88);
        y[12 + i] = _mm512_shuffle_f32x4(x[8 + i], x[12 + i], 0xDD);
    }
    for (int i = 0; i < 4; i++) {
        out[i] = _mm512_shuffle_f32x4(y[i], y[8 + i], 0x88);
        out[8 + i] = _mm512_shuffle_f32x4(y[i], y[8 + i], 0xDD);
        out[4 + i] = _mm512_shuffle_f32x4(y[4 + i], y[12 + i], 0x88);
        out[12 + i] = _mm512_shuffle_f32x4(y[4 + i], y[12 + i], 0xDD);
    }
}

#endif
