/* SPDX-License-Identifier: Apache-2.0 */
/* raster/ewa16.h -- the EWA form: the splats of a tile blended in the order of its list, and the adjoint.

   The forward pass takes the list in chunks: which blocks each splat reaches, then block by block, with the
   pixels in registers. The adjoint goes back to front, splat by splat, so that the sums of a splat over the
   blocks of the tile stay in registers; T in front of a splat is T behind it / (1 - alpha), starting from
   what the tape has kept. Included by kernel.inc.h. */
#ifndef GBT_RASTER_EWA16_H
#define GBT_RASTER_EWA16_H

#include "raster/reach16.h"

enum { CHUNK = 128 };

/* One splat on the sixteen pixels of a block. */
typedef struct ewa_response {
    vfloat16 u, v, raw; /* raw: alpha before it is cut at alpha_max */
} ewa_response;

static inline ewa_response ewa_respond(const splat *s, float x, float y, int block)
{
    ewa_response r;
    const float block_x = x - (float)(block % BLOCKS_ACROSS * BLOCK_PIXELS),
                block_y = y - (float)(block / BLOCKS_ACROSS * BLOCK_PIXELS);
    const vfloat16 dx = vfloat16_sub(vfloat16_set1(block_x), vfloat16_load(lane_column)),
                   dy = vfloat16_sub(vfloat16_set1(block_y), vfloat16_load(lane_row));
    r.u = vfloat16_fma(vfloat16_set1(s->chol[0]), dx, vfloat16_mul(vfloat16_set1(s->chol[1]), dy));
    r.v = vfloat16_mul(vfloat16_set1(s->chol[2]), dy);
    const vfloat16 square = vfloat16_fma(r.u, r.u, vfloat16_mul(r.v, r.v));
    r.raw = vfloat16_mul(
        vfloat16_set1(s->opacity),
        vfloat16_exp2(vfloat16_max(vfloat16_sub(vfloat16_set1(0), square), vfloat16_set1(EXP2_LEAST))));
    return r;
}

/* Centre of a splat, from the tile's first pixel. */
static inline void splat_in_tile(const tile_job *job, const splat *s, float out[2])
{
    out[0] = (float)(s->center[0] - job->x0);
    out[1] = (float)(s->center[1] - job->y0);
}

/* Bit per pixel of a block that lies in the image. */
static inline unsigned pixels_inside(const tile_job *job, int block)
{
    const int columns = job->view->width - job->x0 - block % BLOCKS_ACROSS * BLOCK_PIXELS;
    const int rows = job->view->height - job->y0 - block / BLOCKS_ACROSS * BLOCK_PIXELS;
    if (columns <= 0 || rows <= 0)
        return 0;
    return (0xFu >> (columns < 4 ? 4 - columns : 0)) * 0x1111u &
           (rows < 4 ? 0xFFFFu >> (16 - 4 * rows) : 0xFFFFu);
}

typedef struct ewa_block {
    vfloat16 rgb[3], transmittance, stop;
    vmask16 alive;
} ewa_block;

typedef struct ewa_chunk {
    const splat *splats[CHUNK];
    float at[CHUNK][2];
    uint8_t list[TILE_BLOCKS][CHUNK]; /* entries that reach each block */
    int count[TILE_BLOCKS];
} ewa_chunk;

static inline void blend_block(tile_job *job, const ewa_chunk *chunk, size_t first, int block,
                               ewa_block *state)
{
    ewa_block b = *state; /* a copy, which can stay in registers */
    uint16_t *const blocks = job->blocks;
    const raster_settings *settings = &job->view->settings;
    const vfloat16 alpha_min = vfloat16_set1(settings->alpha_min),
                   alpha_max = vfloat16_set1(settings->alpha_max),
                   stop_at = vfloat16_set1(settings->transmittance_min);
    const vfloat16 zero = vfloat16_set1(0);
    uint64_t blended = 0;
    for (int i = 0; i < chunk->count[block]; i++) {
        const int e = chunk->list[block][i];
        const splat *s = chunk->splats[e];
        const ewa_response r = ewa_respond(s, chunk->at[e][0], chunk->at[e][1], block);
        vmask16 hit = vmask16_and(vfloat16_le(alpha_min, r.raw), b.alive);
        if (!vmask16_any(hit))
            continue;
        vfloat16 alpha = vfloat16_select(hit, vfloat16_min(r.raw, alpha_max), zero),
                 next = vfloat16_fnma(b.transmittance, alpha, b.transmittance);
        const vmask16 stop = vmask16_and(vfloat16_lt(next, stop_at), hit);
        if (vmask16_any(stop)) {
            hit = vmask16_andnot(stop, hit);
            b.alive = vmask16_andnot(stop, b.alive);
            b.stop = vfloat16_select(stop, vfloat16_set1((float)(first + (size_t)e)), b.stop);
            alpha = vfloat16_select(hit, alpha, zero);
            next = vfloat16_select(stop, b.transmittance, next);
        }
        const vfloat16 weight = vfloat16_mul(b.transmittance, alpha);
        for (int c = 0; c < 3; c++)
            b.rgb[c] = vfloat16_fma(weight, vfloat16_set1(s->color[c]), b.rgb[c]);
        b.transmittance = next;
        blended += (uint64_t)__builtin_popcount(vmask16_bits(hit));
        if (blocks != NULL && vmask16_any(hit))
            blocks[first + (size_t)e] |= (uint16_t)(1u << block);
        if (vmask16_any(stop) && !vmask16_any(b.alive))
            break;
    }
    *state = b;
    job->blended += blended;
}

/* Lists, for each block in `open`, the splats of a chunk that reach it. */
static inline void take_chunk(const tile_job *job, size_t first, size_t count, unsigned open,
                              ewa_chunk *chunk)
{
    memset(chunk->count, 0, sizeof chunk->count);
    for (size_t e = 0; e < count; e++) {
        const splat *s = chunk->splats[e] = &job->splats[job->entries[first + e].splat];
        __builtin_prefetch(
            &job->splats[job->entries[first + e + 8 < job->count ? first + e + 8 : first].splat]);
        splat_in_tile(job, s, chunk->at[e]);
        for (unsigned bits = reached_squares(s, chunk->at[e][0], chunk->at[e][1], BLOCK_PIXELS) & open;
             bits != 0; bits &= bits - 1) {
            const int block = __builtin_ctz(bits);
            chunk->list[block][chunk->count[block]++] = (uint8_t)e;
        }
    }
}

static bool forward_ewa(tile_job *job, ray_scratch *scratch)
{
    (void)scratch;
    ewa_block state[TILE_BLOCKS];
    ewa_chunk chunk;
    unsigned open = 0;
    for (int block = 0; block < TILE_BLOCKS; block++) {
        const vfloat16 zero = vfloat16_set1(0);
        const unsigned inside = pixels_inside(job, block);
        /* Pixels outside the image have stopped before the first entry. */
        const vfloat16 stop =
            vfloat16_select(vmask16_from_bits(inside), vfloat16_set1(INFINITY), vfloat16_set1(-1));
        state[block] = (ewa_block){{zero, zero, zero}, vfloat16_set1(1), stop, vmask16_from_bits(inside)};
        open |= (unsigned)(inside != 0) << block;
    }
    size_t first = 0;
    for (; first < job->count && open != 0; first += CHUNK) {
        const size_t count = job->count - first < CHUNK ? job->count - first : CHUNK;
        take_chunk(job, first, count, open, &chunk);
        if (job->blocks != NULL)
            memset(job->blocks + first, 0, count * sizeof *job->blocks);
        for (unsigned bits = open; bits != 0; bits &= bits - 1) {
            const int block = __builtin_ctz(bits);
            blend_block(job, &chunk, first, block, &state[block]);
            open &= ~((unsigned)!vmask16_any(state[block].alive) << block);
        }
    }
    for (int block = 0; block < TILE_BLOCKS; block++) {
        const ewa_block *b = &state[block];
        for (int c = 0; c < 3; c++)
            vfloat16_store(
                job->pixels->rgb[block][c],
                vfloat16_fma(b->transmittance, vfloat16_load(job->pixels->background[block][c]), b->rgb[c]));
        vfloat16_store(job->pixels->transmittance[block], b->transmittance);
        if (job->tape != NULL)
            vfloat16_store(job->tape->transmittance[block], b->transmittance),
                vfloat16_store(job->tape->stop[block], b->stop);
    }
    if (job->tape != NULL)
        job->tape->used = first < job->count ? first : job->count;
    return true;
}

/* The pixels of a block in the adjoint. */
typedef struct ewa_adjoint_state {
    vfloat16 transmittance; /* T behind the splat at hand */
    vfloat16 behind;        /* g . B: B the colour behind the splat, divided by T there; g = dL/d(rgb) */
    vfloat16 d_rgb[3], stop;
} ewa_adjoint_state;

static inline void blend_splat_adjoint(const tile_job *job, const splat *s, const float at[2], int block,
                                       vfloat16 number, ewa_adjoint_state *b, vfloat16 sum[EWA_SUMS])
{
    const raster_settings *settings = &job->view->settings;
    const vfloat16 alpha_max = vfloat16_set1(settings->alpha_max), zero = vfloat16_set1(0);
    const ewa_response r = ewa_respond(s, at[0], at[1], block);
    const vmask16 hit =
        vmask16_and(vfloat16_le(vfloat16_set1(settings->alpha_min), r.raw), vfloat16_lt(number, b->stop));
    const vfloat16 alpha = vfloat16_select(hit, vfloat16_min(r.raw, alpha_max), zero);
    vfloat16 color = vfloat16_mul(vfloat16_set1(s->color[0]), b->d_rgb[0]);
    for (int c = 1; c < 3; c++)
        color = vfloat16_fma(vfloat16_set1(s->color[c]), b->d_rgb[c], color);
    const vfloat16 difference = vfloat16_sub(color, b->behind);
    b->transmittance = vfloat16_div(b->transmittance, vfloat16_sub(vfloat16_set1(1), alpha));
    b->behind = vfloat16_fma(alpha, difference, b->behind);
    const vfloat16 weight = vfloat16_mul(b->transmittance, alpha);
    const vfloat16 q = vfloat16_select(vfloat16_lt(r.raw, alpha_max), vfloat16_mul(weight, difference), zero),
                   qu = vfloat16_mul(q, r.u), qv = vfloat16_mul(q, r.v);
    sum[0] = vfloat16_add(sum[0], q);
    sum[1] = vfloat16_add(sum[1], qu);
    sum[2] = vfloat16_add(sum[2], qv);
    sum[3] = vfloat16_fma(qu, r.u, sum[3]);
    sum[4] = vfloat16_fma(qu, r.v, sum[4]);
    sum[5] = vfloat16_fma(qv, r.v, sum[5]);
    for (int c = 0; c < 3; c++)
        sum[EWA_COLOR + c] = vfloat16_fma(weight, b->d_rgb[c], sum[EWA_COLOR + c]);
    sum[EWA_WEIGHT] = vfloat16_add(sum[EWA_WEIGHT], weight);
}

/* Sums each of `count` rows over its lanes. */
static inline void store_sums(const vfloat16 *sum, int count, float *out)
{
    _Alignas(64) float total[16];
    vfloat16 rows[16];
    for (int k = 0; k < 16; k++)
        rows[k] = k < count ? sum[k] : vfloat16_set1(0);
    vfloat16_store(total, vfloat16_sum_rows(rows));
    memcpy(out, total, (size_t)count * sizeof *out);
}

static bool backward_ewa(tile_job *job, ray_scratch *scratch)
{
    (void)scratch;
    ewa_adjoint_state state[TILE_BLOCKS];
    for (int block = 0; block < TILE_BLOCKS; block++) {
        ewa_adjoint_state *b = &state[block];
        b->transmittance = vfloat16_load(job->tape->transmittance[block]);
        b->stop = vfloat16_load(job->tape->stop[block]);
        b->behind = vfloat16_set1(0);
        for (int c = 0; c < 3; c++) {
            b->d_rgb[c] = vfloat16_load(job->pixels->rgb[block][c]);
            b->behind =
                vfloat16_fma(b->d_rgb[c], vfloat16_load(job->pixels->background[block][c]), b->behind);
        }
    }
    for (size_t e = job->count; e-- > 0;) {
        const splat *s = &job->splats[job->entries[e].splat];
        float *record = job->records + (size_t)job->entries[e].pair * EWA_SUMS, at[2];
        __builtin_prefetch(&job->splats[job->entries[e > 4 ? e - 4 : 0].splat]);
        __builtin_prefetch(job->records + (size_t)job->entries[e > 4 ? e - 4 : 0].pair * EWA_SUMS, 1);
        unsigned bits = e < job->tape->used ? job->blocks[e] : 0;
        if (bits == 0) {
            memset(record, 0, EWA_SUMS * sizeof *record);
            continue;
        }
        vfloat16 sum[EWA_SUMS];
        for (int k = 0; k < EWA_SUMS; k++)
            sum[k] = vfloat16_set1(0);
        splat_in_tile(job, s, at);
        for (; bits != 0; bits &= bits - 1) {
            const int block = __builtin_ctz(bits);
            blend_splat_adjoint(job, s, at, block, vfloat16_set1((float)e), &state[block], sum);
        }
        store_sums(sum, EWA_SUMS, record);
    }
    return true;
}

#endif
