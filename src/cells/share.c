/* SPDX-License-Identifier: Apache-2.0 */
/* cells/share.c -- a picture in shares, each a run of cells from front to back: which chunks a share has, and
   how the layers of the shares are blended. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "cells/view.h"

/* ---- which cells ---- */

typedef struct share_walk {
    cell_drawer *d;
    const size_t *weight;   /* [chunk_count] */
    size_t in_front, total; /* of the weights */
} share_walk;

/* Visits the chunks from the eye on. A chunk belongs to the share whose part of the summed weights holds the
   sum over the chunks in front of it. The last share also has the chunks of weight 0 behind all others, which
   are out of view: Gaussians of nearer chunks may reach into them. */
static void walk_part(share_walk *w, const cell_part *part)
{
    cell_drawer *d = w->d;
    if (cell_is_chunk(d->store, part)) {
        const size_t count = (size_t)d->share.count, last = count - 1,
                     wanted = w->total > 0 ? w->in_front * count / w->total : 0,
                     of = wanted < last ? wanted : last;
        w->in_front += w->weight[part->node - (d->store->chunk_count - 1)];
        d->first += of < (size_t)d->share.index;
        d->end += of <= (size_t)d->share.index;
        return;
    }
    for (int k = 0; k < 2; k++) {
        const cell_part child = cell_child_from_eye(d, part, k);
        walk_part(w, &child);
    }
}

gbt_status cell_share_find(cell_drawer *d, gbt_error *err)
{
    d->first = 0;
    d->end = d->store->chunk_count;
    if (d->share.count <= 1)
        return GBT_OK;
    size_t *weight = mem_calloc(d->store->chunk_count, sizeof *weight, "shares of a picture", err);
    if (weight == NULL)
        return GBT_ERR_NO_MEMORY;
    share_walk walk = {.d = d, .weight = weight};
    for (size_t i = 0; i < d->visible_count; i++) {
        weight[d->visible[i]] = d->store->chunks[d->visible[i]].count;
        walk.total += weight[d->visible[i]];
    }
    const cell_part whole = cell_whole();
    d->end = 0;
    walk_part(&walk, &whole);
    mem_free(weight);
    return GBT_OK;
}

/* ---- layers ---- */

void cell_layer_make(const cell_drawer *d, const image *drawn, float *layer)
{
    for (size_t i = 0; i < ray_image_count(&d->rays); i++) {
        float *out = layer + i * CELL_LAYER_FLOATS;
        for (size_t c = 0; c < 3; c++)
            out[c] = drawn->pixels[3 * i + c];
        out[3] = d->stopped[i] != 0 ? -d->rays.T_front[i] : d->rays.T_front[i];
    }
}

/* Behind the layer in which a ray ends nothing counts. Unless the layers in front have left all of the ray,
   it ends earlier in this layer than it did when the layer was drawn alone: the layer is then left out here,
   and drawn again. */
void cell_layers_blend(const float *const layers[], int count, size_t pixels, float transmittance_min,
                       float *sum, float *share_T_front)
{
    memset(share_T_front, 0, (size_t)count * pixels * sizeof *share_T_front);
    for (size_t i = 0; i < pixels; i++) {
        float *out = sum + i * CELL_LAYER_FLOATS, transmittance = 1;
        bool stopped = false;
        out[0] = out[1] = out[2] = 0;
        for (int k = 0; k < count && !stopped; k++) {
            const float *in = layers[k] + i * CELL_LAYER_FLOATS;
            stopped = in[3] < 0 || transmittance * in[3] < transmittance_min;
            if (stopped && transmittance < 1) {
                share_T_front[(size_t)k * pixels + i] = transmittance;
                break;
            }
            for (size_t c = 0; c < 3; c++)
                out[c] += transmittance * in[c];
            transmittance *= fabsf(in[3]);
        }
        out[3] = transmittance;
    }
}

void cell_layers_add(const float *const again[], int count, size_t pixels, const float *share_T_front,
                     float *sum)
{
    for (int k = 0; k < count; k++)
        for (size_t i = 0; i < pixels; i++) {
            if (!(share_T_front[(size_t)k * pixels + i] > 0))
                continue;
            const float *in = again[k] + i * CELL_LAYER_FLOATS;
            float *out = sum + i * CELL_LAYER_FLOATS;
            for (size_t c = 0; c < 3; c++)
                out[c] += in[c];
            out[3] = fabsf(in[3]);
        }
}
