/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list16.h -- the list of one part of a tile: load, sort by depth, cull against packets.

   load_list() copies the records of the part's Gaussians, with slopes relative to the middle of the tile;
   finds a depth for each, by which it sorts them (long lists by radix sort, short ones by counting smaller
   keys), and a lower bound of the depth anywhere in the tile. list->nearest[] holds the smallest bound from
   each sixteen on: a packet stops there once its rays have become opaque in front of that depth.
   gaussians_in_packet() tests sixteen ellipses at once against the slopes of a packet. Included by
   list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST16_H
#define GBT_TRACE_LIST16_H

#include "trace/list_kernel.h"
#include "trace/list_records16.h"

/* A Gaussian as the packets of a tile read it; slopes are from the middle of the tile. */
typedef struct tile_gaussian {
    _Alignas(64) float a;
    float b, q[5], depth, falloff, opacity, color[3];
    uint32_t id;
    uint32_t pair; /* number in the tile's list; with PAIR_GENERAL */
} tile_gaussian;
enum { PAIR_GENERAL = 1u << 31 };
_Static_assert(sizeof(tile_gaussian) == 64, "a cache line");

/* The ellipses in which the Gaussians can be hit, in list order, one array per field: centre, factor
   (list_outline), and the coefficients with which x = ACROSS y minimises the form along a, y = DOWN x along
   b. */
enum { SHAPE_X, SHAPE_Y, SHAPE_CHOL, SHAPE_ACROSS = SHAPE_CHOL + 3, SHAPE_DOWN, SHAPE_FIELDS };

typedef struct tile_list {
    size_t count;            /* the arrays have room for whole sixteens */
    tile_gaussian *gaussian; /* [count] */
    float *shape[SHAPE_FIELDS];
    float *nearest; /* [count / 16 and one more] lower bound of t / |(a, b, 1)| of all hits of a sixteen and
                       those after it; the last is infinite */
    bool any_general;
    uint16_t *general;         /* [sixteens] bit per Gaussian */
    list_ellipsoid *ellipsoid; /* of those that are general */
} tile_list;

/* The rays of a packet as slopes from the middle of the tile. */
typedef struct packet_slopes {
    _Alignas(64) float a[PACKET_LANES], b[PACKET_LANES], length[PACKET_LANES];
    slope_box box;      /* of the active rays, slightly enlarged */
    slope_box face_box; /* the same, relative to the axis of the face */
} packet_slopes;

/* Slopes of a packet's rays in the axes of the face, relative to `middle`: found in double from the
   directions of the rays, then rounded. */
static inline void slope_rays(const list_frame *frame, const packet_rays *rays, const double middle[2],
                              packet_slopes *out)
{
    const double(*dual)[3] = frame->dual;
    for (int i = 0; i < PACKET_LANES; i++) {
        const double x = (double)rays->dir[0][i], y = (double)rays->dir[1][i], z = (double)rays->dir[2][i];
        const double u = dual[0][0] * x + dual[0][1] * y + dual[0][2] * z,
                     v = dual[1][0] * x + dual[1][1] * y + dual[1][2] * z,
                     w = dual[2][0] * x + dual[2][1] * y + dual[2][2] * z, inverse = 1 / w;
        out->a[i] = (float)(u * inverse - middle[0]);
        out->b[i] = (float)(v * inverse - middle[1]);
        out->length[i] = (float)inverse;
    }
    const vfloat16 a = vfloat16_load(out->a), b = vfloat16_load(out->b); /* lanes that are not active repeat
                                                                            one that is */
    out->box =
        (slope_box){{vfloat16_lowest(a), vfloat16_lowest(b)}, {vfloat16_highest(a), vfloat16_highest(b)}};
    for (int k = 0; k < 2; k++) {
        const float open = 1e-6f + 1e-3f * (out->box.high[k] - out->box.low[k]);
        out->box.low[k] -= open;
        out->box.high[k] += open;
        out->face_box.low[k] = (float)(middle[k] + (double)out->box.low[k]) - 1e-6f;
        out->face_box.high[k] = (float)(middle[k] + (double)out->box.high[k]) + 1e-6f;
    }
}

/* A packet that is traced. */
typedef struct packet_pass {
    const kernel_scene *scene;
    const packet_rays *rays;
    int number; /* in the tile */
    bool parts; /* tile_rays.parts */
    packet_slopes slopes;
} packet_pass;

static inline void start_pass(const kernel_scene *scene, const list_frame *frame, const tile_rays *rays,
                              int number, const double middle[2], packet_pass *out)
{
    out->scene = scene;
    out->rays = &rays->packet[number];
    out->number = number;
    out->parts = rays->parts;
    slope_rays(frame, out->rays, middle, &out->slopes);
}

static inline void tile_middle(const slope_box *box, double middle[2])
{
    for (int k = 0; k < 2; k++)
        middle[k] = 0.5 * ((double)box->low[k] + (double)box->high[k]);
}

static inline void read_gaussian(const list_record *r, const double middle[2], uint32_t pair,
                                 tile_gaussian *out)
{
    out->a = (float)(r->a - middle[0]);
    out->b = (float)(r->b - middle[1]);
    memcpy(out->q, r->q, sizeof r->q);
    out->depth = r->depth;
    out->falloff = r->falloff;
    out->opacity = r->opacity;
    memcpy(out->color, r->color, sizeof r->color);
    out->id = record_id(r);
    out->pair = pair | (record_is_general(r) ? PAIR_GENERAL : 0);
}

/* Memory for the Gaussians of a tile, and for sorting them. */
typedef struct list_memory {
    tile_list list;
    tile_gaussian *unsorted;
    list_shape *shape;
    float *key, *bound, *across, *down; /* across, down: SHAPE_ACROSS, SHAPE_DOWN */
    uint64_t *order, *spare;
} list_memory;

static bool reserve_list(list_scratch *scratch, size_t count, list_memory *out)
{
    const size_t n = (count + 15) & ~(size_t)15, wide = n + 16;
    const size_t floats = 2 * 16 * n + 2 * 8 * n + SHAPE_FIELDS * n + 10 * wide;
    if (mem_reserve((void **)&scratch->list, &scratch->list_capacity, 0, floats, sizeof(float),
                    "list of a tile", NULL) != GBT_OK)
        return false;
    float *at = scratch->list;
    out->list.count = count;
    out->list.gaussian = (tile_gaussian *)(void *)at;
    at += 16 * n;
    out->unsorted = (tile_gaussian *)(void *)at;
    at += 16 * n;
    out->shape = (list_shape *)(void *)at;
    at += 8 * n;
    out->list.ellipsoid = (list_ellipsoid *)(void *)at;
    at += 8 * n;
    for (int k = 0; k < SHAPE_FIELDS; k++, at += n)
        out->list.shape[k] = at;
    out->key = at;
    out->bound = at + wide;
    out->list.nearest = at + 2 * wide;
    out->order = (uint64_t *)(void *)(at + 3 * wide);
    out->spare = (uint64_t *)(void *)(at + 5 * wide);
    out->list.general = (uint16_t *)(void *)(at + 7 * wide);
    out->across = at + 8 * wide;
    out->down = at + 9 * wide;
    return true;
}

/* For sixteen Gaussians that have been read: the key, t / |(a, b, 1)| at the point of the tile nearest to the
   centre of the outline; a lower bound of t / |(a, b, 1)| in all of the tile; SHAPE_ACROSS and SHAPE_DOWN.
   Those of general Gaussians are set afterwards. */
static inline void depth_in_tile(const list_memory *m, size_t first, const float low[2], const float high[2])
{
    const float *rows[16], *shapes[16];
    vfloat16 r[16], s[16];
    for (int i = 0; i < 16; i++) {
        rows[i] = (const float *)(const void *)&m->unsorted[first + (size_t)i];
        shapes[i] = (const float *)(const void *)&m->shape[first + (size_t)i];
    }
    vfloat16_load_transposed(rows, r);
    vfloat16_load_transposed(shapes, s);
    const vfloat16 one = vfloat16_set1(1), zero = vfloat16_set1(0);
    vfloat16 at[2], reach = one;
    for (int k = 0; k < 2; k++) {
        const vfloat16 from = vfloat16_sub(vfloat16_set1(low[k]), r[k]),
                       to = vfloat16_sub(vfloat16_set1(high[k]), r[k]);
        at[k] = vfloat16_min(vfloat16_max(s[k], from), to);
        const vfloat16 left = vfloat16_max(from, vfloat16_sub(s[k], s[5 + k])),
                       right = vfloat16_min(to, vfloat16_add(s[k], s[5 + k]));
        reach =
            vfloat16_add(reach, vfloat16_max(vfloat16_mul(r[2 + k], left), vfloat16_mul(r[2 + k], right)));
    }
    const vfloat16 w1 = vfloat16_fma(r[2], at[0], vfloat16_fma(r[3], at[1], one)),
                   w2 = vfloat16_fma(r[4], at[0], vfloat16_mul(r[5], at[1])), w3 = vfloat16_mul(r[6], at[1]);
    const vfloat16 den = vfloat16_fma(w1, w1, vfloat16_fma(w2, w2, vfloat16_mul(w3, w3)));
    vfloat16_store(m->key + first, vfloat16_max(vfloat16_div(vfloat16_mul(r[7], w1), den), zero));
    vfloat16_store(m->bound + first, vfloat16_div(vfloat16_mul(vfloat16_mul(r[7], vfloat16_set1(0.99999f)),
                                                               vfloat16_sub(one, s[7])),
                                                  vfloat16_max(reach, vfloat16_set1(1e-3f))));
    const vfloat16 minus = vfloat16_mul(vfloat16_set1(-1), s[3]);
    vfloat16_store(m->across + first, vfloat16_div(minus, s[2]));
    vfloat16_store(m->down + first,
                   vfloat16_div(vfloat16_mul(s[2], minus),
                                vfloat16_add(vfloat16_mul(s[3], s[3]), vfloat16_mul(s[4], s[4]))));
}

/* Key and bound of a general Gaussian; the key is t / |(a, b, 1)| on the ray through the middle. */
static inline void depth_of_ellipsoid(const kernel_scene *scene, const list_frame *frame,
                                      const double middle[2], const list_memory *m, size_t i)
{
    const list_ellipsoid *e = &m->shape[i].ellipsoid;
    const float *record = scene->records + (size_t)m->unsorted[i].id * RECORD_FLOATS;
    const float a = (float)middle[0], b = (float)middle[1];
    float along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        float w = 0, x = 0;
        for (int j = 0; j < 3; j++) {
            const float cell = record[RECORD_MATRIX + 3 * k + j];
            w += cell * (a * frame->axis[0][j] + b * frame->axis[1][j] + frame->axis[2][j]);
            x += cell * (record[RECORD_MEAN + j] - (float)frame->origin[j]);
        }
        along += w * x;
        square += w * w;
    }
    /* 1.0001: rounding of ww and of the root; 4e-6: of the coordinates, as in ellipsoid_meets_box() */
    const float near = e->center[2] - 1.0001f * sqrtf(e->ww) -
                       4e-6f * (fabsf(e->center[0]) + fabsf(e->center[1]) + fabsf(e->center[2])),
                t = along / square, t_near = scene->settings.t_near;
    /* A hit has t >= t_near, and rays of a face have 1 / |(a, b, 1)| > AXIS_COMPONENT_MIN. Keys give only a
       first order: what is cut at t_near, or not ahead, just has to stand in front. */
    m->bound[i] = larger(AXIS_COMPONENT_MIN * t_near, 0.99999f * near);
    m->key[i] = t > 0.5f * t_near && t < 1e30f ? t : 0.5f * t_near; /* NaN fails */
}

/* Radix sort of the numbers 0 .. count - 1 by the bits of their keys; it is stable, so the order of two of
   them does not depend on the rest of the list. A result is (key bits - lowest) << 32 | number: upper halves
   are equal where keys are. High digits that are all 0 are skipped. */
static const uint64_t *sort_list(const float *key, size_t count, uint64_t *from, uint64_t *to)
{
    enum { DIGITS = 4, VALUES = 256 };
    uint32_t lowest = UINT32_MAX, highest = 0, place[DIGITS][VALUES] = {{0}};
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &key[i], sizeof bits);
        lowest = bits < lowest ? bits : lowest;
        highest = bits > highest ? bits : highest;
    }
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &key[i], sizeof bits);
        bits -= lowest;
        from[i] = (uint64_t)bits << 32 | i;
        for (int d = 0; d < DIGITS; d++)
            place[d][bits >> 8 * d & (VALUES - 1)]++;
    }
    for (int d = 0; d < DIGITS && (highest - lowest) >> 8 * d != 0; d++) {
        uint32_t next = 0;
        for (int v = 0; v < VALUES; v++) {
            const uint32_t of_digit = place[d][v];
            place[d][v] = next;
            next += of_digit;
        }
        for (size_t i = 0; i < count; i++)
            to[place[d][from[i] >> (32 + 8 * d) & (VALUES - 1)]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

static inline vfloat16 count_where(vmask16 m, vfloat16 count)
{
    return vfloat16_add_where(m, count, vfloat16_set1(1));
}

enum { RANKED_MOST = 320 };

/* Sorts at most RANKED_MOST keys by counting: the place of a key is the number of keys that are smaller, or
   equal and before it. out[place] = bits of the key << 32 | its number. Keys are not negative; sixteen more
   behind the last are overwritten. Two sixteens are compared only once: a later key comes after those that
   are not larger. */
static void rank_rows(float *key, size_t count, uint64_t *out)
{
    const vfloat16 zero = vfloat16_set1(0);
    uint32_t earlier[RANKED_MOST + 16] = {0}; /* of the sixteens before its own: how many come before it */
    for (size_t i = count; i < count + 16; i++)
        key[i] = INFINITY;
    for (size_t first = 0; first < count; first += 16) {
        _Alignas(64) float place[16];
        const vfloat16 mine = vfloat16_load(key + first);
        vfloat16 before[4] = {zero, zero, zero, zero};
        for (size_t i = 0; i < 16; i += 4)
            for (int k = 0; k < 4; k++) {
                const vfloat16 other = vfloat16_set1(key[first + i + k]);
                const vmask16 later = vmask16_from_bits(0xFFFEu << (i + k) & 0xFFFF);
                before[k] = count_where(
                    vmask16_or(vfloat16_lt(other, mine), vmask16_and(vfloat16_le(other, mine), later)),
                    before[k]);
            }
        for (size_t i = first + 16; i < count; i += 4)
            for (int k = 0; k < 4; k++) {
                const vmask16 smaller_key = vfloat16_lt(vfloat16_set1(key[i + k]), mine);
                before[k] = count_where(smaller_key, before[k]);
                earlier[i + k] += 16 - (uint32_t)__builtin_popcount(vmask16_bits(smaller_key));
            }
        vfloat16_store(place,
                       vfloat16_add(vfloat16_add(before[0], before[1]), vfloat16_add(before[2], before[3])));
        for (size_t i = first; i < first + 16 && i < count; i++) {
            uint32_t bits;
            memcpy(&bits, &key[i], sizeof bits);
            out[(size_t)place[i - first] + earlier[i]] = (uint64_t)bits << 32 | i;
        }
    }
}

/* sort_list() for keys that are not negative, with room for 16 more. Short lists go to rank_rows(), which
   takes half the time. */
static const uint64_t *sort_depths(float *key, size_t count, uint64_t *from, uint64_t *to)
{
    enum { FEW = 256 };
    if (count > FEW)
        return sort_list(key, count, from, to);
    rank_rows(key, count, from);
    return from;
}

/* Puts number `from` of the Gaussians that were read into place `i` of the order. */
static inline void place_shape(const list_memory *m, size_t from, size_t i)
{
    const tile_gaussian *g = &m->unsorted[from];
    const tile_list *list = &m->list;
    list->gaussian[i] = *g;
    if (g->pair & PAIR_GENERAL) {
        list->ellipsoid[i] = m->shape[from].ellipsoid;
        list->general[i / 16] |= (uint16_t)(1u << i % 16);
        for (int k = 0; k < SHAPE_FIELDS; k++)
            list->shape[k][i] = 0; /* passes every test; the ellipsoid is tested instead */
        return;
    }
    const list_outline *o = &m->shape[from].outline;
    list->shape[SHAPE_X][i] = g->a + o->x;
    list->shape[SHAPE_Y][i] = g->b + o->y;
    for (int k = 0; k < 3; k++)
        list->shape[SHAPE_CHOL + k][i] = o->chol[k];
    list->shape[SHAPE_ACROSS][i] = m->across[from];
    list->shape[SHAPE_DOWN][i] = m->down[from];
}

/* The list of a part of a tile, in order. False when memory ran out. */
static bool load_list(const kernel_scene *scene, const list_view *view, size_t part, const double middle[2],
                      list_scratch *scratch, tile_list *out)
{
    const size_t begin = view->first[part], count = view->first[part + 1] - begin;
    const slope_box *box = &view->part_boxes[part];
    list_memory m;
    if (!reserve_list(scratch, count, &m))
        return false;
    for (size_t i = 0; i < count; i++) {
        const list_pair *pair = &view->pairs[begin + i];
        if (i + 8 < count) {
            __builtin_prefetch(&view->records[pair[8].record]);
            __builtin_prefetch(&view->shapes[pair[8].record]);
        }
        m.shape[i] = view->shapes[pair->record];
        read_gaussian(&view->records[pair->record], middle, (uint32_t)i, &m.unsorted[i]);
    }
    const size_t n = (count + 15) & ~(size_t)15;
    for (size_t i = count; i < n; i++) { /* repeat the last one to fill the sixteen */
        m.unsorted[i] = m.unsorted[count - 1];
        m.shape[i] = m.shape[count - 1];
    }
    float low[2], high[2];
    for (int k = 0; k < 2; k++) {
        low[k] = (float)((double)box->low[k] - middle[k]);
        high[k] = (float)((double)box->high[k] - middle[k]);
    }
    for (size_t i = 0; i < n; i += 16)
        depth_in_tile(&m, i, low, high);
    m.list.any_general = false;
    for (size_t i = 0; i < count; i++)
        if (m.unsorted[i].pair & PAIR_GENERAL) {
            m.list.any_general = true;
            depth_of_ellipsoid(scene, part_frame(view, part), middle, &m, i);
        }
    const uint64_t *order = sort_depths(m.key, count, m.order, m.spare);
    memset(m.list.general, 0, n / 16 * sizeof *m.list.general);
    for (size_t i = 0; i < n; i++)
        place_shape(&m, (uint32_t)order[i < count ? i : count - 1], i);
    float nearest = INFINITY;
    m.list.nearest[n / 16] = nearest;
    for (size_t i = count; i-- > 0;) {
        nearest = smaller(nearest, m.bound[(uint32_t)order[i]]);
        if (i % 16 == 0)
            m.list.nearest[i / 16] = nearest;
    }
    *out = m.list;
    return true;
}

/* Which of Gaussians first .. first + 15 reach into a packet: those whose quadratic form is at most 1
   somewhere in the box of the packet's slopes. In a box the form is smallest at its centre, if that is
   inside, else on the edge nearest to the centre in a or that in b. So it is minimised along both lines, each
   clamped to the box. */
static inline unsigned gaussians_in_packet(const tile_list *list, size_t first, const packet_slopes *slopes)
{
    const slope_box *box = &slopes->box;
    const float *const *shape = (const float *const *)list->shape;
    const vfloat16 x = vfloat16_load(shape[SHAPE_X] + first), y = vfloat16_load(shape[SHAPE_Y] + first);
    const vfloat16 left = vfloat16_sub(vfloat16_set1(box->low[0]), x),
                   right = vfloat16_sub(vfloat16_set1(box->high[0]), x),
                   bottom = vfloat16_sub(vfloat16_set1(box->low[1]), y),
                   top = vfloat16_sub(vfloat16_set1(box->high[1]), y), zero = vfloat16_set1(0);
    const vfloat16 near_x = vfloat16_min(vfloat16_max(zero, left), right),
                   near_y = vfloat16_min(vfloat16_max(zero, bottom), top);
    const vfloat16 c0 = vfloat16_load(shape[SHAPE_CHOL] + first),
                   c1 = vfloat16_load(shape[SHAPE_CHOL + 1] + first),
                   c2 = vfloat16_load(shape[SHAPE_CHOL + 2] + first);
    const vfloat16 row_x = vfloat16_min(
                       vfloat16_max(vfloat16_mul(vfloat16_load(shape[SHAPE_ACROSS] + first), near_y), left),
                       right),
                   column_y = vfloat16_min(
                       vfloat16_max(vfloat16_mul(vfloat16_load(shape[SHAPE_DOWN] + first), near_x), bottom),
                       top);
    const vfloat16 row_u = vfloat16_fma(c0, row_x, vfloat16_mul(c1, near_y)),
                   row_v = vfloat16_mul(c2, near_y),
                   column_u = vfloat16_fma(c0, near_x, vfloat16_mul(c1, column_y)),
                   column_v = vfloat16_mul(c2, column_y);
    const vfloat16 on_row = vfloat16_fma(row_u, row_u, vfloat16_mul(row_v, row_v)),
                   on_column = vfloat16_fma(column_u, column_u, vfloat16_mul(column_v, column_v));
    unsigned bits = vmask16_bits(vfloat16_le(vfloat16_min(on_row, on_column), vfloat16_set1(1)));
    for (unsigned rest = list->general[first / 16]; rest != 0; rest &= rest - 1) {
        const int i = __builtin_ctz(rest);
        if (!ellipsoid_meets_box(&list->ellipsoid[first + (size_t)i], &slopes->face_box))
            bits &= ~(1u << i);
    }
    return first + 16 <= list->count ? bits : bits & 0xFFFFu >> (16 - (list->count - first));
}

#endif
