/* SPDX-License-Identifier: Apache-2.0 */
/* io/half.h -- 16-bit floats (IEEE 754 binary16) by integer operations only, so results do not depend on the
   machine. */
#ifndef GBT_IO_HALF_H
#define GBT_IO_HALF_H

#include <stdint.h>
#include <string.h>

/** Round to nearest, ties to even; values beyond the largest half become the largest half. `x` is finite. */
static inline uint16_t half_from_float(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000);
    const uint32_t magnitude = bits & 0x7FFFFFFF;
    if (magnitude >= 0x477FF000) /* rounds to 65536 or more */
        return sign | 0x7BFF;
    if (magnitude < 0x33000001) /* at most half of the smallest subnormal, 2^-24 */
        return sign;
    const int exponent = (int)(magnitude >> 23) - 127; /* -25 .. 15 */
    const uint32_t mantissa = (magnitude & 0x7FFFFF) | 0x800000;
    const int drop = exponent < -14 ? -1 - exponent : 13;
    const uint32_t kept = mantissa >> drop, rest = mantissa & ((1u << drop) - 1), tie = 1u << (drop - 1);
    const uint32_t rounded = kept + (rest > tie || (rest == tie && (kept & 1)));
    /* A mantissa that rounds up to the next power of two carries into the exponent, as it should. */
    const uint32_t base = exponent < -14 ? 0 : (uint32_t)(exponent + 14) << 10;
    return (uint16_t)(sign | (base + rounded));
}

/** Exact. The codes of infinities and NaN, which our files do not contain, give finite numbers >= 2^16. */
static inline float float_from_half(uint16_t half)
{
    const uint32_t exponent = half >> 10 & 31, mantissa = half & 0x3FF;
    float x;
    if (exponent == 0) {
        x = (float)mantissa * 0x1p-24f;
    } else {
        const uint32_t bits = (exponent + 112) << 23 | mantissa << 13;
        memcpy(&x, &bits, sizeof x);
    }
    return half & 0x8000 ? -x : x;
}

#endif
