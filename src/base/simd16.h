/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16.h -- sixteen floats at a time: one name per operation, three instruction sets.

   A kernel includes this file and is compiled once per instruction set (see CMakeLists.txt of trace and
   raster). Every operation gives the same bits in all three, because fused multiply-adds are named and sums
   have a fixed order; so a kernel's result does not depend on the machine. The plain form is the definition.

   vfloat16: 16 floats; vmask16: 16 truth values. */
#ifndef GBT_BASE_SIMD16_H
#define GBT_BASE_SIMD16_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)

#include <immintrin.h>

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
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return _mm512_mask_mul_ps(a, m, a, b);
} /* m ? a b : a */
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return _mm512_mask_add_ps(a, m, a, b);
} /* m ? a + b : a */
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

/* first + number of every lane that is true, in order; sixteen places of `out` are written. Returned: how
   many are true. */
#define VMASK16_NUMBERS
static inline unsigned vmask16_numbers(vmask16 m, uint32_t first, uint32_t *out)
{
    const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    _mm512_storeu_si512(
        out, _mm512_maskz_compress_epi32(m, _mm512_add_epi32(lane, _mm512_set1_epi32((int)first))));
    return (unsigned)__builtin_popcount(m);
}

/* out[j] = all lanes of in[j] combined, j = 0..15, in the fixed order ((e0+e2)+(e1+e3)) per group of 4 lanes,
   then (g0+g1)+(g2+g3). */
#define VFLOAT16_REDUCE_ROWS(name, op)                                                                       \
    static inline vfloat16 name(const vfloat16 in[16])                                                       \
    {                                                                                                        \
        vfloat16 x[8], y[4], z[2];                                                                           \
        for (int j = 0; j < 8; j++)                                                                          \
            x[j] = op(_mm512_unpacklo_ps(in[2 * j], in[2 * j + 1]),                                          \
                      _mm512_unpackhi_ps(in[2 * j], in[2 * j + 1]));                                         \
        for (int j = 0; j < 4; j++) {                                                                        \
            const __m512d a = _mm512_castps_pd(x[2 * j]), b = _mm512_castps_pd(x[2 * j + 1]);                \
            y[j] =                                                                                           \
                op(_mm512_castpd_ps(_mm512_unpacklo_pd(a, b)), _mm512_castpd_ps(_mm512_unpackhi_pd(a, b)));  \
        }                                                                                                    \
        for (int j = 0; j < 2; j++)                                                                          \
            z[j] = op(_mm512_shuffle_f32x4(y[2 * j], y[2 * j + 1], 0x88),                                    \
                      _mm512_shuffle_f32x4(y[2 * j], y[2 * j + 1], 0xDD));                                   \
        return op(_mm512_shuffle_f32x4(z[0], z[1], 0x88), _mm512_shuffle_f32x4(z[0], z[1], 0xDD));           \
    }
VFLOAT16_REDUCE_ROWS(vfloat16_sum_rows, _mm512_add_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_min_rows, _mm512_min_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_max_rows, _mm512_max_ps)
#undef VFLOAT16_REDUCE_ROWS

/* out[j] lane i = rows[i][j]: sixteen rows of sixteen floats, turned. */
static inline void vfloat16_load_turned(const float *const rows[16], vfloat16 out[16])
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

#elif defined(__AVX2__) && defined(__FMA__)

#include <immintrin.h>

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
    _mm256_store_ps(p, x.a), _mm256_store_ps(p + 8, x.b);
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
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_mul(x, y), x);
}
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_add(x, y), x);
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

#define VFLOAT16_REDUCE_ROWS(name, op8, op4)                                                                 \
    static inline vfloat16 name(const vfloat16 in[16])                                                       \
    {                                                                                                        \
        _Alignas(64) float out[16];                                                                          \
        for (int group = 0; group < 4; group++) {                                                            \
            __m256 half[2];                                                                                  \
            for (int h = 0; h < 2; h++) {                                                                    \
                const __m256 *p = (const __m256 *)&in[4 * group] + h; /* vfloat16 is two __m256: stride 2 */ \
                const __m256 x0 = op8(_mm256_unpacklo_ps(p[0], p[2]), _mm256_unpackhi_ps(p[0], p[2]));       \
                const __m256 x1 = op8(_mm256_unpacklo_ps(p[4], p[6]), _mm256_unpackhi_ps(p[4], p[6]));       \
                const __m256d d0 = _mm256_castps_pd(x0), d1 = _mm256_castps_pd(x1);                          \
                half[h] = op8(_mm256_castpd_ps(_mm256_unpacklo_pd(d0, d1)),                                  \
                              _mm256_castpd_ps(_mm256_unpackhi_pd(d0, d1)));                                 \
            }                                                                                                \
            const __m128 low = op4(_mm256_castps256_ps128(half[0]), _mm256_extractf128_ps(half[0], 1));      \
            const __m128 high = op4(_mm256_castps256_ps128(half[1]), _mm256_extractf128_ps(half[1], 1));     \
            _mm_store_ps(out + 4 * group, op4(low, high));                                                   \
        }                                                                                                    \
        return vfloat16_load(out);                                                                           \
    }
VFLOAT16_REDUCE_ROWS(vfloat16_sum_rows, _mm256_add_ps, _mm_add_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_min_rows, _mm256_min_ps, _mm_min_ps)
VFLOAT16_REDUCE_ROWS(vfloat16_max_rows, _mm256_max_ps, _mm_max_ps)
#undef VFLOAT16_REDUCE_ROWS

/* Eight rows of eight, turned. */
static inline void turn8(const float *const rows[8], __m256 out[8])
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

static inline void vfloat16_load_turned(const float *const rows[16], vfloat16 out[16])
{
    for (int half = 0; half < 2; half++) {
        __m256 low[8], high[8];
        const float *right[16];
        for (int i = 0; i < 16; i++)
            right[i] = rows[i] + 8 * half;
        turn8(right, low);
        turn8(right + 8, high);
        for (int j = 0; j < 8; j++)
            out[8 * half + j] = (vfloat16){low[j], high[j]};
    }
}

#else

typedef struct vfloat16 {
    float v[16];
} vfloat16;
typedef struct vmask16 {
    unsigned bits;
} vmask16;

#define EACH for (int i = 0; i < 16; i++)
static inline vfloat16 vfloat16_load(const float *p)
{
    vfloat16 r;
    memcpy(&r, p, sizeof r);
    return r;
}
static inline void vfloat16_store(float *p, vfloat16 a) { memcpy(p, &a, sizeof a); }
static inline vfloat16 vfloat16_set1(float a)
{
    vfloat16 r;
    EACH r.v[i] = a;
    return r;
}
static inline vfloat16 vfloat16_add(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] += b.v[i];
    return a;
}
static inline vfloat16 vfloat16_sub(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] -= b.v[i];
    return a;
}
static inline vfloat16 vfloat16_mul(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] *= b.v[i];
    return a;
}
static inline vfloat16 vfloat16_div(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] /= b.v[i];
    return a;
}
static inline vfloat16 vfloat16_sqrt(vfloat16 a)
{
    EACH a.v[i] = sqrtf(a.v[i]);
    return a;
}
static inline vfloat16 vfloat16_fma(vfloat16 a, vfloat16 b, vfloat16 c)
{
    EACH a.v[i] = fmaf(a.v[i], b.v[i], c.v[i]);
    return a;
}
static inline vfloat16 vfloat16_fnma(vfloat16 a, vfloat16 b, vfloat16 c)
{
    EACH a.v[i] = fmaf(-a.v[i], b.v[i], c.v[i]);
    return a;
}
static inline vfloat16 vfloat16_min(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] = a.v[i] < b.v[i] ? a.v[i] : b.v[i];
    return a;
}
static inline vfloat16 vfloat16_max(vfloat16 a, vfloat16 b)
{
    EACH a.v[i] = a.v[i] > b.v[i] ? a.v[i] : b.v[i];
    return a;
}
static inline vmask16 vfloat16_le(vfloat16 a, vfloat16 b)
{
    vmask16 m = {0};
    EACH m.bits |= (unsigned)(a.v[i] <= b.v[i]) << i;
    return m;
}
static inline vmask16 vfloat16_lt(vfloat16 a, vfloat16 b)
{
    vmask16 m = {0};
    EACH m.bits |= (unsigned)(a.v[i] < b.v[i]) << i;
    return m;
}
static inline vfloat16 vfloat16_select(vmask16 m, vfloat16 yes, vfloat16 no)
{
    EACH no.v[i] = m.bits >> i & 1 ? yes.v[i] : no.v[i];
    return no;
}
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return vfloat16_select(m, vfloat16_mul(a, b), a);
}
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 a, vfloat16 b)
{
    return vfloat16_select(m, vfloat16_add(a, b), a);
}
static inline vfloat16 vfloat16_round(vfloat16 a)
{
    EACH a.v[i] = rintf(a.v[i]);
    return a;
}
static inline vfloat16 vfloat16_scale_pow2(vfloat16 a, vfloat16 n)
{
    EACH
    {
        uint32_t bits;
        memcpy(&bits, &a.v[i], 4);
        bits += (uint32_t)(int32_t)n.v[i] << 23;
        memcpy(&a.v[i], &bits, 4);
    }
    return a;
}
static inline float vfloat16_lowest(vfloat16 a)
{
    float r = a.v[0];
    EACH r = a.v[i] < r ? a.v[i] : r;
    return r;
}
static inline float vfloat16_highest(vfloat16 a)
{
    float r = a.v[0];
    EACH r = a.v[i] > r ? a.v[i] : r;
    return r;
}
static inline vmask16 vmask16_and(vmask16 a, vmask16 b) { return (vmask16){a.bits & b.bits}; }
static inline vmask16 vmask16_or(vmask16 a, vmask16 b) { return (vmask16){a.bits | b.bits}; }
static inline vmask16 vmask16_andnot(vmask16 a, vmask16 b) { return (vmask16){b.bits & ~a.bits}; }
static inline unsigned vmask16_bits(vmask16 m) { return m.bits; }
static inline vmask16 vmask16_from_bits(unsigned bits) { return (vmask16){bits & 0xFFFF}; }
static inline vfloat16 vfloat16_sum_rows(const vfloat16 in[16])
{
    vfloat16 out;
    EACH
    {
        float g[4];
        for (int k = 0; k < 4; k++) {
            const float *e = in[i].v + 4 * k;
            g[k] = (e[0] + e[2]) + (e[1] + e[3]);
        }
        out.v[i] = (g[0] + g[1]) + (g[2] + g[3]);
    }
    return out;
}
static inline vfloat16 vfloat16_min_rows(const vfloat16 in[16])
{
    vfloat16 out;
    EACH out.v[i] = vfloat16_lowest(in[i]);
    return out;
}
static inline vfloat16 vfloat16_max_rows(const vfloat16 in[16])
{
    vfloat16 out;
    EACH out.v[i] = vfloat16_highest(in[i]);
    return out;
}
static inline void vfloat16_load_turned(const float *const rows[16], vfloat16 out[16])
{
    EACH for (int j = 0; j < 16; j++) out[j].v[i] = rows[i][j];
}
#undef EACH
#endif

#ifndef VMASK16_NUMBERS
static inline unsigned vmask16_numbers(vmask16 m, uint32_t first, uint32_t *out)
{
    const unsigned bits = vmask16_bits(m);
    unsigned count = 0;
    for (unsigned i = 0; i < 16; i++) {
        out[count] = first + i;
        count += bits >> i & 1;
    }
    return count;
}
#endif

/* As fmaxf() and fminf() of numbers, but not calls. */
static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

static inline int vmask16_any(vmask16 m) { return vmask16_bits(m) != 0; }

/** 2^x for x in [-120, 0]; largest error about 1 ulp. Taylor of 2^r to r^6 on [-1/2, 1/2], in pairs, for the
    sake of latency. */
static inline vfloat16 vfloat16_exp2(vfloat16 x)
{
    const vfloat16 n = vfloat16_round(x), r = vfloat16_sub(x, n), rr = vfloat16_mul(r, r);
    const vfloat16 low = vfloat16_fma(vfloat16_set1(0.693147181f), r, vfloat16_set1(1.0f));
    const vfloat16 middle = vfloat16_fma(vfloat16_set1(0.0555041087f), r, vfloat16_set1(0.240226507f));
    const vfloat16 high =
        vfloat16_fma(vfloat16_set1(1.54035304e-4f), rr,
                     vfloat16_fma(vfloat16_set1(1.33335581e-3f), r, vfloat16_set1(9.61812911e-3f)));
    return vfloat16_scale_pow2(vfloat16_fma(vfloat16_fma(high, rr, middle), rr, low), n);
}

#endif
