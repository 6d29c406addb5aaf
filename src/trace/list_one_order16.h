/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_one_order16.h -- the adjoint of a packet whose rays share one order
   (trace_settings.packet_order), in one pass over its rows, and of the spread term. Included by
   list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_ONE_ORDER16_H
#define GBT_TRACE_LIST_ONE_ORDER16_H

#include "trace/list_sums16.h"

/* Sums of w and of w u over the hits in front of a row and over those behind it (trace_settings.spread). */
typedef struct spread_sums {
    vfloat16 front, near_front, behind, near_behind;
} spread_sums;

/* The next row towards the front: dL/dw of its spread term, without the factor. */
static inline vfloat16 spread_row(spread_sums *s, vfloat16 weight, vfloat16 u)
{
    s->front = vfloat16_sub(s->front, weight);
    s->near_front = vfloat16_fnma(weight, u, s->near_front);
    const vfloat16 of_front = vfloat16_fnma(u, s->front, s->near_front),
                   of_behind = vfloat16_sub(vfloat16_mul(u, s->behind), s->near_behind);
    s->behind = vfloat16_add(s->behind, weight);
    s->near_behind = vfloat16_fma(weight, u, s->near_behind);
    return vfloat16_add(of_front, of_behind);
}

/* The whole adjoint of a packet with one order, from the last row to the first. `T` starts as that behind all
   rows and is divided by 1 - alpha from row to row; `behind` is g . B, B the colour behind the row, and
   starts as that of the background. The spread term acts like a further colour of each hit. */
static PASS void sum_in_order(const packet_pass *p, const used_list *used, const tape_entry *entry,
                              size_t count, vfloat16 T, vfloat16 near_sum, vfloat16 behind,
                              const vfloat16 direction[3], gradient_slot *sums)
{
    const kernel_scene *scene = p->scene;
    const packet_rays *rays = p->rays;
    const tile_gaussian *used_gaussian = used->gaussian;
    const uint32_t *used_number = used->number;
    const vfloat16 one = vfloat16_set1(1), zero = vfloat16_set1(0), a = vfloat16_load(p->slopes.a),
                   b = vfloat16_load(p->slopes.b), length = vfloat16_load(p->slopes.length),
                   alpha_max = vfloat16_set1(scene->settings.alpha_max),
                   t_near = vfloat16_set1(scene->settings.t_near),
                   spread = vfloat16_set1(2 * scene->settings.spread),
                   d_rgb[3] = {direction[0], direction[1], direction[2]};
    const bool spreads = scene->settings.spread > 0;
    spread_sums of_spread = {vfloat16_sub(one, T), near_sum, zero, zero};
    for (size_t done = 0; done < count; done += TOGETHER) {
        const size_t left = count - done;
        const tile_gaussian *g[TOGETHER];
        row_response r[TOGETHER];
        vfloat16 alpha[TOGETHER], one_minus_alpha[TOGETHER], inverse[TOGETHER], h[TOGETHER], weight[TOGETHER],
            v[TOGETHER][3];
        uint32_t number[TOGETHER];
        for (size_t k = 0; k < TOGETHER; k++) {
            number[k] = used_number[entry[k < left ? left - 1 - k : 0].id];
            g[k] = &used_gaussian[number[k]];
        }
        respond_rows(scene, rays, g, a, b, length, r, v);
        for (size_t k = 0; k < TOGETHER; k++) {
            const vmask16 hit = vmask16_from_bits(entry[k < left ? left - 1 - k : 0].lanes);
            alpha[k] = vfloat16_select(hit, vfloat16_min(r[k].raw, alpha_max), zero);
            one_minus_alpha[k] = vfloat16_sub(one, alpha[k]);
            inverse[k] = vfloat16_div(one, one_minus_alpha[k]);
        }
        for (size_t k = 0; k < TOGETHER; k++) { /* the cap: see row_gradients() */
            vfloat16 color = dot_lanes(g[k]->color, d_rgb);
            T = vfloat16_mul(T, inverse[k]);
            weight[k] = vfloat16_mul(T, alpha[k]);
            if (spreads)
                color =
                    vfloat16_fma(spread, spread_row(&of_spread, weight[k], nearness(r[k].t, t_near)), color);
            const vfloat16 d_log = vfloat16_mul(weight[k], vfloat16_sub(color, behind));
            h[k] = vfloat16_select(vfloat16_lt(alpha[k], alpha_max),
                                   vfloat16_mul(vfloat16_set1(-0.5f), d_log), zero);
            behind = vfloat16_fma(one_minus_alpha[k], behind, vfloat16_mul(alpha[k], color));
        }
        for (size_t k = 0; k < TOGETHER && k < left; k++) {
            float *to = sums[number[k]].sum;
            if (g[k]->pair & PAIR_GENERAL)
                sum_general(scene, rays, g[k]->id, vfloat16_lt(zero, alpha[k]), h[k], weight[k], d_rgb, to);
            else
                add_sums(h[k], weight[k], v[k], d_rgb, to);
        }
    }
}

#endif
