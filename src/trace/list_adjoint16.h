/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_adjoint16.h -- the adjoint of one part of a tile over its list (docs/tracing.md, "The adjoint").

     tape --> [load_used] the Gaussians that were blended
     every packet: its entries --> [replay_list] rows evaluated again, T in front of every hit
         --> [collect_behind] from the last row to the first: what lies behind every hit
         --> [sum_rows] h and T alpha of every row, summed over the rays in a fixed tree
     sums of each Gaussian --> the slot of its pair --> [turn_sums] those of its record

   With packet_order, sum_in_order() does the whole of a packet instead. Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_ADJOINT16_H
#define GBT_TRACE_LIST_ADJOINT16_H

#include "trace/list_one_order16.h"

/* insert_row() when the tape says how far row i steps back, so that no branch depends on what it meets. Where
   row i has a hit in front of one of row j, last_passed[j] becomes i: collect_behind() has to go on from row
   j as far as that. */
static inline void insert_again(const packet_hits *rows, insertion *s, const tape_entry *entry, int i,
                                vfloat16 t, vfloat16 alpha)
{
    const int back = entry[i].packet >> TAPE_BACK, first = i - (back > 2 ? back : 2);
    near_row now = {.t = t, .alpha = alpha, .term = vfloat16_set1(0)};
    vfloat16 product = vfloat16_set1(1);
    row_store(rows->before, i, s->before);
    rows->last_passed[i] = (uint32_t)i + 2;
    pass_row(&now, &s->last, &product);
    pass_row(&now, &s->second, &product);
    s->crowded = s->crowded || back == TAPE_SORTED;
    for (int j = i - 3; j >= first && !s->crowded; j--) {
        const vmask16 front = vfloat16_lt(t, row_load(rows->t, j));
        row_store(rows->T_front, j, vfloat16_less_where(front, row_load(rows->T_front, j), alpha));
        product = vfloat16_less_unless(front, product, row_load(rows->alpha, j));
        const unsigned met = vmask16_bits(front) & entry[i].lanes & entry[j].lanes;
        rows->last_passed[j] = met ? (uint32_t)i : rows->last_passed[j];
    }
    now.value = vfloat16_mul(row_load(rows->before, s->crowded ? i : first), product);
    row_store(rows->T_front, i - 2, s->second.value);
    s->second = s->last;
    s->last = now;
    s->before = vfloat16_fnma(s->before, alpha, s->before);
}

/* Evaluate the rows of a packet again, in the order of the tape, and find T of all of them. */
static PASS void replay_list(const packet_pass *p, const used_list *used, const tape_entry *entry,
                             size_t count, packet_hits *out)
{
    const kernel_scene *scene = p->scene;
    const packet_rays *rays = p->rays;
    out->count = count;
    const packet_hits rows = *out; /* a copy: stores cannot change it */
    const tile_gaussian *used_gaussian = used->gaussian;
    const uint32_t *used_number = used->number;
    const vfloat16 a = vfloat16_load(p->slopes.a), b = vfloat16_load(p->slopes.b),
                   length = vfloat16_load(p->slopes.length),
                   alpha_max = vfloat16_set1(scene->settings.alpha_max);
    insertion s = start_insertion(&rows);
    for (size_t first = 0; first < count; first += TOGETHER) {
        const tile_gaussian *g[TOGETHER];
        row_response r[TOGETHER];
        uint32_t number[TOGETHER];
        for (size_t k = 0; k < TOGETHER; k++) {
            number[k] = used_number[entry[first + k < count ? first + k : first].id];
            g[k] = &used_gaussian[number[k]];
        }
        respond_rows(scene, rays, g, a, b, length, r, NULL);
        for (size_t k = 0; k < TOGETHER && first + k < count; k++) {
            const int i = (int)(first + k);
            const vfloat16 alpha = vfloat16_select(vmask16_from_bits(entry[i].lanes),
                                                   vfloat16_min(r[k].raw, alpha_max), vfloat16_set1(0));
            row_store(rows.alpha, i, alpha);
            row_store(rows.inverse, i, r[k].inverse);
            rows.number[i] = number[k];
            row_store(rows.t, i, r[k].t);
            rows.order[i] = (uint32_t)i;
            insert_again(&rows, &s, entry, i, r[k].t, alpha);
        }
    }
    end_insertion(out, &s);
}

/* The new row passes `other`, which comes later in the order: on every ray the term of the one behind is
   added to the sum of the one in front. */
static inline void pass_on(const near_row *now, near_row *other, vfloat16 *sum)
{
    const vmask16 behind = vfloat16_lt(other->t, now->t);
    other->value = vfloat16_add_where(behind, other->value, now->term);
    *sum = vfloat16_add_unless(behind, *sum, other->term);
}

/* What lies behind every hit, g . (sum of T alpha c), with the background: the mirror image of the insertion,
   from the last row to the first. The array `before` is used again, for the sum of the terms of a row and
   those after it. Sums are only ever added to, so nothing cancels. False when it takes too many steps: `term`
   and `behind` must then be found ray by ray. */
static PASS bool collect_behind(packet_hits *out, const used_list *used, const vfloat16 d_rgb[3],
                                vfloat16 background)
{
    const packet_hits copy = *out, *const rows = &copy; /* a copy: stores cannot change it */
    const vfloat16 zero = vfloat16_set1(0);
    const tile_gaussian *used_gaussian = used->gaussian;
    const vfloat16 direction[3] = {d_rgb[0], d_rgb[1], d_rgb[2]};
    const int count = (int)rows->count;
    near_row next = {vfloat16_set1(INFINITY), zero, zero, zero}, second = next;
    vfloat16 after = background;
    size_t steps = 0;
    for (int i = count; i < count + 3; i++)
        row_store(rows->before, i, background);
    for (int i = count; i-- > 0;) {
        const int last = (int)rows->last_passed[i];
        near_row now = {.t = row_load(rows->t, i), .alpha = zero};
        now.term = vfloat16_mul(vfloat16_mul(row_load(rows->T_front, i), row_load(rows->alpha, i)),
                                dot_lanes(used_gaussian[rows->number[i]].color, direction));
        vfloat16 sum = zero;
        row_store(rows->term, i, now.term);
        pass_on(&now, &next, &sum);
        pass_on(&now, &second, &sum);
        steps += (size_t)(last - (i + 2));
        if (steps > STEPS_PER_ROW * (size_t)(count - i) + STEPS_FREE)
            return false;
        for (int j = i + 3; j <= last; j++) {
            const vmask16 behind = vfloat16_lt(row_load(rows->t, j), now.t);
            sum = vfloat16_add_unless(behind, sum, row_load(rows->term, j));
            row_store(rows->behind, j, vfloat16_add_where(behind, row_load(rows->behind, j), now.term));
        }
        now.value = vfloat16_add(row_load(rows->before, last + 1), sum);
        row_store(rows->behind, i + 2, second.value);
        second = next;
        next = now;
        after = vfloat16_add(after, now.term);
        row_store(rows->before, i, after);
    }
    row_store(rows->behind, 1, second.value);
    row_store(rows->behind, 0, next.value);
    out->steps = steps;
    return true;
}

/* collect_behind() ray by ray. False when memory ran out. */
static bool collect_behind_by_ray(packet_hits *rows, const used_list *used, const vfloat16 d_rgb[3],
                                  vfloat16 background, list_scratch *scratch)
{
    _Alignas(64) float last[PACKET_LANES];
    vfloat16_store(last, background);
    for (int i = 0; i < (int)rows->count; i++) {
        row_store(rows->term, i,
                  vfloat16_mul(vfloat16_mul(row_load(rows->T_front, i), row_load(rows->alpha, i)),
                               dot_lanes(used->gaussian[rows->number[i]].color, d_rgb)));
        row_store(rows->behind, i, vfloat16_set1(0)); /* read also on rays that this row does not hit */
    }
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        size_t count;
        const ray_hit *hits = sort_lane(rows, lane, scratch, &count);
        float behind = last[lane];
        if (hits == NULL)
            return false;
        for (size_t k = count; k-- > 0;) {
            const size_t at = (size_t)(uint32_t)hits[k].key * PACKET_LANES + (size_t)lane;
            rows->behind[at] = behind;
            behind += rows->term[at];
        }
    }
    return true;
}

/* h = dL/d(d2) = -alpha dL/dalpha / 2 of a row, where alpha dL/dalpha = term - behind alpha / (1 - alpha);
   and the weight T alpha. Where alpha = min(alpha_max, o G) is capped, only the colour has a gradient. */
static inline void row_gradients(const packet_hits *rows, int i, vfloat16 alpha_max, vfloat16 *h,
                                 vfloat16 *weight)
{
    const vfloat16 alpha = row_load(rows->alpha, i),
                   share = vfloat16_div(alpha, vfloat16_sub(vfloat16_set1(1), alpha));
    const vfloat16 d_log = vfloat16_fnma(share, row_load(rows->behind, i), row_load(rows->term, i));
    *h = vfloat16_select(vfloat16_lt(alpha, alpha_max), vfloat16_mul(vfloat16_set1(-0.5f), d_log),
                         vfloat16_set1(0));
    *weight = vfloat16_mul(row_load(rows->T_front, i), alpha);
}

/* Adds the sums of all rows. v = R / den (-y, w1 w2, w1 w3) (view_form16.h); the factor R and the sign of the
   first component are left to turn_sums(), which applies them once per record. */
static PASS void sum_rows(const packet_pass *p, const used_list *used, const vfloat16 direction[3],
                          const packet_hits *from, gradient_slot *sums)
{
    const kernel_scene *scene = p->scene;
    const packet_rays *rays = p->rays;
    const packet_hits copy = *from, *const rows = &copy; /* a copy: stores cannot change it */
    const tile_gaussian *used_gaussian = used->gaussian;
    const vfloat16 one = vfloat16_set1(1), zero = vfloat16_set1(0), a = vfloat16_load(p->slopes.a),
                   b = vfloat16_load(p->slopes.b), alpha_max = vfloat16_set1(scene->settings.alpha_max),
                   d_rgb[3] = {direction[0], direction[1], direction[2]};
    for (int first = 0; first < (int)rows->count; first += TOGETHER) {
        const tile_gaussian *g[TOGETHER];
        vfloat16 h[TOGETHER], weight[TOGETHER], v[TOGETHER][3];
        for (int k = 0; k < TOGETHER; k++) {
            const int i = first + k < (int)rows->count ? first + k : first;
            g[k] = &used_gaussian[rows->number[i]];
            row_gradients(rows, i, alpha_max, &h[k], &weight[k]);
        }
        for (int k = 0; k < TOGETHER; k++) {
            const vfloat16 inverse = row_load(rows->inverse, first + k);
            const vfloat16 da = vfloat16_sub(a, vfloat16_set1(g[k]->a)),
                           db = vfloat16_sub(b, vfloat16_set1(g[k]->b));
            const vfloat16 w1 = vfloat16_fma(vfloat16_set1(g[k]->q[0]), da,
                                             vfloat16_fma(vfloat16_set1(g[k]->q[1]), db, one)),
                           w2 = vfloat16_fma(vfloat16_set1(g[k]->q[2]), da,
                                             vfloat16_mul(vfloat16_set1(g[k]->q[3]), db)),
                           w3 = vfloat16_mul(vfloat16_set1(g[k]->q[4]), db);
            const vfloat16 y = vfloat16_fma(w2, w2, vfloat16_mul(w3, w3)), along = vfloat16_mul(w1, inverse);
            v[k][0] = vfloat16_mul(y, inverse);
            v[k][1] = vfloat16_mul(along, w2);
            v[k][2] = vfloat16_mul(along, w3);
        }
        for (int k = 0; k < TOGETHER && first + k < (int)rows->count; k++) {
            float *to = sums[rows->number[first + k]].sum;
            if (g[k]->pair & PAIR_GENERAL)
                sum_general(scene, rays, g[k]->id, vfloat16_lt(zero, row_load(rows->alpha, first + k)), h[k],
                            weight[k], d_rgb, to);
            else
                add_sums(h[k], weight[k], v[k], d_rgb, to);
        }
    }
}

static bool adjoint_of_packet(const packet_pass *p, const used_list *used, const hit_tape *tape, size_t from,
                              size_t count, float d_rgb_in[3][PACKET_LANES], packet_hits *rows,
                              list_scratch *scratch)
{
    vfloat16 d_rgb[3], behind_all[3];
    for (int c = 0; c < 3; c++) {
        d_rgb[c] = vfloat16_load(d_rgb_in[c]);
        behind_all[c] = vfloat16_load(p->rays->background[c]);
    }
    const tape_entry *entry = tape->entries + from;
    if (p->scene->settings.packet_order) {
        const float *sums = tape->sums + p->number * PACKET_LANES;
        sum_in_order(p, used, entry, count, vfloat16_load(sums),
                     vfloat16_load(sums + TILE_PACKETS * PACKET_LANES), dot16(behind_all, d_rgb), d_rgb,
                     scratch->sums);
        return true;
    }
    replay_list(p, used, entry, count, rows);
    if (rows->crowded && !sort_rows_by_ray(rows, scratch))
        return false;
    const vfloat16 background = vfloat16_mul(dot16(behind_all, d_rgb), rows->product);
    if ((rows->crowded || !collect_behind(rows, used, d_rgb, background)) &&
        !collect_behind_by_ray(rows, used, d_rgb, background, scratch))
        return false;
    sum_rows(p, used, d_rgb, rows, scratch->sums);
    return true;
}

static bool backward_list(const kernel_scene *scene, list_view *view, size_t part, const tile_rays *rays,
                          float d_rgb[TILE_PACKETS][3][PACKET_LANES], const hit_tape *tape,
                          list_scratch *scratch)
{
    const size_t begin = view->first[part], pairs = view->first[part + 1] - begin;
    double middle[2];
    used_list used;
    packet_hits rows;
    tile_middle(&view->part_boxes[part], middle);
    if (!load_used(view, part, middle, tape, scratch, &used) ||
        !reserve_rows_of_list(scratch, used.count, true, &rows))
        return false;
    size_t at = 0;
    for (int i = 0; i < TILE_PACKETS; i++) {
        const size_t from = at;
        packet_pass pass;
        if (rays->packet[i].active == 0)
            continue;
        while (at < tape->count && (tape->entries[at].packet & (TILE_PACKETS - 1)) == i)
            at++;
        start_pass(scene, part_frame(view, part), rays, i, middle, &pass);
        if (!adjoint_of_packet(&pass, &used, tape, from, at - from, d_rgb[i], &rows, scratch))
            return false;
    }
    for (size_t i = 0; i < pairs; i++) {
        if (i + AHEAD < pairs)
            __builtin_prefetch(&view->slots[view->pairs[begin + i + AHEAD].slot], 1);
        const uint32_t slot = view->pairs[begin + i].slot;
        view->slot_used[slot] = used.number[i] != UINT32_MAX;
        if (view->slot_used[slot])
            view->slots[slot] = scratch->sums[used.number[i]];
    }
    return true;
}

#endif
