/* SPDX-License-Identifier: Apache-2.0 */
/* trace/packet_extra16.h -- the outputs of a packet's rays other than colour: depth, normal, counts. Included
   by kernels. */
#ifndef GBT_TRACE_PACKET_EXTRA16_H
#define GBT_TRACE_PACKET_EXTRA16_H

#include "trace/gaussian16.h"

typedef struct packet_extra {
    vfloat16 depth, weight; /* sums of T alpha t and T alpha; 1 - T has lost its digits where little is hit */
    vfloat16 median, normal[3], count, top_weight;
    _Alignas(64) uint32_t top_id[PACKET_LANES];
} packet_extra;

static inline void start_extra(packet_extra *e)
{
    const vfloat16 zero = vfloat16_set1(0);
    *e = (packet_extra){zero, zero, vfloat16_set1(INFINITY), {zero, zero, zero}, zero, zero, {0}};
    memset(e->top_id, 0xFF, sizeof e->top_id);
}

/* What a blended row adds to the outputs beside colour. */
static inline void note_row(packet_extra *e, const packet_rays *rays, const float *record, uint32_t id,
                            vmask16 blend, vfloat16 weight, vfloat16 next, vfloat16 t)
{
    const vfloat16 zero = vfloat16_set1(0);
    float normal[3];
    shortest_axis(record, normal);
    const vfloat16 dir[3] = {vfloat16_load(rays->dir[0]), vfloat16_load(rays->dir[1]),
                             vfloat16_load(rays->dir[2])};
    const vfloat16 toward = vfloat16_select(vfloat16_lt(dot_lanes(normal, dir), zero), weight,
                                            vfloat16_sub(zero, weight)); /* normals look at the camera */
    for (int k = 0; k < 3; k++)
        e->normal[k] = vfloat16_fma(toward, vfloat16_set1(normal[k]), e->normal[k]);
    e->depth = vfloat16_fma(weight, vfloat16_select(blend, t, zero), e->depth);
    e->weight = vfloat16_add(e->weight, weight);
    e->median =
        vfloat16_min(e->median, vfloat16_select(vmask16_and(blend, vfloat16_lt(next, vfloat16_set1(0.5f))), t,
                                                vfloat16_set1(INFINITY)));
    e->count = vfloat16_add_where(blend, e->count, vfloat16_set1(1));
    const vmask16 top = vfloat16_lt(e->top_weight, weight);
    e->top_weight = vfloat16_max(e->top_weight, weight);
    for (unsigned bits = vmask16_bits(top); bits != 0; bits &= bits - 1)
        e->top_id[__builtin_ctz(bits)] = id;
}

static inline void store_extra(const packet_extra *e, packet_output *out)
{
    vfloat16_store(out->weighted_depth, e->depth);
    vfloat16_store(out->weight, e->weight);
    vfloat16_store(out->median_depth, e->median);
    vfloat16_store(out->hit_count, e->count);
    for (int k = 0; k < 3; k++)
        vfloat16_store(out->normal[k], e->normal[k]);
    memcpy(out->strongest, e->top_id, sizeof e->top_id);
}

#endif
