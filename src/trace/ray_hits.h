/* SPDX-License-Identifier: Apache-2.0 */
/* trace/ray_hits.h -- the hits of one ray, and how they are sorted. Included by kernels. */
#ifndef GBT_TRACE_RAY_HITS_H
#define GBT_TRACE_RAY_HITS_H

#include <string.h>

#include "trace/kernel.h"

enum { SHORT_RUN = 8 };

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

/* Merge sort from runs of SHORT_RUN; `spare` has room for n. */
static inline void sort_hits(ray_hit *hits, ray_hit *spare, size_t n)
{
    for (size_t first = 0; first < n; first += SHORT_RUN)
        for (size_t i = first + 1; i < n && i < first + SHORT_RUN; i++) {
            const ray_hit moved = hits[i];
            size_t j = i;
            for (; j > first && hits[j - 1].key > moved.key; j--)
                hits[j] = hits[j - 1];
            hits[j] = moved;
        }
    ray_hit *from = hits, *to = spare;
    for (size_t run = SHORT_RUN; run < n; run *= 2) {
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
