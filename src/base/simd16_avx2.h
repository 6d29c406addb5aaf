/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16_avx2.h -- simd16.h for AVX2 with FMA: two registers. */
#ifndef GBT_BASE_SIMD16_AVX2_H
#define GBT_BASE_SIMD16_AVX2_H

#include "base/simd8_sum.h"

typedef struct vfloat16 {
    __m256 a, b;
} vfloat16;
typedef struct vmask16 {
    __m256 a, b;
} vmask16;

#define VFLOAT16_BOTH(f, x, y) ((vfloat16){f((x).a, (y).a), f((x).b, (y).b)})
static inline vfloat16 vfloat16_load(const float *p)
{
    return (vfloat16){_mm256_load_ps(p), _mm256_load_ps(p + 8)};
}
static inline void vfloat16_store(float *p, vfloat16 x)
{
    _mm256_store_ps(p, x.a);
    _mm256_store_ps(p + 8, x.b);
}
static inline vfloat16 vfloat16_set1(float x) { return (vfloat16){_mm256_set1_ps(x), _mm256_set1_ps(x)}; }
static inline vfloat16 vfloat16_add(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_add_ps, x, y); }
static inline vfloat16 vfloat16_sub(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_sub_ps, x, y); }
static inline vfloat16 vfloat16_mul(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_mul_ps, x, y); }
static inline vfloat16 vfloat16_div(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_div_ps, x, y); }
static inline vfloat16 vfloat16_sqrt(vfloat16 x)
{
    return (vfloat16){_mm256_sqrt_ps(x.a), _mm256_sqrt_ps(x.b)};
}
static inline vfloat16 vfloat16_fma(vfloat16 x, vfloat16 y, vfloat16 z)
{
    return (vfloat16){_mm256_fmadd_ps(x.a, y.a, z.a), _mm256_fmadd_ps(x.b, y.b, z.b)};
}
static inline vfloat16 vfloat16_fnma(vfloat16 x, vfloat16 y, vfloat16 z)
{
    return (vfloat16){_mm256_fnmadd_ps(x.a, y.a, z.a), _mm256_fnmadd_ps(x.b, y.b, z.b)};
}
static inline vfloat16 vfloat16_min(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_min_ps, x, y); }
static inline vfloat16 vfloat16_max(vfloat16 x, vfloat16 y) { return VFLOAT16_BOTH(_mm256_max_ps, x, y); }
static inline vmask16 vfloat16_le(vfloat16 x, vfloat16 y)
{
    return (vmask16){_mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ)};
}
static inline vmask16 vfloat16_lt(vfloat16 x, vfloat16 y)
{
    return (vmask16){_mm256_cmp_ps(x.a, y.a, _CMP_LT_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LT_OQ)};
}
static inline vfloat16 vfloat16_select(vmask16 m, vfloat16 yes, vfloat16 no)
{
    return (vfloat16){_mm256_blendv_ps(no.a, yes.a, m.a), _mm256_blendv_ps(no.b, yes.b, m.b)};
}
#define VFLOAT16_WHERE
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_mul(x, y), x);
}
/* In this version -0 becomes 0 where nothing is added; that is harmless, because sums that start at 0 are
   never -0. */
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_add(x, VFLOAT16_BOTH(_mm256_and_ps, m, y));
}
static inline vfloat16 vfloat16_add_unless(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_add(x, VFLOAT16_BOTH(_mm256_andnot_ps, m, y));
}
static inline vfloat16 vfloat16_less_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_fnma(x, VFLOAT16_BOTH(_mm256_and_ps, m, y), x);
}
static inline vfloat16 vfloat16_less_unless(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_fnma(x, VFLOAT16_BOTH(_mm256_andnot_ps, m, y), x);
}
static inline vfloat16 vfloat16_round(vfloat16 x)
{
    return (vfloat16){_mm256_round_ps(x.a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC),
                      _mm256_round_ps(x.b, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)};
}
static inline vfloat16 vfloat16_scale_pow2(vfloat16 x, vfloat16 n)
{
    const __m256i na = _mm256_slli_epi32(_mm256_cvtps_epi32(n.a), 23),
                  nb = _mm256_slli_epi32(_mm256_cvtps_epi32(n.b), 23);
    return (vfloat16){_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(x.a), na)),
                      _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(x.b), nb))};
}
#define VFLOAT16_REDUCE(name, op8, op4)                                                                      \
    static inline float name(vfloat16 x)                                                                     \
    {                                                                                                        \
        const __m256 y = op8(x.a, x.b);                                                                      \
        __m128 z = op4(_mm256_castps256_ps128(y), _mm256_extractf128_ps(y, 1));                              \
        z = op4(z, _mm_movehl_ps(z, z));                                                                     \
        return _mm_cvtss_f32(op4(z, _mm_shuffle_ps(z, z, 1)));                                               \
    }
VFLOAT16_REDUCE(vfloat16_lowest, _mm256_min_ps, _mm_min_ps)
VFLOAT16_REDUCE(vfloat16_highest, _mm256_max_ps, _mm_max_ps)
#undef VFLOAT16_REDUCE

static inline vmask16 vmask16_and(vmask16 x, vmask16 y)
{
    return (vmask16){_mm256_and_ps(x.a, y.a), _mm256_and_ps(x.b, y.b)};
}
static inline vmask16 vmask16_or(vmask16 x, vmask16 y)
{
    return (vmask16){_mm256_or_ps(x.a, y.a), _mm256_or_ps(x.b, y.b)};
}
static inline vmask16 vmask16_andnot(vmask16 x, vmask16 y)
{
    return (vmask16){_mm256_andnot_ps(x.a, y.a), _mm256_andnot_ps(x.b, y.b)};
}
static inline unsigned vmask16_bits(vmask16 m)
{
    return (unsigned)_mm256_movemask_ps(m.a) | (unsigned)_mm256_movemask_ps(m.b) << 8;
}
static inline vmask16 vmask16_from_bits(unsigned bits)
{
    const __m256i pick = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i low = _mm256_and_si256(_mm256_set1_epi32((int)(bits & 0xFF)), pick);
    const __m256i high = _mm256_and_si256(_mm256_set1_epi32((int)(bits >> 8)), pick);
    return (vmask16){_mm256_castsi256_ps(_mm256_cmpeq_epi32(low, pick)),
                     _mm256_castsi256_ps(_mm256_cmpeq_epi32(high, pick))};
}

/* Entirely in registers: storing four lanes at a time and loading eight would stall on store forwarding. */
#define VFLOAT16_REDUCE_ROWS(name, op)                                                                       \
    static inline __m256 name##_eight(const vfloat16 in[8])                                                  \
    {                                                                                                        \
        __m256 y[4], z[2];                                                                                   \
        for (int j = 0; j < 4; j++) { /* rows j and j + 4, of four lanes */                                  \
            const __m256 first = op(in[j].a, in[j].b), second = op(in[j + 4].a, in[j + 4].b);                \
            y[j] = op(_mm256_permute2f128_ps(first, second, 0x20),                                           \
                      _mm256_permute2f128_ps(first, second, 0x31));                                          \
        }                                                                                                    \
        for (int j = 0; j < 2; j++)                                                                          \
            z[j] =                                                                                           \
                op(_mm256_unpacklo_ps(y[2 * j], y[2 * j + 1]), _mm256_unpackhi_ps(y[2 * j], y[2 * j + 1]));  \
        const __m256d a = _mm256_castps_pd(z[0]), b = _mm256_castps_pd(z[1]);                                \
        return op(_mm256_castpd_ps(_mm256_unpacklo_pd(a, b)), _mm256_castpd_ps(_mm256_unpackhi_pd(a, b)));   \
    }                                                                                                        \
    static inline vfloat16 name(const vfloat16 in[16])                                                       \
    {                                                                                                        \
        return (vfloat16){name##_eight(in), name##_eight(in + 8)};                                           \
    }
VFLOAT16_REDUCE_ROWS(vfloat16_min_rows, _mm256_min_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_max_rows, _mm256_max_ps)
#undef VFLOAT16_REDUCE_ROWS

typedef __m256 vfloat8;
static inline vfloat8 vfloat16_fold(vfloat16 x) { return _mm256_add_ps(x.a, x.b); }
static inline vfloat8 vfloat16_fold_product(vfloat16 x, vfloat16 y)
{
    return _mm256_fmadd_ps(x.b, y.b, _mm256_mul_ps(x.a, y.a));
}
static inline vfloat16 vfloat8_sum_rows(const vfloat8 in[16])
{
    return (vfloat16){sum8_rows(in), sum8_rows(in + 8)};
}

/* Transpose 8 x 8 floats. */
static inline void transpose8(const float *const rows[8], __m256 out[8])
{
    __m256 x[8], y[8];
    for (int i = 0; i < 8; i++)
        x[i] = _mm256_loadu_ps(rows[i]);
    for (int i = 0; i < 4; i++) {
        y[2 * i] = _mm256_unpacklo_ps(x[2 * i], x[2 * i + 1]);
        y[2 * i + 1] = _mm256_unpackhi_ps(x[2 * i], x[2 * i + 1]);
    }
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            x[4 * i + 2 * k] = _mm256_shuffle_ps(y[4 * i + k], y[4 * i + 2 + k], 0x44);
            x[4 * i + 2 * k + 1] = _mm256_shuffle_ps(y[4 * i + k], y[4 * i + 2 + k], 0xEE);
        }
    for (int i = 0; i < 4; i++) {
        out[i] = _mm256_permute2f128_ps(x[i], x[4 + i], 0x20);
        out[4 + i] = _mm256_permute2f128_ps(x[i], x[4 + i], 0x31);
    }
}

static inline void vfloat16_load_transposed(const float *const rows[16], vfloat16 out[16])
{
    for (int half = 0; half < 2; half++) {
        __m256 low[8], high[8];
        const float *right[16];
        for (int i = 0; i < 16; i++)
            right[i] = rows[i] + 8 * half;
        transpose8(right, low);
        transpose8(right + 8, high);
        for (int j = 0; j < 8; j++)
            out[8 * half + j] = (vfloat16){low[j], high[j]};
    }
}

#endif
