/* trace/simd16.h -- sixteen floats at a time: one name per operation, three instruction sets.

   A kernel includes this file and is compiled once per instruction set (see CMakeLists.txt of this folder). Every operation gives the
   same bits in all three, because fused multiply-adds are named and sums have a fixed order; so a kernel's result does not depend on
   the machine. The plain form is the definition.

   f16: 16 floats; u16: 16 uint32; m16: 16 truth values. */
#ifndef GBT_TRACE_SIMD16_H
#define GBT_TRACE_SIMD16_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)

#include <immintrin.h>

typedef __m512 f16;
typedef __m512i u16;
typedef __mmask16 m16;

static inline f16 f16_load(const float *p) { return _mm512_load_ps(p); }
static inline void f16_store(float *p, f16 a) { _mm512_store_ps(p, a); }
static inline f16 f16_set1(float a) { return _mm512_set1_ps(a); }
static inline f16 f16_add(f16 a, f16 b) { return _mm512_add_ps(a, b); }
static inline f16 f16_sub(f16 a, f16 b) { return _mm512_sub_ps(a, b); }
static inline f16 f16_mul(f16 a, f16 b) { return _mm512_mul_ps(a, b); }
static inline f16 f16_div(f16 a, f16 b) { return _mm512_div_ps(a, b); }
static inline f16 f16_fma(f16 a, f16 b, f16 c) { return _mm512_fmadd_ps(a, b, c); }   /* a b + c */
static inline f16 f16_fnma(f16 a, f16 b, f16 c) { return _mm512_fnmadd_ps(a, b, c); } /* c - a b */
static inline f16 f16_min(f16 a, f16 b) { return _mm512_min_ps(a, b); }
static inline f16 f16_max(f16 a, f16 b) { return _mm512_max_ps(a, b); }
static inline m16 f16_le(f16 a, f16 b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
static inline m16 f16_lt(f16 a, f16 b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
static inline f16 f16_select(m16 m, f16 yes, f16 no) { return _mm512_mask_blend_ps(m, no, yes); }
static inline f16 f16_round(f16 a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
static inline f16 f16_scale_pow2(f16 a, f16 n) /* a * 2^n for integer n with a normal result */
{
    return _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(a), _mm512_slli_epi32(_mm512_cvtps_epi32(n), 23)));
}
static inline u16 f16_truncate(f16 a) { return _mm512_cvttps_epi32(a); } /* 0 <= a < 2^31 */
static inline f16 f16_gather(const float *p, u16 index) { return _mm512_i32gather_ps(index, p, 4); }
static inline void f16_scatter(float *p, m16 m, u16 index, f16 a) { _mm512_mask_i32scatter_ps(p, m, index, a, 4); }

static inline u16 u16_load(const uint32_t *p) { return _mm512_load_si512(p); }
static inline void u16_store(uint32_t *p, u16 a) { _mm512_store_si512(p, a); }
static inline u16 u16_set1(uint32_t a) { return _mm512_set1_epi32((int)a); }
static inline u16 u16_lanes(void) { return _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }
static inline u16 u16_add(u16 a, u16 b) { return _mm512_add_epi32(a, b); }
static inline u16 u16_and(u16 a, u16 b) { return _mm512_and_si512(a, b); }
static inline u16 u16_or(u16 a, u16 b) { return _mm512_or_si512(a, b); }
static inline u16 u16_xor(u16 a, u16 b) { return _mm512_xor_si512(a, b); }
#define u16_shl(a, n) _mm512_slli_epi32(a, n)
#define u16_shr(a, n) _mm512_srli_epi32(a, n)
static inline u16 u16_min(u16 a, u16 b) { return _mm512_min_epu32(a, b); }
static inline u16 u16_max(u16 a, u16 b) { return _mm512_max_epu32(a, b); }
static inline m16 u16_lt(u16 a, u16 b) { return _mm512_cmplt_epu32_mask(a, b); }
static inline m16 u16_eq(u16 a, u16 b) { return _mm512_cmpeq_epi32_mask(a, b); }
static inline u16 u16_select(m16 m, u16 yes, u16 no) { return _mm512_mask_blend_epi32(m, no, yes); }
static inline void u16_store_bytes(uint8_t *p, u16 a) { _mm_storeu_si128((__m128i *)p, _mm512_cvtepi32_epi8(a)); }
static inline u16 u16_load_bytes(const uint8_t *p) { return _mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)p)); }

static inline m16 m16_and(m16 a, m16 b) { return a & b; }
static inline m16 m16_or(m16 a, m16 b) { return a | b; }
static inline m16 m16_andnot(m16 a, m16 b) { return (m16)(b & ~a); } /* b and not a */
static inline unsigned m16_bits(m16 m) { return m; }
static inline m16 m16_from_bits(unsigned bits) { return (m16)bits; }

/** out[j] = sum over lanes of in[j], j = 0..15, in the fixed order ((e0+e2)+(e1+e3)) per group of 4 lanes, then (g0+g1)+(g2+g3). */
static inline f16 f16_sum_rows(const f16 in[16])
{
    f16 x[8], y[4], z[2];
    for (int j = 0; j < 8; j++)
        x[j] = _mm512_add_ps(_mm512_unpacklo_ps(in[2 * j], in[2 * j + 1]), _mm512_unpackhi_ps(in[2 * j], in[2 * j + 1]));
    for (int j = 0; j < 4; j++) {
        const __m512d a = _mm512_castps_pd(x[2 * j]), b = _mm512_castps_pd(x[2 * j + 1]);
        y[j] = _mm512_add_ps(_mm512_castpd_ps(_mm512_unpacklo_pd(a, b)), _mm512_castpd_ps(_mm512_unpackhi_pd(a, b)));
    }
    for (int j = 0; j < 2; j++)
        z[j] = _mm512_add_ps(_mm512_shuffle_f32x4(y[2 * j], y[2 * j + 1], 0x88), _mm512_shuffle_f32x4(y[2 * j], y[2 * j + 1], 0xDD));
    return _mm512_add_ps(_mm512_shuffle_f32x4(z[0], z[1], 0x88), _mm512_shuffle_f32x4(z[0], z[1], 0xDD));
}

#elif defined(__AVX2__) && defined(__FMA__)

#include <immintrin.h>

typedef struct f16 { __m256 a, b; } f16;
typedef struct u16 { __m256i a, b; } u16;
typedef struct m16 { __m256 a, b; } m16;

#define F16_BOTH(f, x, y) ((f16){f((x).a, (y).a), f((x).b, (y).b)})
#define U16_BOTH(f, x, y) ((u16){f((x).a, (y).a), f((x).b, (y).b)})
static inline f16 f16_load(const float *p) { return (f16){_mm256_load_ps(p), _mm256_load_ps(p + 8)}; }
static inline void f16_store(float *p, f16 x) { _mm256_store_ps(p, x.a), _mm256_store_ps(p + 8, x.b); }
static inline f16 f16_set1(float x) { return (f16){_mm256_set1_ps(x), _mm256_set1_ps(x)}; }
static inline f16 f16_add(f16 x, f16 y) { return F16_BOTH(_mm256_add_ps, x, y); }
static inline f16 f16_sub(f16 x, f16 y) { return F16_BOTH(_mm256_sub_ps, x, y); }
static inline f16 f16_mul(f16 x, f16 y) { return F16_BOTH(_mm256_mul_ps, x, y); }
static inline f16 f16_div(f16 x, f16 y) { return F16_BOTH(_mm256_div_ps, x, y); }
static inline f16 f16_fma(f16 x, f16 y, f16 z) { return (f16){_mm256_fmadd_ps(x.a, y.a, z.a), _mm256_fmadd_ps(x.b, y.b, z.b)}; }
static inline f16 f16_fnma(f16 x, f16 y, f16 z) { return (f16){_mm256_fnmadd_ps(x.a, y.a, z.a), _mm256_fnmadd_ps(x.b, y.b, z.b)}; }
static inline f16 f16_min(f16 x, f16 y) { return F16_BOTH(_mm256_min_ps, x, y); }
static inline f16 f16_max(f16 x, f16 y) { return F16_BOTH(_mm256_max_ps, x, y); }
static inline m16 f16_le(f16 x, f16 y) { return (m16){_mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ)}; }
static inline m16 f16_lt(f16 x, f16 y) { return (m16){_mm256_cmp_ps(x.a, y.a, _CMP_LT_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LT_OQ)}; }
static inline f16 f16_select(m16 m, f16 yes, f16 no) { return (f16){_mm256_blendv_ps(no.a, yes.a, m.a), _mm256_blendv_ps(no.b, yes.b, m.b)}; }
static inline f16 f16_round(f16 x)
{
    return (f16){_mm256_round_ps(x.a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC), _mm256_round_ps(x.b, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)};
}
static inline f16 f16_scale_pow2(f16 x, f16 n)
{
    const __m256i na = _mm256_slli_epi32(_mm256_cvtps_epi32(n.a), 23), nb = _mm256_slli_epi32(_mm256_cvtps_epi32(n.b), 23);
    return (f16){_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(x.a), na)), _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(x.b), nb))};
}
static inline u16 f16_truncate(f16 x) { return (u16){_mm256_cvttps_epi32(x.a), _mm256_cvttps_epi32(x.b)}; }
static inline f16 f16_gather(const float *p, u16 i) { return (f16){_mm256_i32gather_ps(p, i.a, 4), _mm256_i32gather_ps(p, i.b, 4)}; }
static inline unsigned m16_bits(m16 m) { return (unsigned)_mm256_movemask_ps(m.a) | (unsigned)_mm256_movemask_ps(m.b) << 8; }

static inline u16 u16_load(const uint32_t *p) { return (u16){_mm256_load_si256((const __m256i *)p), _mm256_load_si256((const __m256i *)(p + 8))}; }
static inline void u16_store(uint32_t *p, u16 x) { _mm256_store_si256((__m256i *)p, x.a), _mm256_store_si256((__m256i *)(p + 8), x.b); }
static inline void f16_scatter(float *p, m16 m, u16 index, f16 x)
{
    _Alignas(64) uint32_t i[16];
    _Alignas(64) float v[16];
    u16_store(i, index), f16_store(v, x);
    for (unsigned bits = m16_bits(m); bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        p[i[lane]] = v[lane];
    }
}
static inline u16 u16_set1(uint32_t x) { return (u16){_mm256_set1_epi32((int)x), _mm256_set1_epi32((int)x)}; }
static inline u16 u16_lanes(void) { return (u16){_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_setr_epi32(8, 9, 10, 11, 12, 13, 14, 15)}; }
static inline u16 u16_add(u16 x, u16 y) { return U16_BOTH(_mm256_add_epi32, x, y); }
static inline u16 u16_and(u16 x, u16 y) { return U16_BOTH(_mm256_and_si256, x, y); }
static inline u16 u16_or(u16 x, u16 y) { return U16_BOTH(_mm256_or_si256, x, y); }
static inline u16 u16_xor(u16 x, u16 y) { return U16_BOTH(_mm256_xor_si256, x, y); }
#define u16_shl(x, n) ((u16){_mm256_slli_epi32((x).a, n), _mm256_slli_epi32((x).b, n)})
#define u16_shr(x, n) ((u16){_mm256_srli_epi32((x).a, n), _mm256_srli_epi32((x).b, n)})
static inline u16 u16_min(u16 x, u16 y) { return U16_BOTH(_mm256_min_epu32, x, y); }
static inline u16 u16_max(u16 x, u16 y) { return U16_BOTH(_mm256_max_epu32, x, y); }
static inline m16 u16_eq(u16 x, u16 y) { return (m16){_mm256_castsi256_ps(_mm256_cmpeq_epi32(x.a, y.a)), _mm256_castsi256_ps(_mm256_cmpeq_epi32(x.b, y.b))}; }
static inline m16 m16_andnot(m16 x, m16 y) { return (m16){_mm256_andnot_ps(x.a, y.a), _mm256_andnot_ps(x.b, y.b)}; }
static inline m16 u16_lt(u16 x, u16 y) /* unsigned: x < y unless max(x, y) == x */
{
    const m16 ge = u16_eq(u16_max(x, y), x);
    const __m256 ones = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
    return m16_andnot(ge, (m16){ones, ones});
}
static inline u16 u16_select(m16 m, u16 yes, u16 no)
{
    return (u16){_mm256_blendv_epi8(no.a, yes.a, _mm256_castps_si256(m.a)), _mm256_blendv_epi8(no.b, yes.b, _mm256_castps_si256(m.b))};
}
static inline void u16_store_bytes(uint8_t *p, u16 x)
{
    _Alignas(64) uint32_t v[16];
    u16_store(v, x);
    for (int i = 0; i < 16; i++)
        p[i] = (uint8_t)v[i];
}
static inline u16 u16_load_bytes(const uint8_t *p)
{
    const __m128i bytes = _mm_loadu_si128((const __m128i *)p);
    return (u16){_mm256_cvtepu8_epi32(bytes), _mm256_cvtepu8_epi32(_mm_srli_si128(bytes, 8))};
}
static inline m16 m16_and(m16 x, m16 y) { return (m16){_mm256_and_ps(x.a, y.a), _mm256_and_ps(x.b, y.b)}; }
static inline m16 m16_or(m16 x, m16 y) { return (m16){_mm256_or_ps(x.a, y.a), _mm256_or_ps(x.b, y.b)}; }
static inline m16 m16_from_bits(unsigned bits)
{
    const __m256i pick = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i low = _mm256_and_si256(_mm256_set1_epi32((int)(bits & 0xFF)), pick);
    const __m256i high = _mm256_and_si256(_mm256_set1_epi32((int)(bits >> 8)), pick);
    return (m16){_mm256_castsi256_ps(_mm256_cmpeq_epi32(low, pick)), _mm256_castsi256_ps(_mm256_cmpeq_epi32(high, pick))};
}
static inline f16 f16_sum_rows(const f16 in[16])
{
    _Alignas(64) float out[16];
    for (int group = 0; group < 4; group++) {
        __m256 half[2];
        for (int h = 0; h < 2; h++) {
            const __m256 *p = (const __m256 *)&in[4 * group] + h; /* f16 is two __m256: stride 2 */
            const __m256 x0 = _mm256_add_ps(_mm256_unpacklo_ps(p[0], p[2]), _mm256_unpackhi_ps(p[0], p[2]));
            const __m256 x1 = _mm256_add_ps(_mm256_unpacklo_ps(p[4], p[6]), _mm256_unpackhi_ps(p[4], p[6]));
            const __m256d d0 = _mm256_castps_pd(x0), d1 = _mm256_castps_pd(x1);
            half[h] = _mm256_add_ps(_mm256_castpd_ps(_mm256_unpacklo_pd(d0, d1)), _mm256_castpd_ps(_mm256_unpackhi_pd(d0, d1)));
        }
        const __m128 low = _mm_add_ps(_mm256_castps256_ps128(half[0]), _mm256_extractf128_ps(half[0], 1));
        const __m128 high = _mm_add_ps(_mm256_castps256_ps128(half[1]), _mm256_extractf128_ps(half[1], 1));
        _mm_store_ps(out + 4 * group, _mm_add_ps(low, high));
    }
    return f16_load(out);
}

#else

typedef struct f16 { float v[16]; } f16;
typedef struct u16 { uint32_t v[16]; } u16;
typedef struct m16 { unsigned bits; } m16;

#define EACH for (int i = 0; i < 16; i++)
static inline f16 f16_load(const float *p) { f16 r; memcpy(&r, p, sizeof r); return r; }
static inline void f16_store(float *p, f16 a) { memcpy(p, &a, sizeof a); }
static inline f16 f16_set1(float a) { f16 r; EACH r.v[i] = a; return r; }
static inline f16 f16_add(f16 a, f16 b) { EACH a.v[i] += b.v[i]; return a; }
static inline f16 f16_sub(f16 a, f16 b) { EACH a.v[i] -= b.v[i]; return a; }
static inline f16 f16_mul(f16 a, f16 b) { EACH a.v[i] *= b.v[i]; return a; }
static inline f16 f16_div(f16 a, f16 b) { EACH a.v[i] /= b.v[i]; return a; }
static inline f16 f16_fma(f16 a, f16 b, f16 c) { EACH a.v[i] = fmaf(a.v[i], b.v[i], c.v[i]); return a; }
static inline f16 f16_fnma(f16 a, f16 b, f16 c) { EACH a.v[i] = fmaf(-a.v[i], b.v[i], c.v[i]); return a; }
static inline f16 f16_min(f16 a, f16 b) { EACH a.v[i] = a.v[i] < b.v[i] ? a.v[i] : b.v[i]; return a; }
static inline f16 f16_max(f16 a, f16 b) { EACH a.v[i] = a.v[i] > b.v[i] ? a.v[i] : b.v[i]; return a; }
static inline m16 f16_le(f16 a, f16 b) { m16 m = {0}; EACH m.bits |= (unsigned)(a.v[i] <= b.v[i]) << i; return m; }
static inline m16 f16_lt(f16 a, f16 b) { m16 m = {0}; EACH m.bits |= (unsigned)(a.v[i] < b.v[i]) << i; return m; }
static inline f16 f16_select(m16 m, f16 yes, f16 no) { EACH no.v[i] = m.bits >> i & 1 ? yes.v[i] : no.v[i]; return no; }
static inline f16 f16_round(f16 a) { EACH a.v[i] = rintf(a.v[i]); return a; }
static inline f16 f16_scale_pow2(f16 a, f16 n)
{
    EACH {
        uint32_t bits;
        memcpy(&bits, &a.v[i], 4);
        bits += (uint32_t)(int32_t)n.v[i] << 23;
        memcpy(&a.v[i], &bits, 4);
    }
    return a;
}
/* Lanes that hold no hit carry infinities here; like the vector instructions, give 0x80000000 for what does not fit. */
static inline u16 f16_truncate(f16 a) { u16 r; EACH r.v[i] = a.v[i] < 0x1p31f && a.v[i] > -0x1p31f ? (uint32_t)(int32_t)a.v[i] : 0x80000000u; return r; }
static inline f16 f16_gather(const float *p, u16 index) { f16 r; EACH r.v[i] = p[index.v[i]]; return r; }
static inline void f16_scatter(float *p, m16 m, u16 index, f16 a) { EACH if (m.bits >> i & 1) p[index.v[i]] = a.v[i]; }
static inline u16 u16_load(const uint32_t *p) { u16 r; memcpy(&r, p, sizeof r); return r; }
static inline void u16_store(uint32_t *p, u16 a) { memcpy(p, &a, sizeof a); }
static inline u16 u16_set1(uint32_t a) { u16 r; EACH r.v[i] = a; return r; }
static inline u16 u16_lanes(void) { u16 r; EACH r.v[i] = (uint32_t)i; return r; }
static inline u16 u16_add(u16 a, u16 b) { EACH a.v[i] += b.v[i]; return a; }
static inline u16 u16_and(u16 a, u16 b) { EACH a.v[i] &= b.v[i]; return a; }
static inline u16 u16_or(u16 a, u16 b) { EACH a.v[i] |= b.v[i]; return a; }
static inline u16 u16_xor(u16 a, u16 b) { EACH a.v[i] ^= b.v[i]; return a; }
static inline u16 u16_shl(u16 a, int n) { EACH a.v[i] <<= n; return a; }
static inline u16 u16_shr(u16 a, int n) { EACH a.v[i] >>= n; return a; }
static inline u16 u16_min(u16 a, u16 b) { EACH a.v[i] = a.v[i] < b.v[i] ? a.v[i] : b.v[i]; return a; }
static inline u16 u16_max(u16 a, u16 b) { EACH a.v[i] = a.v[i] > b.v[i] ? a.v[i] : b.v[i]; return a; }
static inline m16 u16_lt(u16 a, u16 b) { m16 m = {0}; EACH m.bits |= (unsigned)(a.v[i] < b.v[i]) << i; return m; }
static inline m16 u16_eq(u16 a, u16 b) { m16 m = {0}; EACH m.bits |= (unsigned)(a.v[i] == b.v[i]) << i; return m; }
static inline u16 u16_select(m16 m, u16 yes, u16 no) { EACH no.v[i] = m.bits >> i & 1 ? yes.v[i] : no.v[i]; return no; }
static inline void u16_store_bytes(uint8_t *p, u16 a) { EACH p[i] = (uint8_t)a.v[i]; }
static inline u16 u16_load_bytes(const uint8_t *p) { u16 r; EACH r.v[i] = p[i]; return r; }
static inline m16 m16_and(m16 a, m16 b) { return (m16){a.bits & b.bits}; }
static inline m16 m16_or(m16 a, m16 b) { return (m16){a.bits | b.bits}; }
static inline m16 m16_andnot(m16 a, m16 b) { return (m16){b.bits & ~a.bits}; }
static inline unsigned m16_bits(m16 m) { return m.bits; }
static inline m16 m16_from_bits(unsigned bits) { return (m16){bits & 0xFFFF}; }
static inline f16 f16_sum_rows(const f16 in[16])
{
    f16 out;
    EACH {
        float g[4];
        for (int k = 0; k < 4; k++) {
            const float *e = in[i].v + 4 * k;
            g[k] = (e[0] + e[2]) + (e[1] + e[3]);
        }
        out.v[i] = (g[0] + g[1]) + (g[2] + g[3]);
    }
    return out;
}
#undef EACH
#endif

static inline int m16_any(m16 m) { return m16_bits(m) != 0; }

/** exp(x) for x in [-80, 0]; largest error about 1 ulp. Taylor to x^6 after removing n ln 2 in two parts. */
static inline f16 f16_exp(f16 x)
{
    const f16 n = f16_round(f16_mul(x, f16_set1(1.44269504f)));
    f16 r = f16_fnma(n, f16_set1(0.693145752f), x);
    r = f16_fnma(n, f16_set1(1.42860677e-6f), r);
    f16 p = f16_set1(1.0f / 720);
    p = f16_fma(p, r, f16_set1(1.0f / 120));
    p = f16_fma(p, r, f16_set1(1.0f / 24));
    p = f16_fma(p, r, f16_set1(1.0f / 6));
    p = f16_fma(p, r, f16_set1(0.5f));
    p = f16_fma(p, r, f16_set1(1.0f));
    p = f16_fma(p, r, f16_set1(1.0f));
    return f16_scale_pow2(p, n);
}

#endif
