/* SPDX-License-Identifier: Apache-2.0 */
/* base/morton.h -- the bits of Morton codes (Morton 1966). */
#ifndef GBT_BASE_MORTON_H
#define GBT_BASE_MORTON_H

#include <stdint.h>

/** Move each bit k of the lowest 21 bits to bit 3 k, with zeros between. */
static inline uint64_t morton_spread(uint64_t x)
{
    x = (x | x << 32) & UINT64_C(0x1F00000000FFFF);
    x = (x | x << 16) & UINT64_C(0x1F0000FF0000FF);
    x = (x | x << 8) & UINT64_C(0x100F00F00F00F00F);
    x = (x | x << 4) & UINT64_C(0x10C30C30C30C30C3);
    return (x | x << 2) & UINT64_C(0x1249249249249249);
}

#endif
