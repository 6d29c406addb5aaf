/* SPDX-License-Identifier: Apache-2.0 */
/* base/hash.h -- FNV-1a hash of bytes: distinguishes data, not cryptographic. */
#ifndef GBT_BASE_HASH_H
#define GBT_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

#define HASH_START UINT64_C(0xcbf29ce484222325)

/** Continue from `hash`; start with HASH_START. */
static inline uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *at = bytes;
    for (size_t i = 0; i < count; i++)
        hash = (hash ^ at[i]) * UINT64_C(0x100000001b3);
    return hash;
}

#endif
