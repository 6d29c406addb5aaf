/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_rows16.h -- rows: hits of one Gaussian on the sixteen rays of a packet; put in order and
   blended.

   Nothing is sorted per ray. Rows are put in the order of their nearest depth; then, on every ray, the
   transmittance in front of a hit is the product over the rows that end before this row begins (one running
   product for all of them) times the product over the few rows whose depths overlap with it, compared one by
   one:

       T_i = T_front[first_i] prod { 1 - alpha_j : first_i <= j < last_i, t_j before t_i }

   Exact order by t_c at the price of one comparison and one masked multiplication per overlapping pair,
   without keys, gathers or scatters.
   Equal depths: the row order decides, which is the order of indices for Gaussians of one shape, place and
   opacity and for depths cut at t_near. Included by kernels after simd16.h. */
#ifndef GBT_TRACE_TREE_ROWS16_H
#define GBT_TRACE_TREE_ROWS16_H

#include "trace/packet_extra16.h"
#include "trace/row16.h"

enum { ROW_CAPACITY = 512, ROW_BLOCK = 4 /* rows whose windows are walked together */ };

typedef struct packet_rows {
    _Alignas(64) float t[ROW_CAPACITY * PACKET_LANES]; /* infinity where the ray has no hit left in this row
                                                        */
    _Alignas(64) float alpha[ROW_CAPACITY * PACKET_LANES]; /* 0 there */
    uint32_t id[ROW_CAPACITY];
    uint16_t blended[ROW_CAPACITY]; /* rays that have blended the row */
    int count;
    vmask16 alive;
    vfloat16 transmittance, rgb[3], far;
    packet_extra extra;
} packet_rows;

/* Rows in the order of their nearest depth, whole vectors of PACKET_LANES; ROW_BLOCK more rows follow the
   last, so that blocks are whole. */
typedef struct sorted_rows {
    float *t, *one_minus_alpha; /* depth, infinity where there is no hit; 1 - alpha, 1 there */
    float *T_front;             /* T in front of row i if all rows before it were in front */
    float *near, *far_reached;  /* one number per row: nearest depth; largest depth of rows 0..i */
    int count;
} sorted_rows;

/* The range of rows whose depths overlap with those of a block of ROW_BLOCK rows. It only moves forward from
   block to block; start from {0}. */
typedef struct row_window {
    int low, high;
} row_window;

/* Nearest and farthest hit of each of `count` rows (room for whole sixteens), 0 for the farthest of none.
   Returns the nearest of all. */
static inline float row_depths(const float *t, int count, float *near, float *far)
{
    const vfloat16 infinite = vfloat16_set1(INFINITY);
    vfloat16 nearest = infinite;
    for (int first = 0; first < count; first += 16) {
        vfloat16 low[16], high[16];
        for (int i = 0; i < 16; i++) {
            low[i] = first + i < count ? row_load(t, first + i) : infinite;
            high[i] = vfloat16_select(vfloat16_lt(low[i], infinite), low[i], vfloat16_set1(0));
        }
        const vfloat16 near_rows = vfloat16_min_rows(low);
        nearest = vfloat16_min(nearest, near_rows);
        vfloat16_store(near + first, near_rows);
        vfloat16_store(far + first, vfloat16_max_rows(high));
    }
    return vfloat16_lowest(nearest);
}

/* Places row `i` of the order, after row i - 1. `product` and `reached` run along: transmittance in front of
   the row, farthest depth so far. */
static inline void place_row(sorted_rows *o, int i, vfloat16 t, vfloat16 one_minus_alpha, float near,
                             float far, vfloat16 *product, float *reached)
{
    row_store(o->t, i, t);
    row_store(o->one_minus_alpha, i, one_minus_alpha);
    row_store(o->T_front, i, *product);
    *product = vfloat16_mul(*product, one_minus_alpha);
    *reached = larger(*reached, far);
    o->near[i] = near;
    o->far_reached[i] = *reached;
}

static inline void end_rows(sorted_rows *o)
{
    for (int i = o->count; i < o->count + ROW_BLOCK; i++) {
        row_store(o->t, i, vfloat16_set1(INFINITY));
        row_store(o->one_minus_alpha, i, vfloat16_set1(1));
        o->near[i] = INFINITY;
    }
}

static inline void move_window(const sorted_rows *o, int first, row_window *w)
{
    while (o->far_reached[w->low] < o->near[first])
        w->low++;
    const int last = first + ROW_BLOCK <= o->count ? first + ROW_BLOCK : o->count;
    if (w->high < last)
        w->high = last;
    while (w->high < o->count && o->near[w->high] <= o->far_reached[last - 1])
        w->high++;
}

/* Transmittance in front of the hits of rows first .. first + ROW_BLOCK - 1. */
static inline void window_transmittance(const sorted_rows *o, int first, const row_window *w,
                                        vfloat16 T[ROW_BLOCK])
{
    vfloat16 t[ROW_BLOCK];
    for (int k = 0; k < ROW_BLOCK; k++) {
        T[k] = row_load(o->T_front, w->low);
        t[k] = row_load(o->t, first + k);
    }
    for (int j = w->low; j < first; j++) {
        const vfloat16 tj = row_load(o->t, j), one_minus_alpha = row_load(o->one_minus_alpha, j);
        for (int k = 0; k < ROW_BLOCK; k++)
            T[k] = vfloat16_mul_where(vfloat16_le(tj, t[k]), T[k], one_minus_alpha);
    }
    for (int j = 0; j < ROW_BLOCK; j++) {
        const vfloat16 one_minus_alpha = row_load(o->one_minus_alpha, first + j);
        for (int k = 0; k < ROW_BLOCK; k++)
            if (j != k)
                T[k] = vfloat16_mul_where(j < k ? vfloat16_le(t[j], t[k]) : vfloat16_lt(t[j], t[k]), T[k],
                                          one_minus_alpha);
    }
    for (int j = first + ROW_BLOCK; j < w->high; j++) {
        const vfloat16 tj = row_load(o->t, j), one_minus_alpha = row_load(o->one_minus_alpha, j);
        for (int k = 0; k < ROW_BLOCK; k++)
            T[k] = vfloat16_mul_where(vfloat16_lt(tj, t[k]), T[k], one_minus_alpha);
    }
}

/* Sum of `term` over the hits behind those of rows first .. first + ROW_BLOCK - 1; after[i] is the sum over
   rows i and on, and what is behind them. */
static inline void window_behind(const sorted_rows *o, int first, const row_window *w, const float *term,
                                 const float *after, vfloat16 sum[ROW_BLOCK])
{
    vfloat16 t[ROW_BLOCK];
    for (int k = 0; k < ROW_BLOCK; k++) {
        sum[k] = row_load(after, w->high);
        t[k] = row_load(o->t, first + k);
    }
    for (int j = w->low; j < first; j++) {
        const vfloat16 tj = row_load(o->t, j), add = row_load(term, j);
        for (int k = 0; k < ROW_BLOCK; k++)
            sum[k] = vfloat16_add_where(vfloat16_lt(t[k], tj), sum[k], add);
    }
    for (int j = 0; j < ROW_BLOCK; j++) {
        const vfloat16 add = row_load(term, first + j);
        for (int k = 0; k < ROW_BLOCK; k++)
            if (j != k)
                sum[k] = vfloat16_add_where(j < k ? vfloat16_lt(t[k], t[j]) : vfloat16_le(t[k], t[j]), sum[k],
                                            add);
    }
    for (int j = first + ROW_BLOCK; j < w->high; j++) {
        const vfloat16 tj = row_load(o->t, j), add = row_load(term, j);
        for (int k = 0; k < ROW_BLOCK; k++)
            sum[k] = vfloat16_add_where(vfloat16_le(t[k], tj), sum[k], add);
    }
}

/* ---- forward: the rows of one round ---- */

typedef struct round_rows {
    _Alignas(64) float t[(ROW_CAPACITY + ROW_BLOCK) * PACKET_LANES],
        one_minus_alpha[(ROW_CAPACITY + ROW_BLOCK) * PACKET_LANES];
    _Alignas(64) float T_front[ROW_CAPACITY * PACKET_LANES];
    _Alignas(64) float row_near[ROW_CAPACITY], row_far[ROW_CAPACITY]; /* in the packet's own order of rows */
    _Alignas(64) float key[ROW_CAPACITY];
    float near[ROW_CAPACITY + ROW_BLOCK], far_reached[ROW_CAPACITY];
    uint16_t row[ROW_CAPACITY]; /* sorted place -> row of the packet */
    sorted_rows sorted;
} round_rows;

static inline bool row_before(const packet_rows *p, const round_rows *o, int a, int b)
{
    return o->row_near[a] < o->row_near[b] || (o->row_near[a] == o->row_near[b] && p->id[a] < p->id[b]);
}

/* Ranks keys by counting: order[place] = the number of the key with that many smaller ones. Sixteen floats
   behind the last key are overwritten. Equal keys stay in the order of their numbers; returns whether there
   are any. */
static inline bool rank_keys(float *key, int n, uint16_t *order)
{
    const int blocks = (n + 15) / 16;
    bool tied = false;
    for (int i = n; i < 16 * blocks; i++)
        key[i] = INFINITY;
    memset(order, 0xFF, (size_t)n * sizeof *order);
    for (int i = 0; i < n; i++) {
        const vfloat16 mine = vfloat16_set1(key[i]);
        unsigned place = 0;
        for (int b = 0; b < blocks; b++)
            place +=
                (unsigned)__builtin_popcount(vmask16_bits(vfloat16_lt(vfloat16_load(key + 16 * b), mine)));
        for (; order[place] != 0xFFFF; place++)
            tied = true;
        order[place] = (uint16_t)i;
    }
    return tied;
}

/* The rows that begin before `horizon`, by (nearest depth, index): the place of a row is the number of rows
   before it. */
static inline void order_rows(const packet_rows *p, float horizon, round_rows *o)
{
    int n = 0;
    uint16_t rows[ROW_CAPACITY];
    for (int i = 0; i < p->count; i++) {
        rows[n] = (uint16_t)i;
        o->key[n] = o->row_near[i];
        n += o->row_near[i] < horizon;
    }
    o->sorted = (sorted_rows){o->t, o->one_minus_alpha, o->T_front, o->near, o->far_reached, n};
    const bool tied = rank_keys(o->key, n, o->row);
    for (int i = 0; i < n; i++)
        o->row[i] = rows[o->row[i]];
    if (!tied)
        return;
    for (int i = 0; i < n; i++) {
        int j = i;
        for (; j > 0 && row_before(p, o, rows[i], o->row[j - 1]); j--)
            o->row[j] = o->row[j - 1];
        o->row[j] = rows[i];
    }
}

/* Copies the rows in order, with the running product and the running farthest depth. Hits at or behind the
   horizon are left out. */
static inline void arrange_rows(const packet_rows *p, float horizon, round_rows *o)
{
    const vfloat16 limit = vfloat16_set1(horizon), infinite = vfloat16_set1(INFINITY), one = vfloat16_set1(1);
    vfloat16 product = p->transmittance;
    float reached = 0;
    for (int i = 0; i < o->sorted.count; i++) {
        const int row = o->row[i];
        const vfloat16 t = row_load(p->t, row);
        const vmask16 now = vfloat16_lt(t, limit);
        const vfloat16 one_minus_alpha =
            vfloat16_select(now, vfloat16_sub(one, row_load(p->alpha, row)), one);
        place_row(&o->sorted, i, vfloat16_select(now, t, infinite), one_minus_alpha, o->row_near[row],
                  smaller(o->row_far[row], horizon), &product, &reached);
    }
    end_rows(&o->sorted);
}

#endif
