/* SPDX-License-Identifier: Apache-2.0 */
/* cells/draw.c -- the cells of a view, front to back.

     node of the store's tree --> no chunk of the share is in it, or no ray has an interval in it: done
          --> its Gaussians fit in the budget: load, trace the intervals of the rays, blend
          --> else its children, the one with the eye first */
#include "cells/draw.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "cells/view.h"

enum { RAY_BLOCK = 4096 };

typedef struct picture {
    cell_drawer *d;
    image *out;
} picture;

/* Adds the colours of the cell to the picture; its transmittance is what rays have in front of the next
   cells. */
static void add_cell(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const picture *p = context;
    cell_drawer *d = p->d;
    for (size_t i = begin; i < end; i++) {
        for (size_t c = 0; c < 3; c++)
            p->out->pixels[3 * i + c] += d->part.pixels[3 * i + c];
        d->rays.T_front[i] = d->T_behind[i];
        d->stopped[i] |= d->stopped_here[i];
    }
}

static void add_background(const picture *p, const float background[3])
{
    for (size_t i = 0; i < ray_image_count(&p->d->rays); i++)
        for (size_t c = 0; c < 3; c++)
            p->out->pixels[3 * i + c] += p->d->rays.T_front[i] * background[c];
}

static gbt_status draw_cell(const picture *p, gbt_error *err)
{
    cell_drawer *d = p->d;
    if (d->load.count == 0)
        return GBT_OK;
    d->drawn_cells++;
    GBT_TRY(trace_build(&d->scene, &d->load.sorted, &d->settings, ray_image_reach(&d->rays), err));
    const trace_outputs wanted = {.rgb = &d->part, .transmittance = d->T_behind, .ended = d->stopped_here};
    GBT_TRY(trace_forward(&d->scene, &d->rays, false, &wanted, NULL, err));
    parallel_blocks(ray_image_count(&d->rays), RAY_BLOCK, add_cell, (void *)p);
    return GBT_OK;
}

/* `first`: how many chunks are in front of the part. */
static gbt_status draw_part(const picture *p, const cell_part *part, size_t first, gbt_error *err)
{
    cell_drawer *d = p->d;
    const size_t chunks = d->store->chunk_count >> part->depth;
    const bool whole = first >= d->first && first + chunks <= d->end;
    bool fits = false;
    if (first >= d->end || first + chunks <= d->first || cell_view_cut(d, part) == 0)
        return GBT_OK;
    if (whole)
        GBT_TRY(cell_load_part(d, part, &fits, err));
    if (fits)
        return draw_cell(p, err);
    if (cell_is_chunk(d->store, part))
        return base_fail(
            err, GBT_ERR_NO_MEMORY,
            "memory: %zu MiB is too little: the Gaussians of one place alone need more than %zu MiB",
            d->memory >> 20, d->budget >> 20);
    for (int k = 0; k < 2; k++) {
        const cell_part child = cell_child_from_eye(d, part, k);
        GBT_TRY(draw_part(p, &child, first + (k == 0 ? 0 : chunks / 2), err));
    }
    return GBT_OK;
}

static gbt_status draw_all(cell_drawer *d, const ray_shot *shot, image *out, gbt_error *err)
{
    const picture p = {d, out};
    const cell_part whole = cell_whole();
    d->drawn_cells = 0;
    GBT_TRY(cell_view_start(d, shot, err));
    GBT_TRY(cell_share_find(d, err));
    GBT_TRY(image_fit(out, d->rays.width, d->rays.height, 3, err));
    memset(out->pixels, 0, 3 * ray_image_count(&d->rays) * sizeof *out->pixels);
    return draw_part(&p, &whole, 0, err);
}

gbt_status cell_draw(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                     const trace_settings *settings, float variance, size_t memory, image *out,
                     gbt_error *err)
{
    d->store = store;
    d->memory = memory;
    d->settings = *settings;
    memset(d->settings.background, 0, sizeof d->settings.background);
    d->variance = variance;
    d->scene.kernel = TRACE_LIST;
    GBT_TRY(draw_all(d, shot, out, err));
    if (d->share.count <= 1)
        add_background(&(picture){d, out}, settings->background);
    return GBT_OK;
}

void cell_drawer_free(cell_drawer *d)
{
    ray_image_free(&d->rays);
    mem_free(d->stopped);
    mem_free(d->stopped_here);
    mem_free(d->T_behind);
    mem_free(d->visible);
    image_free(&d->part);
    trace_scene_free(&d->scene);
    cell_load_free(&d->load);
    memset(d, 0, sizeof *d);
}
