/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_adjoint16.h -- the adjoint of a tile that went through the tree (docs/tracing.md, "The
   adjoint").

     tape --> entries of each packet --> [replay_rows] rows evaluated again --> [sort_rows] by nearest depth
         --> [weigh_rows] T alpha of every hit, by windows of overlapping rows (tree_rows16.h)
         --> [sum_terms, sum_rays] what lies behind every hit, dL/dalpha, sums over the sixteen rays
         --> [add_rows] turned into the Gaussian's own axes and added to its record

   Packets that were traced ray by ray go back ray by ray (ray_adjoint). Included by tree_kernel.inc.h. */
#ifndef GBT_TRACE_TREE_ADJOINT16_H
#define GBT_TRACE_TREE_ADJOINT16_H

#include "trace/tree_beam16.h"
#include "trace/gaussian16.h"
#include "trace/tree_kernel.h"
#include "trace/tree_rows16.h"
#include "trace/tree_view16.h"

/* The terms that one hit, or the sixteen of a row, add to the record of a Gaussian. */
static inline void gradient_terms(vfloat16 d_alpha, vfloat16 raw, vfloat16 weight, const vfloat16 v_in[3],
                                  vfloat16 opacity, vfloat16 alpha_max, const vfloat16 d_rgb[3],
                                  vfloat16 terms[16])
{
    /* Where alpha = min(alpha_max, opacity G) is capped, only the colour has a gradient. */
    const vfloat16 zero = vfloat16_set1(0),
                   d_raw = vfloat16_select(vfloat16_lt(raw, alpha_max), d_alpha, zero);
    const vmask16 blended = vfloat16_lt(zero, weight);
    vfloat16 v[3]; /* on rays that did not hit, v may be infinite or NaN, and 0 times that is not 0 */
    for (int k = 0; k < 3; k++)
        v[k] = vfloat16_select(blended, v_in[k], zero);
    const vfloat16 h = vfloat16_mul(vfloat16_set1(-0.5f), vfloat16_mul(raw, d_raw)); /* dL/d(d2) */
    vfloat16 hv[3];
    for (int k = 0; k < 3; k++) {
        terms[GRADIENT_V + k] = hv[k] = vfloat16_mul(h, v[k]);
        terms[GRADIENT_VV + k] = vfloat16_mul(hv[k], v[k]);
    }
    terms[GRADIENT_VV + 3] = vfloat16_mul(hv[1], v[2]), terms[GRADIENT_VV + 4] = vfloat16_mul(hv[2], v[0]),
                        terms[GRADIENT_VV + 5] = vfloat16_mul(hv[0], v[1]);
    terms[GRADIENT_OPACITY] = vfloat16_div(vfloat16_mul(raw, d_raw), opacity);
    for (int c = 0; c < 3; c++)
        terms[GRADIENT_COLOR + c] = vfloat16_mul(weight, d_rgb[c]);
    terms[GRADIENT_WEIGHT] = weight;
    terms[14] = terms[15] = zero;
}

/* Adds lane i of terms[k] to sum k of the record of entry i, for the first `count` lanes, at most 16. */
static bool add_turned(const tape_entry *entry, int count, const vfloat16 terms[16], gradient_list *out)
{
    _Static_assert(sizeof(gradient_record) == 16 * sizeof(float), "the id stands behind the sums");
    _Alignas(64) float field[16][16];
    const float *rows[16];
    const vmask16 sums = vmask16_from_bits((1u << GRADIENT_FLOATS) - 1);
    vfloat16 of_entry[16];
    for (int k = 0; k < 16; k++)
        vfloat16_store(field[k], terms[k]), rows[k] = field[k];
    vfloat16_load_transposed(rows, of_entry);
    for (int i = 0; i < 16 && i < count; i++) {
        gradient_record *g = gradient_list_find(out, entry[i].id);
        if (g == NULL)
            return false;
        float *record = (float *)(void *)g; /* all 16 numbers; the select leaves the id alone */
        const vfloat16 before = vfloat16_load(record);
        vfloat16_store(record, vfloat16_select(sums, vfloat16_add(before, of_entry[i]), before));
    }
    return true;
}

/* Rows of the adjoint, PACKET_LANES floats each: first in the order of the tape, then sorted. Groups: the
   Gaussians of sixteen rows each. */
enum { FIELD_T, FIELD_CLEAR, FIELD_RAW, FIELD_V, FIELD_COLOR = FIELD_V + 3, FIELD_WEIGHT, FIELD_COUNT };

typedef struct adjoint_group {
    view_gaussians view;
    _Alignas(64) float axes[9][16], distance[16];
    unsigned in_view; /* bit per row */
} adjoint_group;

typedef struct adjoint_rows {
    float *field[FIELD_COUNT];
    float *term, *after;
    float *row_near, *row_far;
    uint32_t *row;
    adjoint_group *group;
    sorted_rows sorted;
} adjoint_rows;

static bool reserve_rows(int count, tree_scratch *scratch, adjoint_rows *out)
{
    const size_t n = ((size_t)count + 16 + ROW_BLOCK) & ~(size_t)15, wide = n * PACKET_LANES,
                 groups = n / 16 * (sizeof(adjoint_group) / sizeof(float));
    if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, 0,
                    (FIELD_COUNT + 5) * wide + 5 * n + groups, sizeof(float), "adjoint rows", NULL) != GBT_OK)
        return false;
    float *at = scratch->rows;
    out->group = (adjoint_group *)(void *)at;
    at += groups;
    for (int f = 0; f < FIELD_COUNT; f++, at += wide)
        out->field[f] = at;
    out->term = at, out->after = at + wide, out->sorted.t = at + 2 * wide,
    out->sorted.one_minus_alpha = at + 3 * wide, out->sorted.T_front = at + 4 * wide;
    at += 5 * wide;
    out->sorted.near = at, out->sorted.far_reached = at + n, out->row_near = at + 2 * n,
    out->row_far = at + 3 * n, out->row = (uint32_t *)(void *)(at + 4 * n);
    out->sorted.count = count;
    return true;
}

/* The Gaussians of entries first .. first + 15; the last entry is repeated past the end. */
static inline gaussian_lanes entry_gaussians(const kernel_scene *scene, const tape_entry *entry, int first,
                                             int count, vfloat16 *color)
{
    uint32_t id[16];
    for (int i = 0; i < 16; i++)
        id[i] = entry[first + i < count ? first + i : count - 1].id;
    return load_gaussians(scene, id, color);
}

/* The Gaussians of all rows as seen from the tile's common origin. */
static void view_rows(const kernel_scene *scene, const tile_beam *beam, const tape_entry *entry,
                      adjoint_rows *o)
{
    for (int first = 0; first < o->sorted.count; first += 16) {
        adjoint_group *group = &o->group[first / 16];
        view_axes axes;
        const gaussian_lanes g = entry_gaussians(scene, entry, first, o->sorted.count, NULL);
        const vmask16 sound = view_gaussians_from(&g, beam, &group->view, &axes);
        /* Beside the camera the slopes of the mean grow without limit. */
        const vfloat16 wide = vfloat16_set1(8), a = vfloat16_load(group->view.field[VIEW_A]),
                       b = vfloat16_load(group->view.field[VIEW_B]);
        const vmask16 ahead = vmask16_and(
            vfloat16_lt(vfloat16_set1(scene->settings.t_near), vfloat16_load(group->view.field[VIEW_DEPTH])),
            vfloat16_lt(vfloat16_fma(a, a, vfloat16_mul(b, b)), wide));
        group->in_view = vmask16_bits(vmask16_and(sound, ahead));
        for (int k = 0; k < 9; k++)
            vfloat16_store(group->axes[k], axes.e[k / 3][k % 3]);
        vfloat16_store(group->distance, axes.distance);
    }
}

/* Evaluate the rows again; `beam` is NULL when there is no common origin. */
static void replay_rows(const kernel_scene *scene, const packet_rays *rays, const tile_beam *beam,
                        const tape_entry *entry, const vfloat16 d_rgb[3], adjoint_rows *o)
{
    const vfloat16 t_near = vfloat16_set1(scene->settings.t_near),
                   alpha_max = vfloat16_set1(scene->settings.alpha_max);
    const vfloat16 infinite = vfloat16_set1(INFINITY), one = vfloat16_set1(1), zero = vfloat16_set1(0);
    view_rays seen;
    if (beam != NULL) {
        seen = see_rays(rays, beam);
        view_rows(scene, beam, entry, o);
    }
    for (int i = 0; i < o->sorted.count; i++) {
        const float *record = scene->records + (size_t)entry[i].id * RECORD_FLOATS;
        const vmask16 blended = vmask16_from_bits(entry[i].lanes);
        adjoint_group *group = &o->group[i / 16];
        vfloat16 t, raw, v[3];
        bool done = false;
        if (beam != NULL && (group->in_view >> i % 16 & 1) != 0) {
            const view_response r = view_respond(&group->view, i % 16, &seen);
            const vfloat16 stretch = vfloat16_mul(vfloat16_set1(group->distance[i % 16]), r.inverse),
                           along = vfloat16_mul(stretch, r.w1);
            t = r.t;
            raw = view_alpha(&group->view, i % 16, r.exponent);
            v[0] = vfloat16_sub(zero, vfloat16_mul(stretch, r.y));
            v[1] = vfloat16_mul(along, r.w2);
            v[2] = vfloat16_mul(along, r.w3);
            done =
                !vmask16_any(vmask16_and(blended, vfloat16_le(t, t_near))); /* not for hits cut at t_near */
        }
        if (!done) {
            ray_lanes ray;
            load_rays(rays, &ray);
            const gaussian_lanes g = broadcast_gaussian(record);
            response r = respond(&g, &ray, t_near);
            refine_point(&g, &ray, t_near, &r);
            t = r.t;
            raw = response_alpha(&g, r.d2);
            memcpy(v, r.v, sizeof v);
            for (int k = 0; k < 9; k++)
                group->axes[k][i % 16] = k % 4 == 0;
        }
        row_store(o->field[FIELD_T], i, vfloat16_select(blended, t, infinite));
        row_store(o->field[FIELD_CLEAR], i,
                  vfloat16_select(blended, vfloat16_sub(one, vfloat16_min(raw, alpha_max)), one));
        row_store(o->field[FIELD_RAW], i, raw);
        for (int k = 0; k < 3; k++)
            row_store(o->field[FIELD_V + k], i, v[k]);
        row_store(o->field[FIELD_COLOR], i, dot_lanes(record + RECORD_COLOR, d_rgb));
    }
    row_depths(o->field[FIELD_T], o->sorted.count, o->row_near, o->row_far);
}

/* Insertion sort by (nearest depth, index), as the tape is nearly in that order. Returns T behind all
   rows. */
static vfloat16 sort_rows(const tape_entry *entry, adjoint_rows *o)
{
    sorted_rows *s = &o->sorted;
    for (int i = 0; i < s->count; i++) {
        int j = i;
        for (; j > 0; j--) {
            const uint32_t other = o->row[j - 1];
            if (o->row_near[i] > o->row_near[other] ||
                (o->row_near[i] == o->row_near[other] && entry[i].id > entry[other].id))
                break;
            o->row[j] = other;
        }
        o->row[j] = (uint32_t)i;
    }
    vfloat16 product = vfloat16_set1(1);
    float reached = 0;
    for (int i = 0; i < s->count; i++) {
        const int row = (int)o->row[i];
        place_row(s, i, row_load(o->field[FIELD_T], row), row_load(o->field[FIELD_CLEAR], row),
                  o->row_near[row], o->row_far[row], &product, &reached);
    }
    end_rows(s);
    return product;
}

/* Turn the sums of sixteen rows from the axes in which they were made into each Gaussian's own, and add them
   to its record. */
static bool add_rows(const tape_entry *entry, const adjoint_rows *o, int first, gradient_list *out)
{
    const adjoint_group *group = &o->group[first / 16];
    const float *rows[16];
    vfloat16 sum[16], turned[16], e[3][3];
    for (int i = 0; i < 16; i++)
        rows[i] =
            o->field[FIELD_RAW] + (size_t)(first + (first + i < o->sorted.count ? i : 0)) * PACKET_LANES;
    vfloat16_load_transposed(rows, sum);
    for (int k = 0; k < 9; k++)
        e[k / 3][k % 3] = vfloat16_load(group->axes[k]);
    turn_moments(e, sum + GRADIENT_V, sum + GRADIENT_VV, turned);
    for (int k = GRADIENT_OPACITY; k < 16; k++)
        turned[k] = sum[k];
    return add_turned(entry + first, o->sorted.count - first, turned, out);
}

/* For every row: T alpha, T c.g, and the term T alpha c.g. */
static void weigh_rows(vfloat16 alpha_max, adjoint_rows *o)
{
    const vfloat16 infinite = vfloat16_set1(INFINITY), zero = vfloat16_set1(0);
    const int count = o->sorted.count;
    row_window window = {0};
    for (int first = 0; first < count; first += ROW_BLOCK) {
        vfloat16 T[ROW_BLOCK];
        move_window(&o->sorted, first, &window);
        window_transmittance(&o->sorted, first, &window, T);
        for (int k = 0; k < ROW_BLOCK && first + k < count; k++) {
            const int row = (int)o->row[first + k];
            const vmask16 blended = vfloat16_lt(row_load(o->sorted.t, first + k), infinite);
            const vfloat16 alpha = vfloat16_min(row_load(o->field[FIELD_RAW], row), alpha_max);
            const vfloat16 weight = vfloat16_mul(T[k], vfloat16_select(blended, alpha, zero));
            const vfloat16 color = row_load(o->field[FIELD_COLOR], row);
            row_store(o->field[FIELD_WEIGHT], row, weight);
            row_store(o->field[FIELD_COLOR], row, vfloat16_mul(T[k], color));
            row_store(o->term, first + k, vfloat16_mul(weight, color));
        }
    }
}

/* For every row the sum of its term, those of all rows after it, and `behind`, what lies behind all. */
static void sum_terms(vfloat16 behind, adjoint_rows *o)
{
    const int count = o->sorted.count;
    for (int i = count; i < count + ROW_BLOCK; i++)
        row_store(o->term, i, vfloat16_set1(0));
    row_store(o->after, count, behind);
    for (int i = count; i-- > 0;)
        row_store(o->after, i, behind = vfloat16_add(behind, row_load(o->term, i)));
}

/* The sums of every row over its rays, with
       dL/dalpha_i = T_i c_i.g - (sum of w_j c_j.g behind i, with the background) / (1 - alpha_i)   */
static void sum_rays(const kernel_scene *scene, const tape_entry *entry, const vfloat16 d_rgb[3],
                     vfloat16 alpha_max, adjoint_rows *o)
{
    const vfloat16 infinite = vfloat16_set1(INFINITY), zero = vfloat16_set1(0);
    const int count = o->sorted.count;
    row_window window = {0};
    for (int first = 0; first < count; first += ROW_BLOCK) {
        vfloat16 sum[ROW_BLOCK];
        move_window(&o->sorted, first, &window);
        window_behind(&o->sorted, first, &window, o->term, o->after, sum);
        for (int k = 0; k < ROW_BLOCK && first + k < count; k++) {
            const int row = (int)o->row[first + k];
            const vmask16 blended = vfloat16_lt(row_load(o->sorted.t, first + k), infinite);
            const vfloat16 share = vfloat16_div(sum[k], row_load(o->sorted.one_minus_alpha, first + k)),
                           d_alpha = vfloat16_sub(row_load(o->field[FIELD_COLOR], row), share);
            const vfloat16 v[3] = {row_load(o->field[FIELD_V], row), row_load(o->field[FIELD_V + 1], row),
                                   row_load(o->field[FIELD_V + 2], row)};
            const float *record = scene->records + (size_t)entry[row].id * RECORD_FLOATS;
            vfloat16 terms[16];
            gradient_terms(vfloat16_select(blended, d_alpha, zero), row_load(o->field[FIELD_RAW], row),
                           row_load(o->field[FIELD_WEIGHT], row), v, vfloat16_set1(record[RECORD_OPACITY]),
                           alpha_max, d_rgb, terms);
            row_store(o->field[FIELD_RAW], row, vfloat16_sum_rows(terms)); /* raw is not needed any more */
        }
    }
}

static bool packet_adjoint(const kernel_scene *scene, const packet_rays *rays, const tile_beam *beam,
                           const float d_rgb_in[3][PACKET_LANES], const tape_entry *entry, int count,
                           gradient_list *out, tree_scratch *scratch)
{
    adjoint_rows o;
    if (!reserve_rows(count, scratch, &o))
        return false;
    const vfloat16 alpha_max = vfloat16_set1(scene->settings.alpha_max);
    vfloat16 d_rgb[3], behind_all[3];
    for (int c = 0; c < 3; c++) {
        d_rgb[c] = vfloat16_load(d_rgb_in[c]);
        behind_all[c] = vfloat16_load(rays->background[c]);
    }
    replay_rows(scene, rays, beam, entry, d_rgb, &o);
    const vfloat16 T_left = sort_rows(entry, &o);
    weigh_rows(alpha_max, &o);
    sum_terms(vfloat16_mul(dot16(behind_all, d_rgb), T_left), &o);
    sum_rays(scene, entry, d_rgb, alpha_max, &o);
    for (int first = 0; first < count; first += 16)
        if (!add_rows(entry, &o, first, out))
            return false;
    return true;
}

/* The adjoint of one ray, whose hits are in order: it needs no windows and no division. T and the colour
   behind are recurrences of one operation per hit; the rest is done for sixteen hits at a time. */
static bool ray_adjoint(const kernel_scene *scene, const packet_rays *rays, int lane,
                        const float d_rgb_in[3][PACKET_LANES], const tape_entry *entry, int count,
                        gradient_list *out, tree_scratch *scratch)
{
    enum { RAW, V, COLOR = V + 3, OPACITY, ONE_MINUS_ALPHA, TERM, T, BEHIND, FIELDS };
    const size_t n = ((size_t)count + 15) & ~(size_t)15;
    if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, 0, FIELDS * n, sizeof(float),
                    "adjoint of a ray", NULL) != GBT_OK)
        return false;
    float *field[FIELDS];
    for (int f = 0; f < FIELDS; f++)
        field[f] = scratch->rows + (size_t)f * n;
    const vfloat16 t_near = vfloat16_set1(scene->settings.t_near), one = vfloat16_set1(1),
                   alpha_max = vfloat16_set1(scene->settings.alpha_max);
    ray_lanes ray;
    vfloat16 d_rgb[3];
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = vfloat16_set1(rays->origin[k][lane]);
        ray.dir[k] = vfloat16_set1(rays->dir[k][lane]);
        d_rgb[k] = vfloat16_set1(d_rgb_in[k][lane]);
    }
    for (int first = 0; first < count; first += 16) {
        vfloat16 color[3];
        const gaussian_lanes g = entry_gaussians(scene, entry, first, count, color);
        response r = respond(&g, &ray, t_near);
        refine_point(&g, &ray, t_near, &r);
        const vfloat16 raw = response_alpha(&g, r.d2), alpha = vfloat16_min(raw, alpha_max),
                       shown = dot16(color, d_rgb);
        vfloat16_store(field[RAW] + first, raw);
        for (int k = 0; k < 3; k++)
            vfloat16_store(field[V + k] + first, r.v[k]);
        vfloat16_store(field[COLOR] + first, shown);
        vfloat16_store(field[OPACITY] + first, g.opacity);
        vfloat16_store(field[ONE_MINUS_ALPHA] + first, vfloat16_sub(one, alpha));
        vfloat16_store(field[TERM] + first, vfloat16_mul(alpha, shown));
    }
    const float *one_minus_alpha = field[ONE_MINUS_ALPHA], *term = field[TERM];
    float *T_front = field[T], *behind_hit = field[BEHIND], transmittance = 1, behind = 0;
    for (int i = 0; i < count; i++) {
        T_front[i] = transmittance;
        transmittance *= one_minus_alpha[i];
    }
    for (int c = 0; c < 3; c++)
        behind = fmaf(rays->background[c][lane], d_rgb_in[c][lane], behind);
    for (int i = count; i-- > 0;) {
        behind_hit[i] = behind;
        behind = fmaf(one_minus_alpha[i], behind, term[i]);
    }
    for (int first = 0; first < count; first += 16) {
        vfloat16 v[3], terms[16];
        for (int k = 0; k < 3; k++)
            v[k] = vfloat16_load(field[V + k] + first);
        const vfloat16 raw = vfloat16_load(field[RAW] + first), front = vfloat16_load(field[T] + first),
                       weight = vfloat16_mul(front, vfloat16_min(raw, alpha_max)),
                       d_alpha = vfloat16_mul(front, vfloat16_sub(vfloat16_load(field[COLOR] + first),
                                                                  vfloat16_load(field[BEHIND] + first)));
        gradient_terms(d_alpha, raw, weight, v, vfloat16_load(field[OPACITY] + first), alpha_max, d_rgb,
                       terms);
        if (!add_turned(entry + first, count - first, terms, out))
            return false;
    }
    return true;
}

/* Counts the entries of the tape, in all and of each packet; `singles`: bit per packet that was traced ray by
   ray. Not inlined, so that the counters stay in registers. */
static __attribute__((noinline)) size_t count_entries(const tape_entry *entry, size_t of_packet[TILE_PACKETS],
                                                      unsigned *singles)
{
    size_t count = 0;
    unsigned seen = 0;
    for (; entry[count].packet != TAPE_END; count++)
        if (entry[count].packet & TAPE_SINGLE)
            seen |= 1u << (entry[count].packet & ~TAPE_SINGLE);
        else
            of_packet[entry[count].packet]++;
    *singles = seen;
    return count;
}

static bool backward(const kernel_scene *scene, const tile_rays *tile,
                     float d_rgb[TILE_PACKETS][3][PACKET_LANES], const tape_entry *entry, gradient_list *out,
                     tree_scratch *scratch)
{
    const packet_rays *rays = tile->packet;
    size_t of_packet[TILE_PACKETS] = {0};
    unsigned singles;
    const size_t count = count_entries(entry, of_packet, &singles);
    if (mem_reserve(&scratch->hits, &scratch->hit_bytes, 0, count * sizeof(tape_entry), 1, "adjoint entries",
                    NULL) != GBT_OK)
        return false;
    tape_entry *sorted = scratch->hits, *at[TILE_PACKETS];
    for (int p = 0; p < TILE_PACKETS; p++)
        at[p] = p == 0 ? sorted : at[p - 1] + of_packet[p - 1];
    for (size_t i = 0; i < count; i++)
        if ((entry[i].packet & TAPE_SINGLE) == 0)
            *at[entry[i].packet]++ = entry[i];
    tile_beam beam;
    const bool seen = tile->common_origin && count > 0 && make_beam(rays, scene, &beam);
    const tape_entry *next = entry, *end = entry + count;
    for (int p = 0; p < TILE_PACKETS; p++) {
        if ((singles >> p & 1) == 0) {
            if (rays[p].active != 0 && !packet_adjoint(scene, &rays[p], seen ? &beam : NULL, d_rgb[p],
                                                       at[p] - of_packet[p], (int)of_packet[p], out, scratch))
                return false;
            continue;
        }
        /* This packet was given up and traced ray by ray: what it had blended before does not count. The
           entries of its rays come in order. */
        for (unsigned bits = rays[p].active; bits != 0; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            while (next < end && (next->packet & TAPE_SINGLE) == 0)
                next++;
            const tape_entry *first = next;
            while (next < end && next->packet == (p | TAPE_SINGLE) && next->lanes == lane)
                next++;
            if (!ray_adjoint(scene, &rays[p], lane, d_rgb[p], first, (int)(next - first), out, scratch))
                return false;
        }
    }
    return true;
}

#endif
