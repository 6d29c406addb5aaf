/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel.inc.h -- a tile of neighbouring packets through the tree: gather, cull, evaluate, blend.
   Compiled once per instruction set.

     heap of nodes by a lower bound of t --> nearest
         --> inner node: its children that meet the tile, back to the heap
         --> leaf: its ellipsoids that reach into the tile become candidates, which wait until nothing
                   nearer can still come
     candidates --> every packet evaluates those that reach into its beam, one row each
                --> blends the rows before the horizon (tree_rows16.h)

   The horizon is the nearest bound of what is left in the heap or waiting: nothing can still come before it.
   A packet stops when all of its rays are opaque; one that needs more rows than there are goes ray by ray
   (tree_ray16.h).

   Wanted before inclusion: KERNEL_NAME, the name of the exported tree_kernel. */

#include "trace/embree16.h"
#include "trace/gaussian16.h"
#include "trace/tree_adjoint16.h"
#include "trace/tree_beam16.h"
#include "trace/tree_heap.h"
#include "trace/tree_kernel.h"
#include "trace/tree_ray16.h"
#include "trace/tree_rows16.h"
#include "trace/tree_view16.h"

enum {
    CHUNK_TARGET = 64, /* new candidates that are gathered before the packets take them */
    CANDIDATE_CAPACITY = 512,
    CHUNK_CAPACITY = 128, /* candidates that the packets take at once */
    HEAP_CAPACITY = 1024
};

/* ---- a packet ---- */

static void start_packet(packet_rows *p, const packet_rays *rays)
{
    start_extra(&p->extra);
    p->far = vfloat16_load(rays->far);
    p->count = 0;
    p->transmittance = vfloat16_set1(1);
    for (int c = 0; c < 3; c++)
        p->rgb[c] = vfloat16_set1(0);
    p->alive = vmask16_from_bits(rays->active);
}

static inline void append_row(packet_rows *p, uint32_t id, vfloat16 t, vfloat16 raw,
                              const trace_settings *settings, kernel_counters *counters)
{
    const vmask16 hit = vmask16_and(
        vmask16_and(vfloat16_le(vfloat16_set1(settings->alpha_min), raw), vfloat16_lt(t, p->far)), p->alive);
    row_store(p->t, p->count, vfloat16_select(hit, t, vfloat16_set1(INFINITY)));
    row_store(p->alpha, p->count,
              vfloat16_select(hit, vfloat16_min(raw, vfloat16_set1(settings->alpha_max)), vfloat16_set1(0)));
    p->id[p->count] = id;
    p->blended[p->count] = 0;
    const unsigned bits = vmask16_bits(hit);
    p->count += bits != 0;
    counters->tests += PACKET_LANES;
    counters->hits += (uint64_t)__builtin_popcount(bits);
}

/* The hits of a row at or behind the horizon, on rays that are still alive. */
static inline vmask16 row_remains(const packet_rows *p, int row, float horizon)
{
    const vfloat16 t = row_load(p->t, row);
    return vmask16_and(
        vmask16_and(vfloat16_le(vfloat16_set1(horizon), t), vfloat16_lt(t, vfloat16_set1(INFINITY))),
        p->alive);
}

static bool close_row(const packet_rows *p, int row, int packet, hit_tape *tape, kernel_counters *counters)
{
    counters->blended += (uint64_t)__builtin_popcount(p->blended[row]);
    return tape == NULL || p->blended[row] == 0 ||
           tape_add(tape, (tape_entry){p->id[row], p->blended[row], (uint16_t)packet});
}

/* Writes the rows that are done to the tape, nearly in order, and keeps the others. A row without hits before
   the horizon is done, too, if an earlier round blended a part of it and the rays of its other hits have
   become opaque since. */
static bool close_rows(packet_rows *p, int packet, float horizon, const round_rows *o, hit_tape *tape,
                       kernel_counters *counters)
{
    const bool all_done = !vmask16_any(p->alive);
    for (int i = 0; i < o->sorted.count; i++) {
        const int row = o->row[i];
        if (!all_done && o->row_far[row] >= horizon && vmask16_any(row_remains(p, row, horizon)))
            continue;
        if (!close_row(p, row, packet, tape, counters))
            return false;
    }
    int kept = 0;
    for (int i = 0; i < p->count; i++) {
        if (o->row_far[i] < horizon)
            continue;
        const vmask16 remains = row_remains(p, i, horizon);
        if (!vmask16_any(remains)) {
            if (o->row_near[i] >= horizon && !close_row(p, i, packet, tape, counters))
                return false;
            continue;
        }
        row_store(p->t, kept, vfloat16_select(remains, row_load(p->t, i), vfloat16_set1(INFINITY)));
        row_store(p->alpha, kept, vfloat16_select(remains, row_load(p->alpha, i), vfloat16_set1(0)));
        p->id[kept] = p->id[i];
        p->blended[kept++] = p->blended[i];
    }
    p->count = kept;
    return true;
}

/* Blend all hits nearer than `horizon`; keep the rest. */
static bool blend_rows(packet_rows *p, int packet, const kernel_scene *scene, const packet_rays *rays,
                       float horizon, hit_tape *tape, round_rows *o, kernel_counters *counters)
{
    if (p->count == 0 || row_depths(p->t, p->count, o->row_near, o->row_far) >= horizon)
        return true;
    order_rows(p, horizon, o);
    arrange_rows(p, horizon, o);
    const int count = o->sorted.count;
    counters->rows += (uint64_t)count;
    const vfloat16 infinite = vfloat16_set1(INFINITY), zero = vfloat16_set1(0),
                   stop_at = vfloat16_set1(scene->settings.transmittance_min);
    vfloat16 lowest = p->transmittance;
    vmask16 stopped = vmask16_from_bits(0);
    row_window window = {0};
    for (int first = 0; first < count; first += ROW_BLOCK) {
        vfloat16 T[ROW_BLOCK];
        move_window(&o->sorted, first, &window);
        window_transmittance(&o->sorted, first, &window, T);
        counters->order_steps += (uint64_t)((window.high - window.low) * ROW_BLOCK);
        for (int k = 0; k < ROW_BLOCK && first + k < count; k++) {
            const int row = o->row[first + k];
            const vfloat16 next = vfloat16_mul(T[k], row_load(o->one_minus_alpha, first + k));
            const vmask16 hit = vmask16_and(vfloat16_lt(row_load(o->t, first + k), infinite), p->alive);
            const vmask16 stop = vmask16_and(hit, vfloat16_lt(next, stop_at)),
                          blend = vmask16_andnot(stop, hit);
            const vfloat16 weight = vfloat16_select(blend, vfloat16_mul(T[k], row_load(p->alpha, row)), zero);
            stopped = vmask16_or(stopped, stop);
            lowest = vfloat16_min(lowest, vfloat16_select(blend, next, infinite));
            const float *color = scene->records + (size_t)p->id[row] * RECORD_FLOATS + RECORD_COLOR;
            for (int c = 0; c < 3; c++)
                p->rgb[c] = vfloat16_fma(weight, vfloat16_set1(color[c]), p->rgb[c]);
            if (scene->extra)
                note_row(&p->extra, rays, color - RECORD_COLOR, p->id[row], blend, weight, next,
                         row_load(o->t, first + k));
            p->blended[row] = (uint16_t)(p->blended[row] | vmask16_bits(blend));
        }
    }
    p->transmittance = lowest;
    p->alive = vmask16_andnot(stopped, p->alive);
    return close_rows(p, packet, horizon, o, tape, counters);
}

/* ---- forward ---- */

/* A Gaussian that reaches into the tile. It waits until nothing nearer than its nearest point can still
   come. */
typedef struct candidate {
    float nearest, bound[8];
    uint32_t id;
    bool in_front;
} candidate;

typedef struct tile_state {
    packet_rows packet[TILE_PACKETS];
    round_rows order;
    view_rays view_rays[TILE_PACKETS];
    view_gaussians view[CHUNK_CAPACITY / 16];
    tile_beam beam;
    bool common_origin;
    unsigned alive_packets, spilled_packets;
    candidate waiting[CANDIDATE_CAPACITY];
    int waiting_count;
    /* the candidates that the packets are taking */
    _Alignas(64) float nearest[CHUNK_CAPACITY];
    _Alignas(64) float bound[8][CHUNK_CAPACITY]; /* slopes, or centre and covariance in the tile's frame */
    uint32_t id[CHUNK_CAPACITY];
    uint16_t in_front[CHUNK_CAPACITY / 16]; /* bit per candidate that view_form16.h may evaluate */
    int count;
    heap_entry heap[HEAP_CAPACITY];
    int heap_count;
} tile_state;

static inline vmask16 slopes_meet(const packet_beam *b, const vfloat16 slope[4])
{
    const vmask16 u = vmask16_and(vfloat16_le(slope[0], vfloat16_set1(b->slope[1])),
                                  vfloat16_le(vfloat16_set1(b->slope[0]), slope[1]));
    const vmask16 v = vmask16_and(vfloat16_le(slope[2], vfloat16_set1(b->slope[3])),
                                  vfloat16_le(vfloat16_set1(b->slope[2]), slope[3]));
    return vmask16_and(u, v);
}

/* The Gaussians of a leaf that reach into the tile become candidates. */
static inline void take_leaf(tile_state *s, const kernel_scene *scene, const tree_leaf *leaf)
{
    const unsigned filled = 0xFFFFu >> (TREE_WIDTH - leaf->count);
    ellipsoids16 e;
    _Alignas(64) float bound[8][16], nearest[16];
    turn_ellipsoids(leaf, &s->beam, &e);
    vfloat16_store(nearest, ellipsoid_nearest(&e, &s->beam, scene->settings.t_near));
    unsigned inside, front = 0;
    if (s->common_origin) {
        vfloat16 slope[4];
        /* 1.001: no hit is so near that rounding could cut it at t_near; 2^-20: as in make_beam() */
        front = vmask16_bits(ellipsoid_slopes(&e, 1.001f * scene->settings.t_near,
                                              0x1p-20f * scene->coordinate_max, slope)) &
                filled;
        inside = vmask16_bits(slopes_meet(&s->beam.whole, slope)) & front;
        if (front != filled)
            inside |= test_ellipsoids(&s->beam.whole, &e) & filled & ~front;
        const vmask16 known = vmask16_from_bits(front);
        for (int k = 0; k < 4; k++)
            vfloat16_store(
                bound[k], vfloat16_select(known, slope[k], vfloat16_set1(k % 2 == 0 ? -INFINITY : INFINITY)));
    } else {
        inside = test_ellipsoids(&s->beam.whole, &e) & filled;
        const vfloat16 *field = (const vfloat16 *)&e;
        for (int k = 0; k < 8; k++)
            vfloat16_store(bound[k], field[k]);
    }
    for (; inside != 0; inside &= inside - 1) {
        const int i = __builtin_ctz(inside);
        candidate *c = &s->waiting[s->waiting_count++];
        __builtin_prefetch(scene->records + (size_t)leaf->id[i] * RECORD_FLOATS);
        c->nearest = nearest[i];
        c->id = leaf->id[i];
        c->in_front = (front >> i & 1) != 0;
        for (int k = 0; k < 8; k++)
            c->bound[k] = bound[k][i];
    }
}

/* Moves waiting candidates that may lie before the horizon (all, when the waiting ones take too much room) to
   those that the packets take next, nearest first. */
static void pick_candidates(tile_state *s, float horizon)
{
    int waiting = 0, i = 0, n = 0;
    const bool crowded = s->waiting_count > CANDIDATE_CAPACITY / 2;
    candidate copy[CHUNK_CAPACITY];
    uint16_t order[CHUNK_CAPACITY];
    for (; i < s->waiting_count && n < CHUNK_CAPACITY; i++)
        if (crowded || s->waiting[i].nearest <= horizon) {
            copy[n] = s->waiting[i];
            s->nearest[n] = copy[n].nearest;
            n++;
        } else
            s->waiting[waiting++] = s->waiting[i];
    memmove(s->waiting + waiting, s->waiting + i, (size_t)(s->waiting_count - i) * sizeof *s->waiting);
    s->waiting_count += waiting - i;
    s->count = n;
    rank_keys(s->nearest, n, order);
    memset(s->in_front, 0, sizeof s->in_front);
    for (i = 0; i < n; i++) {
        const candidate *c = &copy[order[i]];
        s->nearest[i] = c->nearest;
        for (int k = 0; k < 8; k++)
            s->bound[k][i] = c->bound[k];
        s->id[i] = c->id;
        s->in_front[i / 16] |= (uint16_t)((unsigned)c->in_front << i % 16);
    }
}

/* Which of sixteen candidates reach into a packet's beam. */
static inline unsigned packet_candidates(const tile_state *s, int packet, int first)
{
    vfloat16 bound[8];
    for (int k = 0; k < (s->common_origin ? 4 : 8); k++)
        bound[k] = vfloat16_load(s->bound[k] + first);
    const unsigned filled = s->count - first >= 16 ? 0xFFFFu : 0xFFFFu >> (16 - (s->count - first));
    if (s->common_origin)
        return vmask16_bits(slopes_meet(&s->beam.packet[packet], bound)) & filled;
    return test_ellipsoids(&s->beam.packet[packet], (const ellipsoids16 *)bound) & filled;
}

static inline void evaluate(tile_state *s, const kernel_scene *scene, const packet_rays *rays, int packet,
                            int number, kernel_counters *counters)
{
    const uint32_t id = s->id[number];
    packet_rows *rows = &s->packet[packet];
    if (s->in_front[number / 16] >> number % 16 & 1) {
        const view_gaussians *view = &s->view[number / 16];
        const view_response r = view_respond(view, number % 16, &s->view_rays[packet]);
        append_row(rows, id, r.t, view_alpha(view, number % 16, r.exponent), &scene->settings, counters);
        return;
    }
    const gaussian_lanes g = broadcast_gaussian(scene->records + (size_t)id * RECORD_FLOATS);
    ray_lanes ray;
    load_rays(rays, &ray);
    const response r = respond(&g, &ray, vfloat16_set1(scene->settings.t_near));
    append_row(rows, id, r.t, response_alpha(&g, r.d2), &scene->settings, counters);
}

/* Every live packet evaluates the candidates that reach into its beam and blends what lies before `horizon`.
   A packet whose rows do not fit is given up here. */
static bool take_chunk(tile_state *s, const kernel_scene *scene, const tile_rays *rays, float horizon,
                       hit_tape *tape, kernel_counters *counters)
{
    for (int first = 0; s->common_origin && first < s->count; first += 16) {
        uint32_t id[16];
        for (int i = 0; i < 16; i++)
            id[i] = s->id[first + i < s->count ? first + i : first];
        const gaussian_lanes g = load_gaussians(scene, id, NULL);
        const vmask16 sound = view_gaussians_from(&g, &s->beam, &s->view[first / 16], NULL);
        s->in_front[first / 16] &= (uint16_t)vmask16_bits(sound);
    }
    for (unsigned packets = s->alive_packets; packets != 0; packets &= packets - 1) {
        const int p = __builtin_ctz(packets);
        packet_rows *rows = &s->packet[p];
        int first = 0;
        for (; first < s->count; first += 16) {
            /* No room for sixteen more: blend the hits that no remaining candidate can come before. */
            if (rows->count > ROW_CAPACITY - 16 &&
                !blend_rows(rows, p, scene, &rays->packet[p], smaller(horizon, s->nearest[first]), tape,
                            &s->order, counters))
                return false;
            if (rows->count > ROW_CAPACITY - 16 || !vmask16_any(rows->alive))
                break;
            for (unsigned bits = packet_candidates(s, p, first); bits != 0; bits &= bits - 1)
                evaluate(s, scene, &rays->packet[p], p, first + __builtin_ctz(bits), counters);
        }
        const bool no_room = first < s->count && vmask16_any(rows->alive);
        if (no_room)
            s->spilled_packets |= 1u << p;
        else if (!blend_rows(rows, p, scene, &rays->packet[p], horizon, tape, &s->order, counters))
            return false;
        if (no_room || !vmask16_any(rows->alive))
            s->alive_packets &= ~(1u << p);
    }
    counters->candidates += (uint64_t)s->count;
    s->count = 0;
    return true;
}

/* A node or a leaf is a dozen cache lines. */
static inline void prefetch_child(uint64_t child)
{
    const char *at = (const char *)(uintptr_t)(child & ~(uint64_t)1);
    for (size_t line = 0; line < sizeof(tree_leaf); line += 64)
        __builtin_prefetch(at + line);
}

static bool gather_tile(tile_state *s, const kernel_scene *scene, const tile_rays *rays, hit_tape *tape,
                        kernel_counters *counters)
{
    int new_count = 0;
    s->heap_count = s->waiting_count = 0;
    heap_push(s->heap, &s->heap_count, 0, (uint64_t)(uintptr_t)scene->root);
    while (s->heap_count > 0 || s->waiting_count > 0) {
        if (s->heap_count > 0) {
            const uint64_t child = heap_pop(s->heap, &s->heap_count);
            const tree_leaf *leaf = tree_child_leaf(child);
            for (int i = 0; i < 3 && i < s->heap_count; i++)
                prefetch_child(s->heap[i].child); /* the next to be popped is most likely one of these */
            counters->nodes++;
            if (leaf == NULL) {
                const tree_node *node = (const tree_node *)(uintptr_t)child;
                _Alignas(64) float entry[TREE_WIDTH];
                for (unsigned bits = test_children(&s->beam, node, scene->settings.t_near, entry); bits != 0;
                     bits &= bits - 1)
                    heap_push(s->heap, &s->heap_count, entry[__builtin_ctz(bits)],
                              node->child[__builtin_ctz(bits)]);
            } else {
                const int before = s->waiting_count;
                take_leaf(s, scene, leaf);
                new_count += s->waiting_count - before;
            }
            if (s->heap_count > HEAP_CAPACITY - TREE_WIDTH) { /* a node adds at most TREE_WIDTH */
                s->spilled_packets |= s->alive_packets;
                return true;
            }
            if (new_count < CHUNK_TARGET && s->heap_count > 0)
                continue;
        }
        const float next_node = s->heap_count > 0 ? s->heap[0].t : INFINITY;
        pick_candidates(s, next_node);
        float horizon = next_node;
        for (int i = 0; i < s->waiting_count; i++)
            horizon = smaller(horizon, s->waiting[i].nearest);
        if (!take_chunk(s, scene, rays, horizon, tape, counters))
            return false;
        if (s->alive_packets == 0)
            return true;
        new_count = 0;
    }
    return true;
}

/* Stores the results of the packets in `done`; the other packets are traced ray by ray. */
static bool finish_tile(const kernel_scene *scene, const tile_rays *rays, const tile_state *s, unsigned done,
                        packet_output out[TILE_PACKETS], hit_tape *tape, tree_scratch *scratch,
                        kernel_counters *counters)
{
    for (int p = 0; p < TILE_PACKETS; p++) {
        if (done >> p & 1) {
            for (int c = 0; c < 3; c++)
                vfloat16_store(out[p].rgb[c], vfloat16_fma(s->packet[p].transmittance,
                                                           vfloat16_load(rays->packet[p].background[c]),
                                                           s->packet[p].rgb[c]));
            vfloat16_store(out[p].transmittance, s->packet[p].transmittance);
            store_extra(&s->packet[p].extra, &out[p]);
            continue;
        }
        counters->spilled_packets += rays->packet[p].active != 0;
        for (unsigned bits = rays->packet[p].active; bits != 0; bits &= bits - 1)
            if (!trace_ray(scene, &rays->packet[p], (unsigned)p, __builtin_ctz(bits), &out[p], tape, scratch,
                           counters))
                return false;
    }
    return tape == NULL || tape_add(tape, (tape_entry){0, 0, TAPE_END});
}

static bool forward(const kernel_scene *scene, const tile_rays *rays, packet_output out[TILE_PACKETS],
                    hit_tape *tape, tree_scratch *scratch, kernel_counters *counters)
{
    tile_state s;
    unsigned packets = 0;
    s.common_origin = rays->common_origin;
    for (int p = 0; p < TILE_PACKETS; p++)
        if (rays->packet[p].active != 0) {
            packets |= 1u << p;
            start_packet(&s.packet[p], &rays->packet[p]);
            counters->rays += (uint64_t)__builtin_popcount(rays->packet[p].active);
        }
    s.alive_packets = packets;
    s.spilled_packets = 0;
    if (scene->root != NULL && packets != 0) {
        if (make_beam(rays->packet, scene, &s.beam)) {
            for (int p = 0; p < TILE_PACKETS && s.common_origin; p++)
                if (packets >> p & 1)
                    s.view_rays[p] = see_rays(&rays->packet[p], &s.beam);
            if (!gather_tile(&s, scene, rays, tape, counters))
                return false;
        } else {
            s.spilled_packets = packets;
        }
    }
    return finish_tile(scene, rays, &s, packets & ~s.spilled_packets, out, tape, scratch, counters);
}

static bool forward_single(const kernel_scene *scene, const tile_rays *rays, packet_output out[TILE_PACKETS],
                           hit_tape *tape, tree_scratch *scratch, kernel_counters *counters)
{
    for (unsigned p = 0; p < TILE_PACKETS; p++)
        for (unsigned bits = rays->packet[p].active; bits != 0; bits &= bits - 1, counters->rays++)
            if (!trace_ray(scene, &rays->packet[p], p, __builtin_ctz(bits), &out[p], tape, scratch, counters))
                return false;
    return tape == NULL || tape_add(tape, (tape_entry){0, 0, TAPE_END});
}

static bool forward_embree(const kernel_scene *scene, const tile_rays *rays, packet_output out[TILE_PACKETS],
                           hit_tape *tape, tree_scratch *scratch, kernel_counters *counters)
{
    for (unsigned p = 0; p < TILE_PACKETS; p++) {
        counters->rays += (uint64_t)__builtin_popcount(rays->packet[p].active);
        if (rays->packet[p].active != 0 &&
            !embree_packet(scene, &rays->packet[p], p, &out[p], tape, scratch, counters))
            return false;
    }
    return tape == NULL || tape_add(tape, (tape_entry){0, 0, TAPE_END});
}

const tree_kernel KERNEL_NAME = {forward, forward_single, forward_embree, backward};
