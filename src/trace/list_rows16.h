/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_rows16.h -- T in front of every hit of a packet, in the exact order of every ray, by insertion.

   A row is one Gaussian on the sixteen rays of a packet. Rows are sorted once, by their depth on a ray in the
   middle; on other rays the order may differ. On every ray T in front of a hit is the product of 1 - alpha
   over the hits before it. Row i steps back over the rows before it while some ray has a hit there that lies
   behind its own. In each step, on each ray: if the other hit lies behind, its T is multiplied by 1 - alpha
   of row i; if it lies in front, 1 - alpha of the other goes into a product. T of row i is that product times
   the running product over all rows before the last one passed. So T is exact on every ray, and none is
   sorted. A packet that needs too many steps is sorted ray by ray (sort_rows_by_ray).

   Hits at the same depth stay in the order of the rows: by index, for hits cut at t_near and for copies.
   Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_ROWS16_H
#define GBT_TRACE_LIST_ROWS16_H

#include <float.h>

#include "trace/list16.h"
#include "trace/ray_hits.h"
#include "trace/row16.h"

/* Passes over a packet are not inlined: each has all registers to itself. */
#define PASS __attribute__((noinline))

/* Steps that a packet may take, back in the forward pass and on in the adjoint: STEPS_PER_ROW for each row
   and STEPS_FREE in addition. With more, its rays are sorted one by one. */
enum { STEPS_PER_ROW = 48, STEPS_FREE = 1024 };

/* The place of a row, and how many rows it steps back past. */
typedef struct row_back {
    uint32_t place, steps;
} row_back;

/* The hits of a packet: arrays of rows, PACKET_LANES floats each; sixteen more than `count` have memory. */
typedef struct packet_hits {
    float *t;     /* depth, hit or not */
    float *alpha; /* 0 where the ray has no hit in this row */
    /* By place in the order: */
    float *T_front; /* T in front of the hit, starting from 1; two spare rows stand before the first */
    float *before;  /* product of 1 - alpha over all rows before this one; two spare rows, too */
    float *reached; /* forward only: farthest hit of all rows before this one; two spare rows, too */
    /* Adjoint only. By place: T alpha g . color, and the sum of it over the hits behind, with two spare rows
       after the last. By row: 1 / den of its response. */
    float *term, *behind, *inverse;
    /* By place: forward, how many entries the tape has in front of it; adjoint, the last place that it passes
       when it goes on. The same memory. */
    uint32_t *tape_index, *last_passed;
    row_back *back; /* forward only: the rows that step back past more than two, in their order */
    size_t back_count;
    uint32_t *order;  /* row */
    uint32_t *number; /* of a row, in the tile's list */
    float *key;       /* depth on a ray in the middle */
    size_t count;
    size_t steps;     /* of the last pass over them */
    vfloat16 product; /* of 1 - alpha over all rows */
    bool crowded;     /* too many steps: `T_front` is found by sorting */
} packet_hits;

static bool reserve_rows_of_list(list_scratch *scratch, size_t most, bool adjoint, packet_hits *out)
{
    /* An odd number of rows: arrays 4096 bytes apart would compete for the same cache sets. */
    const size_t n = ((most + 48 + 63) & ~(size_t)63) + 7, wide = n * PACKET_LANES, arrays = adjoint ? 7 : 5;
    if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, 0, arrays * wide + 6 * (n + 9),
                    sizeof(float), "rows of a packet", NULL) != GBT_OK)
        return false;
    float **field[7] = {
        &out->t,      &out->alpha,  &out->T_front, &out->before, adjoint ? &out->term : &out->reached,
        &out->behind, &out->inverse};
    float *at = scratch->rows;
    for (size_t k = 0; k < arrays; k++, at += wide)
        *field[k] = at;
    out->T_front += 2 * PACKET_LANES;
    out->before += 2 * PACKET_LANES;
    if (!adjoint)
        out->reached += 2 * PACKET_LANES;
    out->key = at;
    uint32_t *word = (uint32_t *)(void *)(at + n + 9); /* whole sixteens */
    out->order = word;
    out->number = word + n;
    out->tape_index = out->last_passed = word + 2 * n;
    out->back = (row_back *)(void *)(word + 3 * n);
    out->back_count = 0;
    out->steps = 0; /* also what they are with packet_order, where nothing is inserted */
    out->crowded = false;
    return true;
}

typedef struct row_response {
    vfloat16 t, raw;
    vfloat16 inverse; /* 1 / den */
} row_response;

/* Rows that are evaluated side by side, so that their dependency chains overlap: a processor does not look
   far enough ahead to find the next row by itself. */
enum { TOGETHER = 4 };

/* Responses by view_form16.h. `v`: NULL, or receives the v of sum_rows(). */
static inline __attribute__((always_inline)) void respond_together(const tile_gaussian *const g[TOGETHER],
                                                                   vfloat16 a, vfloat16 b, vfloat16 length,
                                                                   row_response out[TOGETHER],
                                                                   vfloat16 (*v)[3])
{
    vfloat16 w1[TOGETHER], w2[TOGETHER], w3[TOGETHER], y[TOGETHER], exponent[TOGETHER];
    const vfloat16 one = vfloat16_set1(1);
    for (int k = 0; k < TOGETHER; k++) {
        const vfloat16 da = vfloat16_sub(a, vfloat16_set1(g[k]->a)),
                       db = vfloat16_sub(b, vfloat16_set1(g[k]->b));
        w1[k] = vfloat16_fma(vfloat16_set1(g[k]->q[0]), da, vfloat16_fma(vfloat16_set1(g[k]->q[1]), db, one));
        w2[k] = vfloat16_fma(vfloat16_set1(g[k]->q[2]), da, vfloat16_mul(vfloat16_set1(g[k]->q[3]), db));
        w3[k] = vfloat16_mul(vfloat16_set1(g[k]->q[4]), db);
    }
    for (int k = 0; k < TOGETHER; k++)
        y[k] = vfloat16_fma(w2[k], w2[k], vfloat16_mul(w3[k], w3[k]));
    for (int k = 0; k < TOGETHER; k++)
        out[k].inverse = vfloat16_div(one, vfloat16_fma(w1[k], w1[k], y[k]));
    for (int k = 0; k < TOGETHER; k++) {
        exponent[k] =
            vfloat16_max(vfloat16_mul(vfloat16_set1(-g[k]->falloff), vfloat16_mul(y[k], out[k].inverse)),
                         vfloat16_set1(EXP2_LEAST));
        out[k].t = vfloat16_mul(vfloat16_mul(length, vfloat16_set1(g[k]->depth)),
                                vfloat16_mul(w1[k], out[k].inverse));
    }
    for (int k = 0; k < TOGETHER && v != NULL; k++) {
        const vfloat16 along = vfloat16_mul(w1[k], out[k].inverse);
        v[k][0] = vfloat16_mul(y[k], out[k].inverse);
        v[k][1] = vfloat16_mul(along, w2[k]);
        v[k][2] = vfloat16_mul(along, w3[k]);
    }
    for (int k = 0; k < TOGETHER; k++)
        out[k].raw = vfloat16_mul(vfloat16_set1(g[k]->opacity), vfloat16_exp2(exponent[k]));
}

/* The response by the general form of gaussian16.h. */
static row_response respond_general(const kernel_scene *scene, const packet_rays *rays, uint32_t id)
{
    const gaussian_lanes g = broadcast_gaussian(scene->records + (size_t)id * RECORD_FLOATS);
    ray_lanes ray;
    load_rays(rays, &ray);
    const response r = respond(&g, &ray, vfloat16_set1(scene->settings.t_near));
    return (row_response){r.t, response_alpha(&g, r.d2), vfloat16_set1(0)};
}

/* respond_together(), replaced by the general form for rows that the other does not hold for. */
static inline __attribute__((always_inline)) void respond_rows(
    const kernel_scene *scene, const packet_rays *rays, const tile_gaussian *const g[TOGETHER], vfloat16 a,
    vfloat16 b, vfloat16 length, row_response r[TOGETHER], vfloat16 v[TOGETHER][3])
{
    uint32_t pairs = 0;
    respond_together(g, a, b, length, r, v);
    for (int k = 0; k < TOGETHER; k++)
        pairs |= g[k]->pair;
    if (pairs & PAIR_GENERAL)
        for (int k = 0; k < TOGETHER; k++)
            if (g[k]->pair & PAIR_GENERAL)
                r[k] = respond_general(scene, rays, g[k]->id);
}

static inline const tile_gaussian *gaussian_at(const tile_list *list, const packet_hits *rows, size_t place)
{
    return &list->gaussian[rows->number[rows->order[place]]];
}

/* Sorts `count` rows from place `first` on by index, in arrays that are not yet set. */
static void order_by_index(const tile_list *list, packet_hits *rows, size_t first, size_t count)
{
    uint32_t *sorted = (uint32_t *)(void *)(rows->T_front + count);
    for (size_t i = 0; i < count; i++)
        memcpy(&rows->T_front[i], &gaussian_at(list, rows, first + i)->id, sizeof(uint32_t));
    const uint64_t *order =
        sort_list(rows->T_front, count, (uint64_t *)(void *)rows->reached, (uint64_t *)(void *)rows->before);
    for (size_t i = 0; i < count; i++)
        sorted[i] = rows->order[first + (uint32_t)order[i]];
    memcpy(rows->order + first, sorted, count * sizeof *sorted);
}

/* Rows that are cut at the near depth on some ray come first, by index, which is how their hits at that very
   depth are ordered. Their keys are 0. */
static void order_cut_rows(const tile_list *list, packet_hits *rows)
{
    size_t cut = 0;
    while (cut < rows->count && rows->key[rows->order[cut]] == 0)
        cut++;
    order_by_index(list, rows, 0, cut);
}

/* Copies of one Gaussian may have equal depths on every ray: order them by index. */
static void order_copies(const kernel_scene *scene, const tile_list *list, packet_hits *rows)
{
    for (size_t first = 0, end; first < rows->count; first = end) {
        const float key = rows->key[rows->order[first]];
        for (end = first + 1; end < rows->count && rows->key[rows->order[end]] == key; end++) {
            const float *a = scene->records + (size_t)gaussian_at(list, rows, first)->id * RECORD_FLOATS,
                        *b = scene->records + (size_t)gaussian_at(list, rows, end)->id * RECORD_FLOATS;
            if (memcmp(a + RECORD_MEAN, b + RECORD_MEAN, 3 * sizeof *a) != 0)
                break;
        }
        if (end - first > 1)
            order_by_index(list, rows, first, end - first);
    }
}

/* u of trace_settings.spread: how near a hit is, 1 at the near depth and 0 far away. */
static inline vfloat16 nearness(vfloat16 t, vfloat16 t_near)
{
    return vfloat16_div(t_near, vfloat16_max(t, t_near));
}

enum { MIDDLE = PACKET_PIXELS + 1 };

/* The depth of a row by which it is sorted with packet_order: that on the middle ray, kept between half and
   twice that on the next ray that is hit. For a plane seen from its edge may be anywhere on a ray that misses
   it, also behind the start of the ray. */
static inline float packet_depth(const packet_hits *rows, size_t i, float t_near)
{
    const float *t = rows->t + i * PACKET_LANES;
    const unsigned hit = vmask16_bits(vfloat16_lt(vfloat16_set1(0), row_load(rows->alpha, (int)i)));
    const int ahead = __builtin_ctz((hit | hit << PACKET_LANES) >> MIDDLE);
    const float near_by = t[(MIDDLE + ahead) % PACKET_LANES];
    return larger(larger(0.5f * near_by, t_near), smaller(t[MIDDLE], 2 * near_by)); /* NaN: twice */
}

/* Sorts the rows by their depth on a ray in the middle; rows of the same depth stay in the order of the
   tile's list. This order also decides where the floats of two depths happen to be equal on one ray, because
   it comes from other rays, too. A depth may be negative where there is no hit; keys are not, so that rows
   that are cut, whose keys are 0, come first. */
static void order_by_middle(const kernel_scene *scene, const tile_list *list, packet_hits *rows)
{
    const size_t count = rows->count;
    bool cut = false;
    for (size_t i = 0; i < count; i++) {
        const float t = scene->settings.packet_order ? packet_depth(rows, i, scene->settings.t_near)
                                                     : fabsf(rows->t[i * PACKET_LANES + MIDDLE]);
        rows->key[i] = t < FLT_MAX ? t : FLT_MAX; /* NaN, too */
    }
    for (size_t i = 0; list->any_general && i < count; i++) {
        const vmask16 hit = vfloat16_lt(vfloat16_set1(0), row_load(rows->alpha, (int)i)),
                      near = vfloat16_le(row_load(rows->t, (int)i), vfloat16_set1(scene->settings.t_near));
        const bool first = vmask16_any(vmask16_and(near, hit));
        if (first || rows->key[i] == FLT_MAX) /* FLT_MAX: the middle ray has no depth */
            rows->key[i] = 0;
        cut = cut || rows->key[i] == 0;
    }
    const uint64_t *order = /* sorted in arrays that are not yet set */
        sort_depths(rows->key, count, (uint64_t *)(void *)rows->reached, (uint64_t *)(void *)rows->before);
    for (size_t i = 0; i < count; i++)
        rows->order[i] = (uint32_t)order[i];
    uint64_t equal = 0; /* as wide as what is compared, so that compilers compare many at a time */
    for (size_t i = 1; i < count; i++)
        equal |= (order[i] ^ order[i - 1]) >> 32 == 0;
    if (equal)
        order_copies(scene, list, rows);
    if (cut)
        order_cut_rows(list, rows);
}

/* A row whose neighbours in the order may still change its value: T, or the sum of what lies behind. */
typedef struct near_row {
    vfloat16 t, alpha, term, value; /* term: adjoint */
} near_row;

/* The new row steps back past `other`: on rays where it lies in front, T of the other is multiplied by its 1
   - alpha; elsewhere `product` is multiplied by that of the other. */
static inline void pass_row(const near_row *now, near_row *other, vfloat16 *product)
{
    const vmask16 front = vfloat16_lt(now->t, other->t);
    other->value = vfloat16_less_where(front, other->value, now->alpha);
    *product = vfloat16_less_unless(front, *product, other->alpha);
}

/* The new row steps back past rows before place j while it has to. Returns its T but for the rows from j
   on. */
static inline __attribute__((always_inline)) vfloat16 step_back(const packet_hits *rows, const near_row *now,
                                                                vmask16 hit, int j, size_t *steps)
{
    const vfloat16 t = now->t, alpha = now->alpha;
    vfloat16 product = vfloat16_set1(1);
    const int from = j;
    do {
        const int other = (int)rows->order[--j];
        const vmask16 front = vfloat16_lt(t, row_load(rows->t, other));
        row_store(rows->T_front, j, vfloat16_less_where(front, row_load(rows->T_front, j), alpha));
        product = vfloat16_less_unless(front, product, row_load(rows->alpha, other));
    } while (vmask16_any(vmask16_and(vfloat16_lt(t, row_load(rows->reached, j)), hit)));
    *steps += (size_t)(from - j);
    return vfloat16_mul(row_load(rows->before, j), product);
}

/* The state after the rows so far, from which the next one is inserted. */
typedef struct insertion {
    near_row last, second;
    vfloat16 before;  /* product of 1 - alpha over all of them */
    vfloat16 reached; /* farthest hit of them */
    size_t steps, back_count;
    bool crowded;
} insertion;

static inline insertion start_insertion(const packet_hits *rows)
{
    const vfloat16 zero = vfloat16_set1(0), one = vfloat16_set1(1);
    const near_row none = {zero, zero, zero, one};
    for (int i = -2; i < 0; i++)
        row_store(rows->before, i, one);
    return (insertion){none, none, one, zero, 0, 0, false};
}

/* Inserts row i of the order: finds T in front of its hits, and corrects T in front of those that they hide.
   Every row passes the last two without asking, because a mispredicted branch costs more. `rows` is a copy of
   `out`, so that the compiler knows what stores cannot change. */
static inline void insert_row(const packet_hits *rows, insertion *s, int i, vfloat16 t, vfloat16 alpha)
{
    const vfloat16 zero = vfloat16_set1(0);
    near_row now = {.t = t, .alpha = alpha, .term = zero};
    const vmask16 hit = vfloat16_lt(zero, alpha);
    vfloat16 product = vfloat16_set1(1);
    row_store(rows->before, i, s->before);
    row_store(rows->reached, i, s->reached);
    pass_row(&now, &s->last, &product);
    pass_row(&now, &s->second, &product);
    now.value = vfloat16_mul(row_load(rows->before, i - 2), product);
    if (vmask16_any(vmask16_and(vfloat16_lt(now.t, row_load(rows->reached, i - 2)), hit)) && !s->crowded) {
        const size_t steps = s->steps;
        now.value = vfloat16_mul(step_back(rows, &now, hit, i - 2, &s->steps), product);
        rows->back[s->back_count++] = (row_back){(uint32_t)i, (uint32_t)(s->steps - steps) + 2};
        s->crowded = s->steps > STEPS_PER_ROW * (size_t)i + STEPS_FREE;
    }
    row_store(rows->T_front, i - 2, s->second.value);
    s->second = s->last;
    s->last = now;
    s->before = vfloat16_fnma(s->before, alpha, s->before);
    s->reached = vfloat16_max(s->reached, vfloat16_select(hit, now.t, zero));
}

static inline void end_insertion(packet_hits *out, const insertion *s)
{
    const int end = (int)out->count;
    row_store(out->T_front, end - 2, s->second.value);
    row_store(out->T_front, end - 1, s->last.value);
    out->product = s->before;
    out->steps = s->steps;
    out->back_count = s->back_count;
    out->crowded = s->crowded;
}

static PASS void insert_rows(packet_hits *out)
{
    const packet_hits rows = *out;
    insertion s = start_insertion(&rows);
    for (int i = -2; i < 0; i++)
        row_store(rows.reached, i, vfloat16_set1(0));
    for (int i = 0; i < (int)rows.count; i++) {
        const int row = (int)rows.order[i];
        insert_row(&rows, &s, i, row_load(rows.t, row), row_load(rows.alpha, row));
    }
    end_insertion(out, &s);
}

/* The hits of one ray in their order, in scratch; the lower half of a key is the place of the row. NULL when
   memory ran out. */
static const ray_hit *sort_lane(const packet_hits *rows, int lane, list_scratch *scratch, size_t *count)
{
    if (mem_reserve(&scratch->hits, &scratch->hit_bytes, 0, 2 * rows->count * sizeof(ray_hit), 1,
                    "hits of a ray", NULL) != GBT_OK)
        return NULL;
    ray_hit *hits = scratch->hits;
    size_t n = 0;
    for (size_t i = 0; i < rows->count; i++) {
        const size_t row = rows->order[i], at = row * PACKET_LANES + (size_t)lane;
        if (!(rows->alpha[at] > 0))
            continue;
        hits[n] = make_hit(rows->t[at], rows->alpha[at], (uint32_t)i); /* equal depths: by their place */
        n++;
    }
    sort_hits(hits, hits + rows->count, n);
    *count = n;
    return hits;
}

/* T of all hits, ray by ray. False when memory ran out. */
static bool sort_rows_by_ray(packet_hits *rows, list_scratch *scratch)
{
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        size_t count;
        const ray_hit *hits = sort_lane(rows, lane, scratch, &count);
        if (hits == NULL)
            return false;
        float T = 1;
        for (size_t k = 0; k < count; k++) {
            rows->T_front[(size_t)(uint32_t)hits[k].key * PACKET_LANES + (size_t)lane] = T;
            T *= 1 - hits[k].alpha;
        }
    }
    return true;
}

#endif
