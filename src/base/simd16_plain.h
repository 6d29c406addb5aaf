/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16_plain.h -- simd16.h in plain C, which defines the results. */
#ifndef GBT_BASE_SIMD16_PLAIN_H
#define GBT_BASE_SIMD16_PLAIN_H

#include <math.h>
#include <stdint.h>
#include <string.h>

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
/* Sums of x and of x y of lanes eight apart. */
typedef struct vfloat8 {
    float v[8];
} vfloat8;
static inline vfloat8 vfloat16_fold(vfloat16 x)
{
    vfloat8 r;
    for (int i = 0; i < 8; i++)
        r.v[i] = x.v[i] + x.v[i + 8];
    return r;
}
static inline vfloat8 vfloat16_fold_product(vfloat16 x, vfloat16 y)
{
    vfloat8 r;
    for (int i = 0; i < 8; i++)
        r.v[i] = fmaf(x.v[i + 8], y.v[i + 8], x.v[i] * y.v[i]);
    return r;
}
/* out[j] = the sum of in[j], j = 0..15, in a fixed order: lanes four apart, then two, then the last two. */
static inline vfloat16 vfloat8_sum_rows(const vfloat8 in[16])
{
    vfloat16 out;
    EACH
    {
        const float *e = in[i].v;
        out.v[i] = ((e[0] + e[4]) + (e[2] + e[6])) + ((e[1] + e[5]) + (e[3] + e[7]));
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
static inline void vfloat16_load_transposed(const float *const rows[16], vfloat16 out[16])
{
    EACH for (int j = 0; j < 16; j++) out[j].v[i] = rows[i][j];
}
#undef EACH

#endif
