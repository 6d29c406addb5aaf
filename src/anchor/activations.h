/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/activations.h -- exp, tanh and sigmoid in single precision, with the same bits on every instruction
   set, and in a form that vectorises in loops.

   They use only additions, products, one division and fused multiply-adds in a fixed order, so results do not
   depend on the machine's libm. */
#ifndef GBT_ANCHOR_ACTIVATIONS_H
#define GBT_ANCHOR_ACTIVATIONS_H

#include <stdint.h>
#include <string.h>

/* Arguments of exp() and sigmoid() are clamped to +- this: exp(-30) sigmoid(-30) is still a normal float, so
   a scale is never 0. */
#define ACTIVATION_LIMIT 30.0f

/** x clamped to [low, high]; NaN becomes `low`. */
static inline float activation_clamp(float x, float low, float high)
{
    const float above = x > low ? x : low;
    return above < high ? above : high;
}

/** exp(x) = *power (1 + result) with *power = 2^n and |result| < 0.42; |x| <= 87. */
static inline float activation_exp_parts(float x, float *power)
{
    /* Adding 1.5 * 2^23 rounds x / ln 2 to an integer n, which then stands in the low bits of the sum. */
    const float shifter = 12582912.0f;
    const float shifted = __builtin_fmaf(x, 1.44269504f, shifter);
    const float n = shifted - shifter;
    /* ln 2 in two parts; the first has 9 trailing zero bits, so n times it is exact. */
    float r = __builtin_fmaf(n, -0.693145752f, x);
    r = __builtin_fmaf(n, -1.42860677e-6f, r);
    /* Taylor to r^7: the remainder is below 6e-9 for |r| <= ln(2) / 2. */
    float p = 1.0f / 5040.0f;
    p = __builtin_fmaf(p, r, 1.0f / 720.0f);
    p = __builtin_fmaf(p, r, 1.0f / 120.0f);
    p = __builtin_fmaf(p, r, 1.0f / 24.0f);
    p = __builtin_fmaf(p, r, 1.0f / 6.0f);
    p = __builtin_fmaf(p, r, 0.5f);
    uint32_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits << 23) + 0x3F800000u;
    memcpy(power, &bits, sizeof bits);
    return __builtin_fmaf(p * r, r, r);
}

/** exp of x clamped to [-30, 30]; error below 2 ulp. */
static inline float activation_exp(float x)
{
    float power;
    const float tail = activation_exp_parts(activation_clamp(x, -ACTIVATION_LIMIT, ACTIVATION_LIMIT), &power);
    return __builtin_fmaf(power, tail, power);
}

/** 1 / (1 + exp(-x)) with x clamped to [-30, 30]. Derivative: s (1 - s). */
static inline float activation_sigmoid(float x)
{
    float power;
    const float tail =
        activation_exp_parts(-activation_clamp(x, -ACTIVATION_LIMIT, ACTIVATION_LIMIT), &power);
    return 1.0f / (1.0f + __builtin_fmaf(power, tail, power));
}

/** tanh through expm1(2 |x|); the relative error is small also near 0. Derivative: 1 - t^2. NaN gives -1. */
static inline float activation_tanh(float x)
{
    const float cut = activation_clamp(x, -10.0f, 10.0f); /* tanh(10) rounds to 1 */
    float power;
    const float tail = activation_exp_parts(2.0f * __builtin_fabsf(cut), &power);
    const float expm1 = __builtin_fmaf(power, tail, power - 1.0f);
    return __builtin_copysignf(expm1 / (expm1 + 2.0f), cut);
}

#endif
