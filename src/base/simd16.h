/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd16.h -- sixteen floats at a time: one name per operation, four instruction sets.

   A kernel includes this file and is compiled once per instruction set (gbt_kernels in CMakeLists.txt). Every
   operation gives the same bits in all of them, because fused multiply-adds are named and sums have a fixed
   order; so a kernel's result does not depend on the machine. The plain version defines the results; a file
   that defines SIMD16_PLAIN gets it even if the compiler has vectors.

   vfloat16: 16 floats; vfloat8: 8 floats, sums of lanes that are eight apart; vmask16: 16 booleans. */
#ifndef GBT_BASE_SIMD16_H
#define GBT_BASE_SIMD16_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/compare.h"
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#include "base/simd16_avx512.h"
#elif defined(__AVX2__) && defined(__FMA__)
#include "base/simd16_avx2.h"
#elif defined(__aarch64__) && !defined(SIMD16_PLAIN)
#include "base/simd16_neon.h"
#else
#include "base/simd16_plain.h"
#endif

#ifndef VFLOAT16_WHERE
/* m ? x y : x */
static inline vfloat16 vfloat16_mul_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_mul(x, y), x);
}
/* m ? x + y : x */
static inline vfloat16 vfloat16_add_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_add(x, y), x);
}
static inline vfloat16 vfloat16_add_unless(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, x, vfloat16_add(x, y));
}
/* m ? x - x y : x, rounded once */
static inline vfloat16 vfloat16_less_where(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, vfloat16_fnma(x, y, x), x);
}
static inline vfloat16 vfloat16_less_unless(vmask16 m, vfloat16 x, vfloat16 y)
{
    return vfloat16_select(m, x, vfloat16_fnma(x, y, x));
}
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

#ifndef VMASK16_PACK
static inline unsigned vmask16_pack(vmask16 m, const uint32_t *from, uint32_t *out)
{
    unsigned count = 0;
    for (unsigned bits = vmask16_bits(m); bits != 0; bits &= bits - 1)
        out[count++] = from[__builtin_ctz(bits)];
    return count;
}
#endif

#ifndef VMASK16_ANY
static inline int vmask16_any(vmask16 m) { return vmask16_bits(m) != 0; }
#endif

/** out[j] = the sum of in[j], j = 0..15, in a fixed order: lanes eight apart first. */
static inline vfloat16 vfloat16_sum_rows(const vfloat16 in[16])
{
    vfloat8 half[16];
    for (int j = 0; j < 16; j++)
        half[j] = vfloat16_fold(in[j]);
    return vfloat8_sum_rows(half);
}

/** The smallest argument of vfloat16_exp2(). An opacity times 2^-120 is far below the smallest possible
    alpha_min, 1e-30. */
#define EXP2_LEAST (-120.0f)

/** 2^x for x in [-120, 0]; largest error about 1 ulp. Taylor polynomial of 2^r to r^6 on [-1/2, 1/2],
    evaluated in pairs of terms to reduce latency. */
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
