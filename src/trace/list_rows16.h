/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_rows16.h -- rows of a packet in the exact order of every ray, by insertion.

   A row is one Gaussian on sixteen rays. Rows are put in the order of their depth on a ray in the middle. On
   every ray T in front of a hit is the product of 1 - alpha over the hits before it; a row starts from the
   product over all rows before it in the order, and steps back over them while some ray has a hit there that
   lies behind its own: on such a ray the other hit's T is multiplied by this row's 1 - alpha; elsewhere this
   one's by the other's. Hits at the same depth are ordered by index. Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_ROWS16_H
#define GBT_TRACE_LIST_ROWS16_H

#include <float.h>

#include "trace/list16.h"
#include "trace/ray_hits.h"
#include "trace/rows16.h"

/* Steps back that a packet is allowed per row before its rays are sorted one by one. */
enum { STEPS_PER_ROW = 48, STEPS_FREE = 1024 };

/* Arrays of rows, PACKET_LANES floats each; sixteen more than `count` have memory. */
typedef struct list_rows {
    float *t;     /* depth, hit or not */
    float *alpha; /* 0 where the ray has no hit in this row */
    /* By place in the order: */
    float *through; /* T in front of the hit; two more stand before the first */
    float *before;  /* product of 1 - alpha over all rows before this one */
    float *reached; /* farthest hit of all rows before this one */
    /* Adjoint: g . color, T alpha g . color, and the sum of that behind, of which two more stand after the
       last; of a row, 1 / den of its response. */
    float *color, *term, *behind, *inverse;
    uint32_t *order;               /* row */
    uint32_t *number, *id, *lanes; /* of a row: number in the tile's list; Gaussian; adjoint: bit per ray that
                                      blended it */
    float *key;                    /* depth on a ray in the middle */
    size_t count;
    size_t steps;
    vfloat16 product; /* of 1 - alpha over all rows */
    bool crowded;     /* too many steps: `through` is found by sorting */
} list_rows;

static bool reserve_rows_of_list(list_scratch *scratch, size_t most, bool adjoint, list_rows *out)
{
    /* Arrays 4096 bytes apart would compete for the same lines of the cache. */
    const size_t n = ((most + 48 + 63) & ~(size_t)63) + 7, wide = n * PACKET_LANES, arrays = adjoint ? 9 : 5;
    if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, 0, arrays * wide + 5 * (n + 9),
                    sizeof(float), "rows of a packet", NULL) != GBT_OK)
        return false;
    float **field[9] = {&out->t,     &out->alpha, &out->through, &out->before, &out->reached,
                        &out->color, &out->term,  &out->behind,  &out->inverse};
    float *at = scratch->rows;
    for (size_t k = 0; k < arrays; k++, at += wide)
        *field[k] = at;
    out->through += 2 * PACKET_LANES;
    out->key = at;
    uint32_t *word = (uint32_t *)(void *)(at + n + 9); /* whole sixteens */
    out->order = word;
    out->number = word + n;
    out->id = word + 2 * n;
    out->lanes = word + 3 * n;
    return true;
}

typedef struct row_response {
    vfloat16 t, raw;
    vfloat16 inverse; /* 1 / den */
} row_response;

static inline row_response respond_in_list(const list_row *g, vfloat16 a, vfloat16 b, vfloat16 length)
{
    const vfloat16 da = vfloat16_sub(a, vfloat16_set1(g->a)), db = vfloat16_sub(b, vfloat16_set1(g->b));
    const vfloat16 w1 = vfloat16_fma(vfloat16_set1(g->q[0]), da,
                                     vfloat16_fma(vfloat16_set1(g->q[1]), db, vfloat16_set1(1))),
                   w2 = vfloat16_fma(vfloat16_set1(g->q[2]), da, vfloat16_mul(vfloat16_set1(g->q[3]), db)),
                   w3 = vfloat16_mul(vfloat16_set1(g->q[4]), db);
    const vfloat16 y = vfloat16_fma(w2, w2, vfloat16_mul(w3, w3)),
                   inverse = vfloat16_div(vfloat16_set1(1), vfloat16_fma(w1, w1, y));
    const vfloat16 exponent = vfloat16_mul(vfloat16_set1(-g->falloff), vfloat16_mul(y, inverse));
    return (row_response){
        vfloat16_mul(vfloat16_mul(length, vfloat16_set1(g->depth)), vfloat16_mul(w1, inverse)),
        vfloat16_mul(vfloat16_set1(g->opacity),
                     vfloat16_exp2(vfloat16_max(exponent, vfloat16_set1(-120.0f)))),
        inverse};
}

/* By the general form of gaussian16.h. */
static row_response respond_general(const kernel_scene *scene, const packet_rays *rays, uint32_t id)
{
    const gaussian_lanes g = spread_gaussian(scene->records + (size_t)id * RECORD_FLOATS);
    ray_lanes ray;
    load_rays(rays, &ray);
    const response r = respond(&g, &ray, vfloat16_set1(scene->settings.t_near));
    return (row_response){r.t, response_alpha(&g, r.d2), vfloat16_set1(0)};
}

/* Rows that are cut at the near depth on some ray come first, by index, which is how their hits at that very
   depth are ordered. Their keys are 0. */
static void order_cut_rows(list_rows *rows)
{
    for (size_t i = 1; i < rows->count && rows->key[rows->order[i]] == 0; i++) {
        const uint32_t row = rows->order[i];
        size_t j = i;
        for (; j > 0 && rows->id[rows->order[j - 1]] > rows->id[row]; j--)
            rows->order[j] = rows->order[j - 1];
        rows->order[j] = row;
    }
}

/* The rows in the order of their depth on a ray in the middle; those of the same depth, in that of the tile's
   list. Where two floats happen to be equal on one ray, this order decides: it knows more than they do. */
static void order_by_middle(const tile_list *list, float t_near, list_rows *rows)
{
    enum { MIDDLE = PACKET_PIXELS + 1, FEW = 256 };
    const size_t count = rows->count;
    bool cut = false;
    for (size_t i = 0; i < count; i++)
        rows->key[i] = rows->t[i * PACKET_LANES + MIDDLE];
    for (size_t i = 0; list->any_general && i < count; i++) {
        const bool first = vmask16_any(vfloat16_le(row_load(rows->t, (int)i), vfloat16_set1(t_near)));
        if (first || !(rows->key[i] < FLT_MAX)) /* NaN: no hit there */
            rows->key[i] = 0;
        cut = cut || rows->key[i] == 0;
    }
    if (count <= FEW) {
        uint16_t order[FEW];
        rank_keys(rows->key, (int)count, order);
        for (size_t i = 0; i < count; i++)
            rows->order[i] = order[i];
    } else { /* in the place of arrays that are not yet set */
        const uint64_t *order =
            sort_list(rows->key, count, (uint64_t *)(void *)rows->reached, (uint64_t *)(void *)rows->before);
        for (size_t i = 0; i < count; i++)
            rows->order[i] = (uint32_t)order[i];
    }
    if (cut)
        order_cut_rows(rows);
}

/* A row whose neighbours in the order may still change its value: T, or the sum of what lies behind. */
typedef struct near_row {
    vfloat16 t, clear, term, value; /* clear: 1 - alpha; term: adjoint */
} near_row;

/* Row i goes back past `other`: where it lies in front, the other's T is less by its alpha; elsewhere its own
   is. */
static inline void pass_row(vfloat16 t, vfloat16 clear, near_row *other, vfloat16 *product)
{
    const vmask16 front = vfloat16_lt(t, other->t);
    other->value = vfloat16_mul_where(front, other->value, clear);
    *product = vfloat16_mul_where(vmask16_andnot(front, vmask16_from_bits(0xFFFF)), *product, other->clear);
}

/* Row i goes back past those before j, too; returned is its T. */
static vfloat16 step_back(list_rows *rows, int i, int j)
{
    const vfloat16 zero = vfloat16_set1(0), one = vfloat16_set1(1);
    const int row = (int)rows->order[i];
    const vfloat16 t = row_load(rows->t, row), alpha = row_load(rows->alpha, row),
                   clear = vfloat16_sub(one, alpha);
    const vmask16 hit = vfloat16_lt(zero, alpha);
    vfloat16 product = one;
    const int from = j;
    do {
        const int other = (int)rows->order[--j];
        const vmask16 front = vfloat16_lt(t, row_load(rows->t, other));
        row_store(rows->through, j, vfloat16_mul_where(front, row_load(rows->through, j), clear));
        product = vfloat16_mul(product,
                               vfloat16_select(front, one, vfloat16_sub(one, row_load(rows->alpha, other))));
    } while (vmask16_any(vmask16_and(vfloat16_lt(t, row_load(rows->reached, j)), hit)));
    rows->steps += (size_t)(from - j);
    return vfloat16_mul(row_load(rows->before, j), product);
}

/* Find T of all rows. Each goes back past the last two without asking, because a branch that cannot be
   foretold costs more. */
static void insert_rows(list_rows *out)
{
    const list_rows copy = *out, *const rows = &copy; /* what stores cannot change */
    const vfloat16 zero = vfloat16_set1(0), one = vfloat16_set1(1);
    const int end = (int)rows->count;
    near_row last = {zero, one, zero, one}, second = last;
    vfloat16 before[3] = {one, one, one},
             reached[3] = {zero, zero, zero}; /* of this row, the last, the second */
    bool crowded = false;
    out->steps = 0;
    for (int i = 0; i < end; i++) {
        const int row = (int)rows->order[i];
        const vfloat16 alpha = row_load(rows->alpha, row);
        near_row now = {.t = row_load(rows->t, row), .clear = vfloat16_sub(one, alpha), .term = zero};
        const vmask16 hit = vfloat16_lt(zero, alpha);
        vfloat16 product = one;
        row_store(rows->before, i, before[0]);
        row_store(rows->reached, i, reached[0]);
        pass_row(now.t, now.clear, &last, &product);
        pass_row(now.t, now.clear, &second, &product);
        now.value = vfloat16_mul(before[2], product);
        if (vmask16_any(vmask16_and(vfloat16_lt(now.t, reached[2]), hit)) && !crowded) {
            now.value = vfloat16_mul(step_back(out, i, i - 2), product);
            crowded = out->steps > STEPS_PER_ROW * (size_t)i + STEPS_FREE;
        }
        row_store(rows->through, i - 2, second.value);
        second = last;
        last = now;
        for (int k = 2; k > 0; k--) {
            before[k] = before[k - 1];
            reached[k] = reached[k - 1];
        }
        before[0] = vfloat16_mul(before[0], now.clear);
        reached[0] = vfloat16_max(reached[0], vfloat16_select(hit, now.t, zero));
    }
    row_store(rows->through, end - 2, second.value);
    row_store(rows->through, end - 1, last.value);
    out->product = before[0];
    out->crowded = crowded;
}

/* The hits of one ray in their order, in scratch, each with its place; NULL when memory ran out. */
static const ray_hit *sort_lane(const list_rows *rows, int lane, list_scratch *scratch, size_t *count)
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
static bool sort_rows_by_ray(list_rows *rows, list_scratch *scratch)
{
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        size_t count;
        const ray_hit *hits = sort_lane(rows, lane, scratch, &count);
        if (hits == NULL)
            return false;
        float T = 1;
        for (size_t k = 0; k < count; k++) {
            rows->through[(size_t)(uint32_t)hits[k].key * PACKET_LANES + (size_t)lane] = T;
            T *= 1 - hits[k].alpha;
        }
    }
    return true;
}

#endif
