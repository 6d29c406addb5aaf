/* SPDX-License-Identifier: Apache-2.0 */
/* trace/triples.h -- four neighbouring pixels or directions of three numbers each: to one array per number,
   and back. */
#ifndef GBT_TRACE_TRIPLES_H
#define GBT_TRACE_TRIPLES_H

#include <stdint.h>
#include <string.h>

typedef float four_floats __attribute__((vector_size(16)));
typedef int32_t four_ints __attribute__((vector_size(16)));

static inline four_floats four_load(const float *p)
{
    four_floats v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline void four_store(float *p, four_floats v) { memcpy(p, &v, sizeof v); }

/* From x0 y0 z0 x1, y1 z1 x2 y2, z2 x3 y3 z3 to x0 x1 x2 x3, and so on. Every step takes two elements of each
   operand, which is one shuffle instruction. */
static inline void load_triples(const float *from, four_floats out[3])
{
    const four_floats a = four_load(from), b = four_load(from + 4), c = four_load(from + 8);
    const four_floats yz = __builtin_shufflevector(a, b, 1, 2, 4, 5), /* y0 z0 y1 z1 */
        xy = __builtin_shufflevector(b, c, 2, 3, 5, 6);               /* x2 y2 x3 y3 */
    out[0] = __builtin_shufflevector(a, xy, 0, 3, 4, 6);
    out[1] = __builtin_shufflevector(yz, xy, 0, 2, 5, 7);
    out[2] = __builtin_shufflevector(yz, c, 1, 3, 4, 7);
}

static inline void store_triples(const four_floats in[3], float *to)
{
    const four_floats xy = __builtin_shufflevector(in[0], in[1], 0, 2, 4, 6), /* x0 x2 y0 y2 */
        yz = __builtin_shufflevector(in[1], in[2], 1, 3, 5, 7),               /* y1 y3 z1 z3 */
        zx = __builtin_shufflevector(in[2], in[0], 0, 2, 5, 7);               /* z0 z2 x1 x3 */
    four_store(to, __builtin_shufflevector(xy, zx, 0, 2, 4, 6));
    four_store(to + 4, __builtin_shufflevector(yz, xy, 0, 2, 5, 7));
    four_store(to + 8, __builtin_shufflevector(zx, yz, 1, 3, 5, 7));
}

#endif
