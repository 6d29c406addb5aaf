/* SPDX-License-Identifier: Apache-2.0 */
/* trace/ray_hits.h -- the hits of one ray, and how they are sorted. Included by kernels. */
#ifndef GBT_TRACE_RAY_HITS_H
#define GBT_TRACE_RAY_HITS_H

#include <math.h>
#include <string.h>

#include "base/simd16.h"
#include "trace/kernel.h"

enum { RANKED = 96 /* a multiple of 16 */ };

static inline ray_hit make_hit(float t, float alpha, uint32_t id)
{
    uint32_t bits;
    memcpy(&bits, &t, sizeof bits);
    return (ray_hit){.key = (uint64_t)bits << 32 | id, .alpha = alpha};
}

static inline float hit_depth(const ray_hit *h)
{
    const uint32_t bits = (uint32_t)(h->key >> 32);
    float t;
    memcpy(&t, &bits, sizeof t);
    return t;
}

/* Put up to RANKED hits in the order of their keys. The place of a hit is the number of those with a smaller
   depth, and of those before it with the same one, counted sixteen at a time; no branch depends on what the
   depths are. Equal depths are rare and are then put in the order of their indices. */
static inline void rank_hits(const ray_hit *hits, size_t n, ray_hit *out)
{
    _Alignas(64) float depth[RANKED], place[RANKED];
    const size_t padded = (n + 15) & ~(size_t)15;
    for (size_t i = 0; i < padded; i++)
        depth[i] = i < n ? hit_depth(&hits[i]) : INFINITY;
    for (size_t first = 0; first < padded; first += 16) {
        const vfloat16 mine = vfloat16_load(depth + first), one = vfloat16_set1(1);
        const size_t end = first + 16 < n ? first + 16 : n;
        vfloat16 before = vfloat16_set1(0);
        for (size_t j = 0; j < first; j++)
            before = vfloat16_add_where(vfloat16_le(vfloat16_set1(depth[j]), mine), before, one);
        for (size_t j = first; j < end; j++) {
            const vfloat16 other = vfloat16_set1(depth[j]);
            const vmask16 later = vmask16_from_bits(0xFFFEu << (j - first) & 0xFFFFu);
            const vmask16 nearer =
                vmask16_or(vfloat16_lt(other, mine), vmask16_and(later, vfloat16_le(other, mine)));
            before = vfloat16_add_where(nearer, before, one);
        }
        for (size_t j = end; j < n; j++)
            before = vfloat16_add_where(vfloat16_lt(vfloat16_set1(depth[j]), mine), before, one);
        vfloat16_store(place + first, before);
    }
    for (size_t i = 0; i < n; i++)
        out[(size_t)place[i]] = hits[i];
    for (size_t i = 1; i < n; i++)
        for (size_t j = i; j > 0 && out[j - 1].key > out[j].key; j--) {
            const ray_hit swap = out[j];
            out[j] = out[j - 1];
            out[j - 1] = swap;
        }
}

/* Merge sort from runs of RANKED; `spare` has room for n. */
static inline void sort_hits(ray_hit *hits, ray_hit *spare, size_t n)
{
    for (size_t first = 0; first < n; first += RANKED)
        rank_hits(hits + first, n - first < RANKED ? n - first : RANKED, spare + first);
    ray_hit *from = spare, *to = hits;
    for (size_t run = RANKED; run < n; run *= 2) {
        for (size_t first = 0; first < n; first += 2 * run) {
            const size_t middle = first + run < n ? first + run : n,
                         end = first + 2 * run < n ? first + 2 * run : n;
            size_t a = first, b = middle;
            for (size_t i = first; i < end; i++)
                to[i] = b == end || (a < middle && from[a].key <= from[b].key) ? from[a++] : from[b++];
        }
        ray_hit *swap = from;
        from = to;
        to = swap;
    }
    if (from != hits)
        memcpy(hits, from, n * sizeof *hits);
}

#endif
