/* SPDX-License-Identifier: Apache-2.0 */
/* raster/ray_form16.h -- the per-ray form: response and order of docs/tracing.md on the lists of the tiles,
   and the adjoint.

   For the cross-check, not for speed: block by block all hits are gathered, sorted ray by ray, and blended.
   The adjoint does the same again, so it needs no tape. Included by kernel.inc.h. */
#ifndef GBT_RASTER_RAY_FORM16_H
#define GBT_RASTER_RAY_FORM16_H

#include <stdlib.h>

#include "base/memory.h"
#include "base/vec.h"
#include "raster/ewa16.h"

/* A splat that at least one ray of the block hits. Gathered: t and alpha (0: no hit). Blended for the
   adjoint: dL/dalpha and T alpha. */
typedef struct ray_row {
    _Alignas(64) float t[PIXEL_LANES], alpha[PIXEL_LANES];
    uint32_t entry;
} ray_row;

typedef struct splat_hit {
    uint64_t key; /* bits of t, then the index: depths are positive, so their bits are in the order of their
                     values */
    uint32_t row;
} splat_hit;

/* Rays (a, b, 1) in camera axes; a and b are relative to the middle of the block, so that differences to a
   mean keep their digits. */
typedef struct block_rays {
    double middle[2];
    vfloat16 a, b, length, depth_near;
} block_rays;

typedef struct ray_response {
    vfloat16 t, v[3], raw;
    vfloat16 da, db, w[3]; /* of ray_splat */
    vmask16 clipped;       /* at the near depth */
} ray_response;

static inline block_rays rays_of(const tile_job *job, int block)
{
    const raster_view *view = job->view;
    const int x0 = job->x0 + block % BLOCKS_ACROSS * BLOCK_PIXELS,
              y0 = job->y0 + block / BLOCKS_ACROSS * BLOCK_PIXELS;
    _Alignas(64) float a[PIXEL_LANES], b[PIXEL_LANES], length[PIXEL_LANES];
    block_rays r = {.middle = {(x0 + 1.5 - view->cx) / view->fx, (y0 + 1.5 - view->cy) / view->fy}};
    for (int i = 0; i < PIXEL_LANES; i++) {
        double dir[3] = {(x0 + i % BLOCK_PIXELS - view->cx) / view->fx,
                         (y0 + i / BLOCK_PIXELS - view->cy) / view->fy, 1};
        length[i] = (float)dvec_length(dir);
        dvec_normalize(dir);
        dmat_apply_transposed(view->rotation, dir, dir);
        for (int k = 0; k < 3; k++)
            dir[k] = rounded_to_float(dir[k]); /* the ray that the tracer is given */
        dmat_apply(view->rotation, dir, dir);
        a[i] = (float)(dir[0] / dir[2] - r.middle[0]);
        b[i] = (float)(dir[1] / dir[2] - r.middle[1]);
    }
    r.a = vfloat16_load(a);
    r.b = vfloat16_load(b);
    r.length = vfloat16_load(length);
    r.depth_near = vfloat16_div(vfloat16_set1(view->settings.near), r.length);
    return r;
}

static inline vfloat16 dot_rays(const vfloat16 a[3], const vfloat16 b[3])
{
    return vfloat16_fma(a[0], b[0], vfloat16_fma(a[1], b[1], vfloat16_mul(a[2], b[2])));
}

static inline ray_response ray_respond(const ray_splat *g, float opacity, const block_rays *rays,
                                       float t_near)
{
    ray_response r = {.da = vfloat16_sub(rays->a, vfloat16_set1((float)(g->a0 - rays->middle[0]))),
                      .db = vfloat16_sub(rays->b, vfloat16_set1((float)(g->b0 - rays->middle[1])))};
    vfloat16 y[3];
    for (int k = 0; k < 3; k++) {
        const vfloat16 p =
            vfloat16_fma(vfloat16_set1(g->wa[k]), r.da, vfloat16_mul(vfloat16_set1(g->wb[k]), r.db));
        r.w[k] = vfloat16_add(vfloat16_set1(g->w0[k]), p);
        y[k] = vfloat16_fma(vfloat16_set1(g->depth_per_sigma), p, vfloat16_set1(g->y0[k]));
    }
    vfloat16 step = vfloat16_sub(vfloat16_set1(0), vfloat16_div(dot_rays(y, r.w), dot_rays(r.w, r.w)));
    const vfloat16 near_step = vfloat16_mul(vfloat16_sub(rays->depth_near, vfloat16_set1(g->depth)),
                                            vfloat16_set1(g->sigma_inverse));
    r.clipped = vfloat16_le(step, near_step);
    step = vfloat16_select(r.clipped, near_step, step);
    for (int k = 0; k < 3; k++)
        r.v[k] = vfloat16_fma(step, r.w[k], y[k]);
    r.t = vfloat16_select(
        r.clipped, vfloat16_set1(t_near),
        vfloat16_mul(vfloat16_fma(step, vfloat16_set1(g->sigma), vfloat16_set1(g->depth)), rays->length));
    const vfloat16 exponent = vfloat16_mul(vfloat16_set1((float)-HALF_LOG2_E), dot_rays(r.v, r.v));
    r.raw = vfloat16_mul(vfloat16_set1(opacity),
                         vfloat16_exp2(vfloat16_max(exponent, vfloat16_set1(EXP2_LEAST))));
    return r;
}

/* Computes v at an interior depth again, for the adjoint: v = w x (y x w) / |w|^2 with y x w = m/sigma (da wa
   x w0 + db wb x w0), as the rest cancels exactly. On a flat Gaussian the v of ray_respond() is a small
   difference of large numbers along the thin axis. d2 is not affected by that, but the gradients of mean and
   rotation, which are divided by the thin axis, are. Not where y0 is part of y. */
static inline void refine_v(const ray_splat *g, ray_response *r)
{
    double a[3], b[3];
    const double wa[3] = {(double)g->wa[0], (double)g->wa[1], (double)g->wa[2]};
    const double wb[3] = {(double)g->wb[0], (double)g->wb[1], (double)g->wb[2]};
    const double w0[3] = {(double)g->w0[0], (double)g->w0[1], (double)g->w0[2]};
    if (g->depth == 0)
        return;
    dvec_cross(wa, w0, a);
    dvec_cross(wb, w0, b);
    vfloat16 c[3];
    for (int k = 0; k < 3; k++)
        c[k] =
            vfloat16_fma(vfloat16_set1((float)a[k]), r->da, vfloat16_mul(vfloat16_set1((float)b[k]), r->db));
    const vfloat16 scale = vfloat16_div(vfloat16_set1(g->depth_per_sigma), dot_rays(r->w, r->w));
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const vfloat16 v =
            vfloat16_mul(scale, vfloat16_sub(vfloat16_mul(r->w[i], c[j]), vfloat16_mul(r->w[j], c[i])));
        r->v[k] = vfloat16_select(r->clipped, r->v[k], v);
    }
}

/* Which blocks every entry of the tile reaches. False when memory ran out. */
static inline bool find_reached(const tile_job *job, ray_scratch *scratch)
{
    if (mem_reserve((void **)&scratch->reached, &scratch->reached_capacity, 0, job->count,
                    sizeof *scratch->reached, "entries of a tile", NULL) != GBT_OK)
        return false;
    for (size_t e = 0; e < job->count; e++) {
        const splat *s = &job->splats[job->entries[e].splat];
        float at[2];
        splat_in_tile(job, s, at);
        scratch->reached[e] = (uint16_t)reached_squares(s, at[0], at[1], BLOCK_PIXELS);
    }
    return true;
}

/* All hits of a block. False when memory ran out. */
static inline bool gather_rows(tile_job *job, int block, const block_rays *rays, ray_scratch *scratch,
                               size_t *count)
{
    const raster_settings *settings = &job->view->settings;
    const vmask16 inside = vmask16_from_bits(pixels_inside(job, block));
    *count = 0;
    for (size_t e = 0; e < job->count; e++) {
        const splat *s = &job->splats[job->entries[e].splat];
        if ((scratch->reached[e] >> block & 1) == 0)
            continue;
        const ray_response r =
            ray_respond(&job->rays[job->entries[e].splat], s->opacity, rays, settings->near);
        const vmask16 hit = vmask16_and(vfloat16_le(vfloat16_set1(settings->alpha_min), r.raw), inside);
        if (!vmask16_any(hit))
            continue;
        if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, *count, *count + 1, sizeof(ray_row),
                        "rows of a block", NULL) != GBT_OK)
            return false;
        ray_row *row = &scratch->rows[(*count)++];
        vfloat16_store(row->t, r.t),
            vfloat16_store(row->alpha,
                           vfloat16_select(hit, vfloat16_min(r.raw, vfloat16_set1(settings->alpha_max)),
                                           vfloat16_set1(0)));
        row->entry = (uint32_t)e;
    }
    return mem_reserve((void **)&scratch->hits, &scratch->hit_capacity, 0, *count, sizeof(splat_hit),
                       "hits of a ray", NULL) == GBT_OK;
}

static int compare_hits(const void *a, const void *b)
{
    const splat_hit *p = a, *q = b;
    return (p->key > q->key) - (p->key < q->key);
}

/* Insertion sort, because the list of the tile is nearly in this order already; qsort() if it takes too many
   moves. */
static inline void sort_ray(splat_hit *hits, size_t count)
{
    size_t moves = 16 * count;
    for (size_t i = 1; i < count; i++) {
        const splat_hit moved = hits[i];
        size_t j = i;
        for (; j > 0 && hits[j - 1].key > moved.key; j--)
            hits[j] = hits[j - 1];
        hits[j] = moved;
        if (i - j > moves) {
            qsort(hits, count, sizeof *hits, compare_hits);
            return;
        }
        moves -= i - j;
    }
}

static inline size_t hits_of_ray(const tile_job *job, const ray_scratch *scratch, size_t row_count, int lane)
{
    size_t count = 0;
    for (size_t i = 0; i < row_count; i++) {
        const ray_row *row = &scratch->rows[i];
        if (!(row->alpha[lane] > 0))
            continue;
        uint32_t bits = row->entry;
        if (!job->view->settings.order_by_center)
            memcpy(&bits, &row->t[lane], sizeof bits);
        scratch->hits[count++] =
            (splat_hit){(uint64_t)bits << 32 | job->splats[job->entries[row->entry].splat].id, (uint32_t)i};
    }
    sort_ray(scratch->hits, count);
    return count;
}

static inline const float *row_color(const tile_job *job, const ray_scratch *scratch, const splat_hit *hit)
{
    return job->splats[job->entries[scratch->rows[hit->row].entry].splat].color;
}

/* Front to back. Returns how many hits were blended. */
static inline size_t blend_ray(const tile_job *job, const ray_scratch *scratch, size_t count, int lane,
                               float rgb[3], float *transmittance)
{
    size_t i = 0;
    float T = 1;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (; i < count; i++) {
        const float alpha = scratch->rows[scratch->hits[i].row].alpha[lane], next = fmaf(-T, alpha, T);
        const float *color = row_color(job, scratch, &scratch->hits[i]);
        if (next < job->view->settings.transmittance_min)
            break;
        for (int c = 0; c < 3; c++)
            rgb[c] = fmaf(T * alpha, color[c], rgb[c]);
        T = next;
    }
    *transmittance = T;
    return i;
}

static bool forward_rays(tile_job *job, ray_scratch *scratch)
{
    if (!find_reached(job, scratch))
        return false;
    for (int block = 0; block < TILE_BLOCKS; block++) {
        const block_rays rays = rays_of(job, block);
        size_t row_count;
        if (!gather_rows(job, block, &rays, scratch, &row_count))
            return false;
        for (int lane = 0; lane < PIXEL_LANES; lane++) {
            float rgb[3], *T = &job->pixels->transmittance[block][lane];
            const size_t count = hits_of_ray(job, scratch, row_count, lane);
            job->blended += blend_ray(job, scratch, count, lane, rgb, T);
            for (int c = 0; c < 3; c++)
                job->pixels->rgb[block][c][lane] = fmaf(*T, job->pixels->background[block][c][lane], rgb[c]);
        }
    }
    return true;
}

/* Back to front; t and alpha of the ray's rows become dL/dalpha and T alpha, 0 where nothing was blended. */
static inline void blend_ray_adjoint(tile_job *job, ray_scratch *scratch, size_t row_count, int block,
                                     int lane, const float d_rgb[3])
{
    float rgb[3], T, behind = 0;
    const size_t count = hits_of_ray(job, scratch, row_count, lane),
                 blended = blend_ray(job, scratch, count, lane, rgb, &T);
    for (int c = 0; c < 3; c++)
        behind = fmaf(d_rgb[c], job->pixels->background[block][c][lane], behind);
    for (size_t i = 0; i < row_count; i++)
        scratch->rows[i].t[lane] = 0;
    for (size_t i = count; i-- > 0;) {
        ray_row *row = &scratch->rows[scratch->hits[i].row];
        const float alpha = row->alpha[lane], *color = row_color(job, scratch, &scratch->hits[i]);
        if (i >= blended) {
            row->alpha[lane] = 0;
            continue;
        }
        const float difference = color[0] * d_rgb[0] + color[1] * d_rgb[1] + color[2] * d_rgb[2] - behind;
        T /= 1 - alpha;
        behind = fmaf(alpha, difference, behind);
        row->t[lane] = T * difference;
        row->alpha[lane] = T * alpha;
    }
}

/* Adds the terms of a row, summed over the rays of a block, to the record of its splat. */
static inline void add_row(const tile_job *job, const ray_row *row, const block_rays *rays,
                           const vfloat16 d_rgb[3])
{
    const tile_entry *entry = &job->entries[row->entry];
    const splat *s = &job->splats[entry->splat];
    ray_response r = ray_respond(&job->rays[entry->splat], s->opacity, rays, job->view->settings.near);
    refine_v(&job->rays[entry->splat], &r);
    const vfloat16 zero = vfloat16_set1(0), weight = vfloat16_load(row->alpha),
                   d_alpha = vfloat16_load(row->t);
    const vmask16 moves = vmask16_and(vfloat16_lt(r.raw, vfloat16_set1(job->view->settings.alpha_max)),
                                      vfloat16_lt(zero, weight));
    const vfloat16 q = vfloat16_select(moves, vfloat16_mul(r.raw, d_alpha), zero);
    vfloat16 v[3], sum[RAY_SUMS];
    for (int k = 0; k < 3; k++)
        v[k] = vfloat16_select(moves, r.v[k], zero); /* v may be anything on rays that do not hit */
    sum[0] = q;
    for (int k = 0; k < 3; k++) {
        sum[1 + k] = vfloat16_mul(q, v[k]);
        sum[4 + k] = vfloat16_mul(sum[1 + k], v[k]);
        sum[RAY_COLOR + k] = vfloat16_mul(weight, d_rgb[k]);
    }
    sum[RAY_WEIGHT] = weight;
    sum[7] = vfloat16_mul(sum[2], v[2]);
    sum[8] = vfloat16_mul(sum[3], v[0]);
    sum[9] = vfloat16_mul(sum[1], v[1]);
    float total[RAY_SUMS], *record = job->records + (size_t)entry->pair * RAY_SUMS;
    store_sums(sum, RAY_SUMS, total);
    for (int k = 0; k < RAY_SUMS; k++)
        record[k] += total[k];
}

static bool backward_rays(tile_job *job, ray_scratch *scratch)
{
    if (!find_reached(job, scratch))
        return false;
    for (size_t e = 0; e < job->count; e++)
        memset(job->records + (size_t)job->entries[e].pair * RAY_SUMS, 0, RAY_SUMS * sizeof(float));
    for (int block = 0; block < TILE_BLOCKS; block++) {
        const block_rays rays = rays_of(job, block);
        const unsigned inside = pixels_inside(job, block);
        vfloat16 d_rgb[3];
        size_t row_count;
        if (!gather_rows(job, block, &rays, scratch, &row_count))
            return false;
        for (int c = 0; c < 3; c++)
            d_rgb[c] = vfloat16_load(job->pixels->rgb[block][c]);
        for (int lane = 0; lane < PIXEL_LANES; lane++) {
            const float d[3] = {job->pixels->rgb[block][0][lane], job->pixels->rgb[block][1][lane],
                                job->pixels->rgb[block][2][lane]};
            if (inside >> lane & 1)
                blend_ray_adjoint(job, scratch, row_count, block, lane, d);
        }
        /* Lanes outside the image have no hits: their alpha is 0 in all rows, so that their t is not read as
           a gradient. */
        for (size_t i = 0; i < row_count; i++)
            add_row(job, &scratch->rows[i], &rays, d_rgb);
    }
    return true;
}

#endif
