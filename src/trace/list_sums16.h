/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_sums16.h -- the adjoint's Gaussians: those that a tile has blended, and the sums of their
   gradients.

     tape --> [load_used] the Gaussians that were blended
     terms of a row --> [add_sums] summed over the rays in a fixed tree, added to those of its Gaussian
     slots of a record --> [turn_sums] added, and turned into the Gaussian's own axes

   Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_SUMS16_H
#define GBT_TRACE_LIST_SUMS16_H

#include "trace/list_rows16.h"

enum { AHEAD = 12 /* how many records ahead are prefetched */ };

/* The Gaussians that a tile has blended. */
typedef struct used_list {
    tile_gaussian *gaussian; /* [count] */
    uint32_t *number;        /* [list] place in `gaussian`; UINT32_MAX: not used */
    size_t count;
} used_list;

static bool load_used(const list_view *view, size_t part, const double middle[2], const hit_tape *tape,
                      list_scratch *scratch, used_list *out)
{
    const size_t begin = view->first[part], count = view->first[part + 1] - begin;
    if (mem_reserve((void **)&scratch->list, &scratch->list_capacity, 0, 18 * count + 1, sizeof(float),
                    "list of a tile", NULL) != GBT_OK ||
        mem_reserve((void **)&scratch->sums, &scratch->sum_capacity, 0, count, sizeof *scratch->sums,
                    "sums of a tile", NULL) != GBT_OK)
        return false;
    out->gaussian = (tile_gaussian *)(void *)scratch->list;
    out->number = (uint32_t *)(void *)(scratch->list + 16 * count);
    uint32_t *pair = out->number + count;
    /* Mark first, then number: numbering at once, each entry would wait for the counter that the one before
       stored. */
    memset(out->number, 0xFF, count * sizeof *out->number);
    for (size_t i = 0; i < tape->count; i++)
        out->number[tape->entries[i].id] = 0;
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        const bool is_used = out->number[i] == 0;
        pair[used] = (uint32_t)i;
        out->number[i] = is_used ? (uint32_t)used : UINT32_MAX;
        used += is_used;
    }
    out->count = used;
    const list_pair *pairs = view->pairs + begin;
    memset(scratch->sums, 0, out->count * sizeof *scratch->sums);
    for (size_t i = 0; i < out->count; i++) {
        if (i + AHEAD < out->count)
            __builtin_prefetch(&view->records[pairs[pair[i + AHEAD]].record]);
        read_gaussian(&view->records[pairs[pair[i]].record], middle, pair[i], &out->gaussian[i]);
    }
    return true;
}

/* Adds the terms of a row, summed over the rays, to the sums of its Gaussian. Lanes eight apart are added
   while they are multiplied (vfloat16_fold_product). */
static inline void add_sums(vfloat16 h, vfloat16 weight, const vfloat16 v[3], const vfloat16 d_rgb[3],
                            float *to)
{
    vfloat8 terms[16];
    vfloat16 hv[3];
    terms[SLOT_H] = vfloat16_fold(h);
    for (int k = 0; k < 3; k++) {
        hv[k] = vfloat16_mul(h, v[k]);
        terms[SLOT_HV + k] = vfloat16_fold(hv[k]);
        terms[SLOT_HVV + k] = vfloat16_fold_product(hv[k], v[k]);
        terms[SLOT_COLOR + k] = vfloat16_fold_product(weight, d_rgb[k]);
    }
    terms[SLOT_HVV + 3] = vfloat16_fold_product(hv[1], v[2]);
    terms[SLOT_HVV + 4] = vfloat16_fold_product(hv[2], v[0]);
    terms[SLOT_HVV + 5] = vfloat16_fold_product(hv[0], v[1]);
    terms[SLOT_WEIGHT] = vfloat16_fold(weight);
    terms[14] = terms[15] = vfloat16_fold(vfloat16_set1(0));
    vfloat16_store(to, vfloat16_add(vfloat16_load(to), vfloat8_sum_rows(terms)));
}

/* add_sums() for a row that view_form16.h does not hold for: v comes from the general form. */
static void sum_general(const kernel_scene *scene, const packet_rays *rays, uint32_t id, vmask16 hit,
                        vfloat16 h, vfloat16 weight, const vfloat16 d_rgb[3], float *to)
{
    const gaussian_lanes g = broadcast_gaussian(scene->records + (size_t)id * RECORD_FLOATS);
    const vfloat16 t_near = vfloat16_set1(scene->settings.t_near), zero = vfloat16_set1(0);
    ray_lanes ray;
    vfloat16 v[3];
    load_rays(rays, &ray);
    response r = respond(&g, &ray, t_near);
    refine_point(&g, &ray, t_near, &r);
    for (int k = 0; k < 3; k++) /* v may be more than a float holds where the ray did not hit */
        v[k] = vfloat16_select(hit, r.v[k], zero);
    add_sums(h, weight, v, d_rgb, to);
}

/* The sums of records first .. first + 15 over their slots, in their order. */
static inline void gather_slots(const list_view *view, size_t first, size_t end, float sum[16][16])
{
    for (size_t i = 0; i < 16; i++) {
        vfloat16 total = vfloat16_set1(0);
        const size_t at = first + i;
        const uint32_t slots = at < end ? view->slot_count[at] : 0;
        for (uint32_t k = 0; k < slots; k++) {
            const uint32_t slot = view->slot_first[at] + k;
            if (view->slot_used[slot])
                total = vfloat16_add(total, vfloat16_load(view->slots[slot].sum));
        }
        vfloat16_store(sum[i], total);
    }
}

/* Sums of the records [begin, end) over their slots, turned from the axes of view_form16.h into the
   Gaussians' own. */
static void turn_sums(const kernel_scene *scene, const list_view *view, const list_face *face, size_t begin,
                      size_t end, block_sums *out)
{
    for (size_t first = begin; first < end; first += 16) {
        _Alignas(64) float by_record[16][16];
        _Alignas(64) float slope[3][16];
        const size_t at = first - begin;
        unsigned general = 0;
        const float *rows[16];
        uint32_t id[16];
        vfloat16 sum[16], to[GRADIENT_OPACITY];
        view_form form;
        gather_slots(view, first, end, by_record);
        for (size_t i = 0; i < 16; i++) {
            const list_record *r = &view->records[first + i < end ? first + i : first];
            rows[i] = by_record[i];
            id[i] = record_id(r);
            general |= (unsigned)record_is_general(r) << i;
            slope[0][i] = (float)r->a;
            slope[1][i] = (float)r->b;
            slope[2][i] = r->depth;
        }
        const gaussian_lanes g = load_gaussians(scene, id, NULL);
        view_form_find(face->frame.axis, &g, vfloat16_load(slope[0]), vfloat16_load(slope[1]),
                       vfloat16_load(slope[2]), &form);
        vfloat16_load_transposed(rows, sum);
        const vfloat16 zero = vfloat16_set1(0), R = form.distance, RR = vfloat16_mul(R, R);
        vfloat16 hv[3], hvv[6];
        for (int k = 0; k < 3; k++)
            hv[k] = vfloat16_mul(R, sum[SLOT_HV + k]);
        for (int k = 0; k < 6; k++)
            hvv[k] = vfloat16_mul(RR, sum[SLOT_HVV + k]);
        hv[0] = vfloat16_sub(zero, hv[0]);
        hvv[4] = vfloat16_sub(zero, hvv[4]);
        hvv[5] = vfloat16_sub(zero, hvv[5]);
        turn_moments(form.e, hv, hvv, to);
        for (int k = 0; k < 9; k++) /* V, VV: those of general records are in their own axes already, in the
                                       same order */
            vfloat16_store(out->sum[k] + at,
                           vfloat16_select(vmask16_from_bits(general), sum[SLOT_HV + k], to[k]));
        vfloat16_store(out->sum[GRADIENT_OPACITY] + at,
                       vfloat16_div(vfloat16_mul(vfloat16_set1(-2), sum[SLOT_H]), g.opacity));
        for (int k = 0; k < 3; k++)
            vfloat16_store(out->sum[GRADIENT_COLOR + k] + at, sum[SLOT_COLOR + k]);
        vfloat16_store(out->sum[GRADIENT_WEIGHT] + at, sum[SLOT_WEIGHT]);
    }
}

#endif
