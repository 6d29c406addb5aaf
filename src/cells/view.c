/* SPDX-License-Identifier: Apache-2.0 */
/* cells/view.c -- a view of a store: its rays and their intervals, the chunks that it may see. */
#include "cells/view.h"

#include <math.h>
#include <stdatomic.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { RAY_BLOCK = 4096 };

/* What the program itself takes, with the buffers of threads and files; and the least for a cell. */
static const size_t base_bytes = (size_t)128 << 20, cell_bytes_least = (size_t)48 << 20;

/* Most for one cell: lists number records, and pairs of Gaussian and tile, in 32 bits. */
static const size_t cell_bytes_most = (size_t)64 << 30;

/* Per pixel: directions in world and in camera axes, intervals, colours of the cell and of the picture, and
   the picture as it is written; layers, where there are shares. */
enum { PIXEL_BYTES = 120, PIXEL_LAYER_BYTES = 80 };

size_t cell_memory_whole(size_t count, uint64_t file_bytes)
{
    const size_t cloud = 236 * count, drawing = 400 * count;
    return base_bytes + cloud + (drawing > file_bytes ? drawing : (size_t)file_bytes);
}

cell_part cell_whole(void)
{
    return (cell_part){.low = {-INFINITY, -INFINITY, -INFINITY}, .high = {INFINITY, INFINITY, INFINITY}};
}

static cell_part child_of(const cell_store *store, const cell_part *of, bool below)
{
    const cell_cut *cut = &store->cuts[of->node];
    cell_part child = *of;
    child.half_space[child.depth++] = (struct cell_half_space){cut->axis, cut->at, below};
    child.node = 2 * of->node + (below ? 1 : 2);
    if (below)
        child.high[cut->axis] = cut->at;
    else
        child.low[cut->axis] = cut->at;
    return child;
}

cell_part cell_child_from_eye(const cell_drawer *d, const cell_part *of, int k)
{
    const cell_cut *cut = &d->store->cuts[of->node];
    const bool from_below = d->rays.origin[cut->axis] < cut->at;
    return child_of(d->store, of, (k == 0) == from_below);
}

/* ---- intervals ---- */

typedef struct cut_job {
    cell_drawer *d;
    const cell_part *part;
    atomic_size_t seeing;
} cut_job;

/* The parts on both sides of a cut find the t of the cut by the same operations, so that their intervals
   touch exactly. */
static void cut_rays(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    cut_job *job = context;
    const ray_image *rays = &job->d->rays;
    const float *eye = rays->origin;
    size_t seeing = 0;
    for (size_t i = begin; i < end; i++) {
        float near = 0, far = INFINITY;
        for (int k = 0; k < job->part->depth; k++) {
            const struct cell_half_space *plane = &job->part->half_space[k];
            const float along = rays->dir[3 * i + (size_t)plane->axis];
            const bool from_below = eye[plane->axis] < plane->at,
                       crosses = from_below ? along > 0 : along < 0;
            const float t = crosses ? (plane->at - eye[plane->axis]) / along : INFINITY;
            if (plane->below == from_below)
                far = t < far ? t : far;
            else
                near = t > near ? t : near;
        }
        if (job->d->stopped[i] != 0)
            far = 0;
        rays->near[i] = near;
        rays->far[i] = far;
        seeing += near < far;
    }
    atomic_fetch_add(&job->seeing, seeing);
}

size_t cell_view_cut(cell_drawer *d, const cell_part *part)
{
    cut_job job = {.d = d, .part = part};
    atomic_init(&job.seeing, 0);
    parallel_blocks(ray_image_count(&d->rays), RAY_BLOCK, cut_rays, &job);
    return atomic_load(&job.seeing);
}

/* ---- the view ---- */

static gbt_status reserve_rays(cell_drawer *d, gbt_error *err)
{
    const size_t count = ray_image_count(&d->rays);
    ray_image *rays = &d->rays;
    float **const floats[] = {&rays->near, &rays->far, &rays->T_front, &d->T_behind};
    unsigned char **const bytes[] = {&d->stopped, &d->stopped_here};
    if (d->part.width != rays->width || d->part.height != rays->height || rays->near == NULL) {
        image_free(&d->part);
        GBT_TRY(image_alloc(&d->part, rays->width, rays->height, 3, err));
        for (int k = 0; k < 4; k++) {
            mem_free(*floats[k]);
            *floats[k] = mem_alloc(count, sizeof **floats[k], "parts of rays", err);
            if (*floats[k] == NULL)
                return GBT_ERR_NO_MEMORY;
        }
        for (int k = 0; k < 2; k++) {
            mem_free(*bytes[k]);
            *bytes[k] = mem_alloc(count, 1, "parts of rays", err);
            if (*bytes[k] == NULL)
                return GBT_ERR_NO_MEMORY;
        }
    }
    for (size_t i = 0; i < count; i++) {
        rays->T_front[i] = d->share_T_front != NULL ? d->share_T_front[i] : 1;
        d->stopped[i] = !(rays->T_front[i] > 0);
        rays->near[i] = 0;
        rays->far[i] = INFINITY;
    }
    return GBT_OK;
}

/* A ball that contains all that the Gaussians of a chunk reach. */
static void chunk_ball(const cell_drawer *d, const cell_chunk *c, float center[3], float *scale_log)
{
    float square = 0, sigma = 0;
    for (int k = 0; k < 3; k++) {
        const float half = 0.5f * (c->high[k] - c->low[k]);
        center[k] = c->low[k] + half;
        square += half * half;
        sigma += c->sigma[k] * c->sigma[k];
    }
    const float radius = sqrtf(square) * 1.001f;
    const float scale = radius / d->reach.sigmas + sqrtf(sigma) + d->reach.width * d->reach.pixel * radius;
    *scale_log = logf(fmaxf(scale, 1e-30f));
}

static gbt_status find_chunks(cell_drawer *d, gbt_error *err)
{
    const cell_store *store = d->store;
    gaussian_cloud balls;
    GBT_TRY(gaussian_cloud_alloc(&balls, store->chunk_count, err));
    for (size_t i = 0; i < store->chunk_count; i++) {
        const cell_chunk none = {0}, *c = store->chunks[i].count > 0 ? &store->chunks[i] : &none;
        chunk_ball(d, c, balls.mean + 3 * i, &balls.scale_log[3 * i]);
        balls.scale_log[3 * i + 1] = balls.scale_log[3 * i + 2] = balls.scale_log[3 * i];
    }
    const gbt_status status = visible_find(frame_plain(&balls), &d->bounds, &d->reach, NULL, NULL,
                                           &d->visible, &d->visible_count, &d->visible_capacity, err);
    gaussian_cloud_free(&balls);
    return status;
}

static gbt_status find_budget(cell_drawer *d, gbt_error *err)
{
    const size_t pixel = PIXEL_BYTES + (d->share.count > 1 ? PIXEL_LAYER_BYTES : 0);
    const size_t pixels = ray_image_count(&d->rays), least = base_bytes + cell_bytes_least + pixel * pixels;
    if (d->memory < least)
        return base_fail(err, GBT_ERR_NO_MEMORY,
                         "memory: %zu MiB is too little for a picture of %d x %d (wanted %zu MiB)",
                         d->memory >> 20, d->rays.width, d->rays.height, (least >> 20) + 1);
    d->budget = d->memory - base_bytes - pixel * pixels;
    if (d->cell_bytes > 0 && d->cell_bytes < d->budget)
        d->budget = d->cell_bytes;
    if (d->budget > cell_bytes_most)
        d->budget = cell_bytes_most;
    return GBT_OK;
}

gbt_status cell_view_start(cell_drawer *d, const ray_shot *shot, gbt_error *err)
{
    GBT_TRY(ray_shot_check(shot, err));
    if (ray_shot_sample_count(shot) > 1 || shot->aperture_radius > 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "picture: an open aperture cannot be drawn within a memory limit (wanted no limit, "
                         "or a pinhole)");
    ray_image_free(&d->rays); /* with the lenses of other pictures, which PIXEL_BYTES does not count */
    GBT_TRY(ray_image_from_shot(shot, 0, &d->rays, err));
    if (!d->rays.common_origin)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "picture: a rolling shutter or an orthographic camera cannot be drawn within a "
                         "memory limit (wanted no limit, or rays from one point)");
    GBT_TRY(find_budget(d, err));
    GBT_TRY(reserve_rays(d, err));
    GBT_TRY(view_bounds_find(shot, &d->rays, &d->bounds, err));
    const camera_lens *lens = d->rays.lens.fx > 0 ? &d->rays.lens : NULL;
    d->view = footprint_view_with(&shot->camera, lens);
    d->reach = (visible_reach){.sigmas = 1.001f * sqrtf(2 * logf(1 / d->settings.alpha_min)),
                               .width = sqrtf(d->variance),
                               .pixel = (float)d->view.pixel};
    return find_chunks(d, err);
}
