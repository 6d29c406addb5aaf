/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16_neon.h -- simd16.h for NEON of 64-bit ARM: four registers. */
#ifndef GBT_BASE_SIMD16_NEON_H
#define GBT_BASE_SIMD16_NEON_H

#include <arm_neon.h>
#include <stddef.h>
#include <stdint.h>

typedef struct vfloat16 {
    float32x4_t a, b, c, d;
} vfloat16;
typedef struct vmask16 {
    uint32x4_t a, b, c, d;
} vmask16;

#define VFLOAT16_EACH(f, x) ((vfloat16){f((x).a), f((x).b), f((x).c), f((x).d)})
#define VFLOAT16_PAIRS(f, x, y)                                                                              \
    {                                                                                                        \
        f((x).a, (y).a), f((x).b, (y).b), f((x).c, (y).c), f((x).d, (y).d)                                   \
    }

static inline vfloat16 vfloat16_load(const float *p)
{
    return (vfloat16){vld1q_f32(p), vld1q_f32(p + 4), vld1q_f32(p + 8), vld1q_f32(p + 12)};
}
static inline void vfloat16_store(float *p, vfloat16 x)
{
    vst1q_f32(p, x.a);
    vst1q_f32(p + 4, x.b);
    vst1q_f32(p + 8, x.c);
    vst1q_f32(p + 12, x.d);
}
static inline vfloat16 vfloat16_set1(float x)
{
    const float32x4_t all = vdupq_n_f32(x);
    return (vfloat16){all, all, all, all};
}
static inline vfloat16 vfloat16_add(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(vaddq_f32, x, y);
}
static inline vfloat16 vfloat16_sub(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(vsubq_f32, x, y);
}
static inline vfloat16 vfloat16_mul(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(vmulq_f32, x, y);
}
static inline vfloat16 vfloat16_div(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(vdivq_f32, x, y);
}
static inline vfloat16 vfloat16_sqrt(vfloat16 x) { return VFLOAT16_EACH(vsqrtq_f32, x); }
static inline vfloat16 vfloat16_fma(vfloat16 x, vfloat16 y, vfloat16 z)
{
    return (vfloat16){vfmaq_f32(z.a, x.a, y.a), vfmaq_f32(z.b, x.b, y.b), vfmaq_f32(z.c, x.c, y.c),
                      vfmaq_f32(z.d, x.d, y.d)};
}
static inline vfloat16 vfloat16_fnma(vfloat16 x, vfloat16 y, vfloat16 z)
{
    return (vfloat16){vfmsq_f32(z.a, x.a, y.a), vfmsq_f32(z.b, x.b, y.b), vfmsq_f32(z.c, x.c, y.c),
                      vfmsq_f32(z.d, x.d, y.d)};
}

/* As in the plain version, NaN gives the second argument; NEON's FMIN and FMAX would return the NaN. */
static inline float32x4_t lesser4(float32x4_t x, float32x4_t y) { return vbslq_f32(vcltq_f32(x, y), x, y); }
static inline float32x4_t greater4(float32x4_t x, float32x4_t y) { return vbslq_f32(vcgtq_f32(x, y), x, y); }
static inline vfloat16 vfloat16_min(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(lesser4, x, y);
}
static inline vfloat16 vfloat16_max(vfloat16 x, vfloat16 y)
{
    return (vfloat16)VFLOAT16_PAIRS(greater4, x, y);
}

static inline vmask16 vfloat16_le(vfloat16 x, vfloat16 y) { return (vmask16)VFLOAT16_PAIRS(vcleq_f32, x, y); }
static inline vmask16 vfloat16_lt(vfloat16 x, vfloat16 y) { return (vmask16)VFLOAT16_PAIRS(vcltq_f32, x, y); }
static inline vfloat16 vfloat16_select(vmask16 m, vfloat16 yes, vfloat16 no)
{
    return (vfloat16){vbslq_f32(m.a, yes.a, no.a), vbslq_f32(m.b, yes.b, no.b), vbslq_f32(m.c, yes.c, no.c),
                      vbslq_f32(m.d, yes.d, no.d)};
}
static inline vfloat16 vfloat16_round(vfloat16 x) { return VFLOAT16_EACH(vrndnq_f32, x); }
static inline float32x4_t scale_pow2_4(float32x4_t x, float32x4_t n)
{
    return vreinterpretq_f32_s32(vaddq_s32(vreinterpretq_s32_f32(x), vshlq_n_s32(vcvtq_s32_f32(n), 23)));
}
static inline vfloat16 vfloat16_scale_pow2(vfloat16 x, vfloat16 n)
{
    return (vfloat16)VFLOAT16_PAIRS(scale_pow2_4, x, n);
}
static inline float vfloat16_lowest(vfloat16 x)
{
    return vminvq_f32(vminq_f32(vminq_f32(x.a, x.b), vminq_f32(x.c, x.d)));
}
static inline float vfloat16_highest(vfloat16 x)
{
    return vmaxvq_f32(vmaxq_f32(vmaxq_f32(x.a, x.b), vmaxq_f32(x.c, x.d)));
}

static inline vmask16 vmask16_and(vmask16 x, vmask16 y) { return (vmask16)VFLOAT16_PAIRS(vandq_u32, x, y); }
static inline vmask16 vmask16_or(vmask16 x, vmask16 y) { return (vmask16)VFLOAT16_PAIRS(vorrq_u32, x, y); }
static inline vmask16 vmask16_andnot(vmask16 x, vmask16 y)
{
    return (vmask16)VFLOAT16_PAIRS(vbicq_u32, y, x); /* y and not x */
}
static inline unsigned vmask16_bits(vmask16 m)
{
    const uint8x16_t bit = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    const uint16x8_t low = vcombine_u16(vmovn_u32(m.a), vmovn_u32(m.b));
    const uint16x8_t high = vcombine_u16(vmovn_u32(m.c), vmovn_u32(m.d));
    const uint8x16_t bits = vandq_u8(vcombine_u8(vmovn_u16(low), vmovn_u16(high)), bit);
    return (unsigned)vaddv_u8(vget_low_u8(bits)) | (unsigned)vaddv_u8(vget_high_u8(bits)) << 8;
}
#define VMASK16_ANY
static inline int vmask16_any(vmask16 m)
{
    return vmaxvq_u32(vorrq_u32(vorrq_u32(m.a, m.b), vorrq_u32(m.c, m.d))) != 0;
}
static inline vmask16 vmask16_from_bits(unsigned bits)
{
    const uint32x4_t all = vdupq_n_u32(bits), bit = {1, 2, 4, 8};
    return (vmask16){vtstq_u32(all, bit), vtstq_u32(all, vshlq_n_u32(bit, 4)),
                     vtstq_u32(all, vshlq_n_u32(bit, 8)), vtstq_u32(all, vshlq_n_u32(bit, 12))};
}

/* Combine the lower halves, or the upper halves, of x and y. */
static inline float32x4_t lower_halves(float32x4_t x, float32x4_t y)
{
    return vreinterpretq_f32_f64(vzip1q_f64(vreinterpretq_f64_f32(x), vreinterpretq_f64_f32(y)));
}
static inline float32x4_t upper_halves(float32x4_t x, float32x4_t y)
{
    return vreinterpretq_f32_f64(vzip2q_f64(vreinterpretq_f64_f32(x), vreinterpretq_f64_f32(y)));
}

#define VFLOAT16_TURN_ROWS(name, op)                                                                         \
    static inline float32x4_t name##_transposed(float32x4_t x, float32x4_t y, float32x4_t z, float32x4_t w)  \
    {                                                                                                        \
        const float32x4_t xy = op(lower_halves(x, y), upper_halves(x, y));                                   \
        const float32x4_t zw = op(lower_halves(z, w), upper_halves(z, w));                                   \
        return op(vuzp1q_f32(xy, zw), vuzp2q_f32(xy, zw));                                                   \
    }
#define VFLOAT16_REDUCE_ROWS(name, op)                                                                       \
    VFLOAT16_TURN_ROWS(name, op)                                                                             \
    static inline float32x4_t name##_lanes(vfloat16 x) { return op(op(x.a, x.c), op(x.b, x.d)); }            \
    static inline float32x4_t name##_four(const vfloat16 *in)                                                \
    {                                                                                                        \
        return name##_transposed(name##_lanes(in[0]), name##_lanes(in[1]), name##_lanes(in[2]),              \
                                 name##_lanes(in[3]));                                                       \
    }                                                                                                        \
    static inline vfloat16 name(const vfloat16 in[16])                                                       \
    {                                                                                                        \
        return (vfloat16){name##_four(in), name##_four(in + 4), name##_four(in + 8), name##_four(in + 12)};  \
    }
VFLOAT16_TURN_ROWS(sum, vaddq_f32)
VFLOAT16_REDUCE_ROWS(vfloat16_min_rows, lesser4)
VFLOAT16_REDUCE_ROWS(vfloat16_max_rows, greater4)
#undef VFLOAT16_REDUCE_ROWS
#undef VFLOAT16_TURN_ROWS
#undef VFLOAT16_PAIRS
#undef VFLOAT16_EACH

typedef struct vfloat8 {
    float32x4_t a, b;
} vfloat8;
static inline vfloat8 vfloat16_fold(vfloat16 x)
{
    return (vfloat8){vaddq_f32(x.a, x.c), vaddq_f32(x.b, x.d)};
}
static inline vfloat8 vfloat16_fold_product(vfloat16 x, vfloat16 y)
{
    return (vfloat8){vfmaq_f32(vmulq_f32(x.a, y.a), x.c, y.c), vfmaq_f32(vmulq_f32(x.b, y.b), x.d, y.d)};
}
static inline float32x4_t sum4_rows(const vfloat8 *in)
{
    return sum_transposed(vaddq_f32(in[0].a, in[0].b), vaddq_f32(in[1].a, in[1].b),
                          vaddq_f32(in[2].a, in[2].b), vaddq_f32(in[3].a, in[3].b));
}
static inline vfloat16 vfloat8_sum_rows(const vfloat8 in[16])
{
    return (vfloat16){sum4_rows(in), sum4_rows(in + 4), sum4_rows(in + 8), sum4_rows(in + 12)};
}

/* Transpose 4 x 4 floats. */
static inline void transpose4(const float *const rows[4], size_t column, float32x4_t out[4])
{
    const float32x4_t x = vld1q_f32(rows[0] + column), y = vld1q_f32(rows[1] + column);
    const float32x4_t z = vld1q_f32(rows[2] + column), w = vld1q_f32(rows[3] + column);
    const float32x4_t xy0 = vtrn1q_f32(x, y), xy1 = vtrn2q_f32(x, y);
    const float32x4_t zw0 = vtrn1q_f32(z, w), zw1 = vtrn2q_f32(z, w);
    out[0] = lower_halves(xy0, zw0);
    out[1] = lower_halves(xy1, zw1);
    out[2] = upper_halves(xy0, zw0);
    out[3] = upper_halves(xy1, zw1);
}

static inline void vfloat16_load_transposed(const float *const rows[16], vfloat16 out[16])
{
    for (size_t column = 0; column < 16; column += 4) {
        float32x4_t a[4], b[4], c[4], d[4];
        transpose4(rows, column, a);
        transpose4(rows + 4, column, b);
        transpose4(rows + 8, column, c);
        transpose4(rows + 12, column, d);
        for (size_t j = 0; j < 4; j++)
            out[column + j] = (vfloat16){a[j], b[j], c[j], d[j]};
    }
}

#endif
