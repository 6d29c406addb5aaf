/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_forward16.h -- the forward pass of one part of a tile over its list.

     every packet: [gather_rows] the Gaussians that reach into it, evaluated; those that some ray hits are
   rows
         --> [order_by_middle, insert_rows] T in front of every hit (list_rows16.h)
         --> [blend_list] colours, other outputs, the tape

   gather_rows() queues Gaussians until they are sixteen and evaluates these without a branch, four beside
   each other. It ends when all that is left lies behind where the rays became opaque. Included by
   list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_FORWARD16_H
#define GBT_TRACE_LIST_FORWARD16_H

#include "trace/list_rows16.h"
#include "trace/packet_extra16.h"

/* Gaussians that reach into a packet, waiting until there are sixteen. */
typedef struct row_queue {
    _Alignas(64) uint32_t number[3 * PACKET_LANES];
    unsigned count;
} row_queue;

/* What the rays of a packet still see. */
typedef struct ray_limits {
    vfloat16 far;     /* hits at this depth or behind are not seen */
    vfloat16 near;    /* hits nearer than this are not seen; 0 except for parts of rays */
    vfloat16 product; /* of 1 - alpha over all hits so far */
    vfloat16 reached; /* the farthest of them */
} ray_limits;

/* Appends a row if it has a hit. */
static inline void append_response(const packet_hits *rows, size_t *count, uint32_t number, row_response r,
                                   vfloat16 alpha_min, vfloat16 alpha_max, ray_limits *limits)
{
    const int at = (int)*count;
    const vfloat16 zero = vfloat16_set1(0);
    const vmask16 seen = vmask16_and(vfloat16_lt(r.t, limits->far), vfloat16_le(limits->near, r.t)),
                  hit = vmask16_and(vfloat16_le(alpha_min, r.raw), seen);
    const vfloat16 alpha = vfloat16_select(hit, vfloat16_min(r.raw, alpha_max), zero);
    row_store(rows->t, at, r.t);
    row_store(rows->alpha, at, alpha);
    limits->product = vfloat16_fnma(limits->product, alpha, limits->product);
    limits->reached = vfloat16_max(limits->reached, vfloat16_select(hit, r.t, zero));
    rows->number[at] = number;
    *count += vmask16_any(hit) != 0;
}

/* Local copies of `limits`, the rows and pointers tell the compiler what stores cannot change. */
static void evaluate_queue(const packet_pass *p, const tile_list *list, const row_queue *queue, unsigned take,
                           packet_hits *out, ray_limits *limits)
{
    const kernel_scene *scene = p->scene;
    const packet_rays *rays = p->rays;
    const vfloat16 a = vfloat16_load(p->slopes.a), b = vfloat16_load(p->slopes.b),
                   length = vfloat16_load(p->slopes.length),
                   alpha_min = vfloat16_set1(scene->settings.alpha_min),
                   alpha_max = vfloat16_set1(scene->settings.alpha_max);
    const packet_hits rows = *out;
    const tile_gaussian *gaussian = list->gaussian;
    ray_limits now = *limits;
    size_t count = rows.count;
    for (unsigned first = 0; first < take; first += TOGETHER) {
        const tile_gaussian *g[TOGETHER];
        row_response r[TOGETHER];
        for (unsigned k = 0; k < TOGETHER; k++)
            g[k] = &gaussian[queue->number[first + k < take ? first + k : take - 1]];
        respond_rows(scene, rays, g, a, b, length, r, NULL);
        for (unsigned k = 0; k < TOGETHER && first + k < take; k++)
            append_response(&rows, &count, queue->number[first + k], r[k], alpha_min, alpha_max, &now);
    }
    out->count = count;
    *limits = now;
}

/* All rows that rays of the packet may see, in list order. */
static PASS void gather_rows(const packet_pass *p, const tile_list *list, packet_hits *rows,
                             kernel_counters *counters)
{
    const packet_rays *rays = p->rays;
    const bool parts = p->parts;
    const vfloat16 opaque = vfloat16_set1(0.9999f * p->scene->settings.transmittance_min),
                   length = vfloat16_mul(vfloat16_load(p->slopes.length), vfloat16_set1(0.99999f)),
                   zero = vfloat16_set1(0);
    /* Rays that are not active see nothing. */
    ray_limits limits = {.far =
                             vfloat16_select(vmask16_from_bits(rays->active), vfloat16_load(rays->far), zero),
                         .near = parts ? vfloat16_load(rays->near) : zero,
                         .product = parts ? vfloat16_load(rays->T_front) : vfloat16_set1(1),
                         .reached = zero};
    row_queue queue = {.count = 0};
    rows->count = 0;
    for (size_t first = 0; first < list->count; first += 16) {
        const unsigned bits = gaussians_in_packet(list, first, &p->slopes);
        queue.count += vmask16_numbers(vmask16_from_bits(bits), (uint32_t)first, queue.number + queue.count);
        const bool last = first + 16 >= list->count;
        if (queue.count < 16 && !last)
            continue;
        const unsigned take = last ? queue.count : 16;
        evaluate_queue(p, list, &queue, take, rows, &limits);
        counters->tests += (uint64_t)take * PACKET_LANES;
        queue.count -= take;
        memcpy(queue.number, queue.number + 16, 16 * sizeof *queue.number);
        /* Hits behind an opaque ray's last hit are skipped, also with packet_order, which may put them in
           front of it; hits at its very depth, which may be 0, are not. */
        const vfloat16 behind =
            vfloat16_max(vfloat16_mul(limits.reached, vfloat16_set1(1.000001f)), vfloat16_set1(FLT_MIN));
        limits.far = vfloat16_select(vfloat16_lt(limits.product, opaque), vfloat16_min(limits.far, behind),
                                     limits.far);
        /* What still waits in the queue is of this sixteen: its bound holds; else that of the next one. */
        const float nearest = list->nearest[first / 16 + (queue.count == 0)];
        if (!vmask16_any(vfloat16_lt(vfloat16_mul(length, vfloat16_set1(nearest)), limits.far)))
            break;
    }
}

/* Writes into entries `begin` .. `end` of a packet past how many entries each row steps back. A row without
   an entry passes that on to the entry of the next row, which may then step back farther than it has to. */
static void write_steps_back(const packet_hits *rows, tape_entry *entries, size_t begin, size_t end)
{
    for (size_t k = 0; k < rows->back_count; k++) {
        const uint32_t at = rows->tape_index[rows->back[k].place];
        if (at == end)
            break;
        const uint32_t steps = at - rows->tape_index[rows->back[k].place - rows->back[k].steps];
        const uint32_t capped = steps < TAPE_SORTED ? steps : TAPE_SORTED;
        entries[at].packet = (uint16_t)((entries[at].packet & (TILE_PACKETS - 1)) | capped << TAPE_BACK);
    }
    for (size_t k = begin; k < end && rows->crowded; k++)
        entries[k].packet |= TAPE_SORTED << TAPE_BACK;
}

static PASS bool blend_list(const packet_pass *p, const tile_list *list, const packet_hits *from,
                            packet_output *out, hit_tape *tape, kernel_counters *counters)
{
    const kernel_scene *scene = p->scene;
    const packet_rays *rays = p->rays;
    const vfloat16 infinite = vfloat16_set1(INFINITY), zero = vfloat16_set1(0), one = vfloat16_set1(1),
                   stop_at = vfloat16_set1(scene->settings.transmittance_min);
    const vfloat16 start = p->parts ? vfloat16_load(rays->T_front) : one;
    const bool one_order = scene->settings.packet_order,
               spreads = one_order && tape != NULL && scene->settings.spread > 0;
    const vfloat16 t_near = vfloat16_set1(scene->settings.t_near);
    const uint16_t packet = (uint16_t)p->number;
    vfloat16 product = one /* of 1 - alpha over the rows so far */, lowest = start,
             rgb[3] = {zero, zero, zero}, near_sum = zero;
    const packet_hits copy = *from, *rows = &copy;
    uint64_t hits = 0, blended = 0;
    size_t entry_count = tape != NULL ? tape->count : 0;
    packet_extra extra;
    if (scene->extra)
        start_extra(&extra);
    if (tape != NULL &&
        mem_reserve((void **)&tape->entries, &tape->capacity, tape->count, tape->count + rows->count + 1,
                    sizeof *tape->entries, "hit tape", NULL) != GBT_OK)
        return false;
    tape_entry *entries = tape != NULL ? tape->entries : NULL;
    for (size_t i = 0; i < rows->count; i++) {
        const int row = (int)rows->order[i];
        const vfloat16 T_front = one_order ? product : row_load(rows->T_front, (int)i),
                       T = vfloat16_mul(start, T_front), alpha = row_load(rows->alpha, row),
                       next = vfloat16_fnma(T, alpha, T);
        const vmask16 hit = vfloat16_lt(zero, alpha), blend = vmask16_and(hit, vfloat16_le(stop_at, next));
        const vfloat16 weight = vfloat16_select(blend, vfloat16_mul(T, alpha), zero);
        const tile_gaussian *g = &list->gaussian[rows->number[row]];
        const unsigned bits = vmask16_bits(blend);
        product = vfloat16_fnma(product, alpha, product);
        lowest = vfloat16_min(lowest, vfloat16_select(blend, next, infinite));
        for (int c = 0; c < 3; c++)
            rgb[c] = vfloat16_fma(weight, vfloat16_set1(g->color[c]), rgb[c]);
        if (spreads)
            near_sum = vfloat16_fma(weight, nearness(row_load(rows->t, row), t_near), near_sum);
        if (scene->extra)
            note_row(&extra, rays, scene->records + (size_t)g->id * RECORD_FLOATS, g->id, blend, weight, next,
                     row_load(rows->t, row));
        hits += (uint64_t)__builtin_popcount(vmask16_bits(hit));
        blended += (uint64_t)__builtin_popcount(bits);
        if (tape != NULL) {
            rows->tape_index[i] = (uint32_t)entry_count;
            entries[entry_count] = (tape_entry){g->pair & ~PAIR_GENERAL, (uint16_t)bits, packet};
            entry_count += bits != 0;
        }
    }
    if (tape != NULL) {
        write_steps_back(from, tape->entries, tape->count, entry_count);
        tape->count = entry_count;
    }
    if (tape != NULL && one_order) {
        vfloat16_store(tape->sums + packet * PACKET_LANES, lowest);
        vfloat16_store(tape->sums + (TILE_PACKETS + packet) * PACKET_LANES, near_sum);
    }
    counters->hits += hits;
    counters->blended += blended;
    counters->rows += rows->count;
    counters->order_steps += rows->steps;
    counters->spilled_packets += rows->crowded;
    for (int c = 0; c < 3; c++)
        vfloat16_store(out->rgb[c], vfloat16_fma(lowest, vfloat16_load(rays->background[c]), rgb[c]));
    vfloat16_store(out->transmittance, lowest);
    out->ended = vmask16_bits(vfloat16_lt(vfloat16_mul(start, product), stop_at));
    if (scene->extra)
        store_extra(&extra, out);
    return true;
}

static bool forward_list(const kernel_scene *scene, const list_view *view, size_t part, const tile_rays *rays,
                         packet_output out[TILE_PACKETS], hit_tape *tape, list_scratch *scratch,
                         kernel_counters *counters)
{
    double middle[2];
    tile_list list;
    packet_hits rows;
    tile_middle(&view->part_boxes[part], middle);
    if (!load_list(scene, view, part, middle, scratch, &list) ||
        !reserve_rows_of_list(scratch, list.count, false, &rows))
        return false;
    if (tape != NULL && scene->settings.packet_order &&
        mem_reserve((void **)&tape->sums, &tape->sum_capacity, 0, 2 * TILE_PACKETS * PACKET_LANES,
                    sizeof *tape->sums, "hit tape", NULL) != GBT_OK)
        return false;
    counters->candidates += (uint64_t)list.count;
    for (int i = 0; i < TILE_PACKETS; i++) {
        packet_pass pass;
        if (rays->packet[i].active == 0)
            continue;
        counters->rays += (uint64_t)__builtin_popcount(rays->packet[i].active);
        start_pass(scene, part_frame(view, part), rays, i, middle, &pass);
        gather_rows(&pass, &list, &rows, counters);
        order_by_middle(scene, &list, &rows);
        if (!scene->settings.packet_order)
            insert_rows(&rows);
        if ((rows.crowded && !sort_rows_by_ray(&rows, scratch)) ||
            !blend_list(&pass, &list, &rows, &out[i], tape, counters))
            return false;
    }
    return true;
}

#endif
