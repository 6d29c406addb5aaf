/* SPDX-License-Identifier: Apache-2.0 */
/* raster/raster.c -- a view of Gaussians, forward and back.

   Gaussians --> splats (project16.h) --> lists of the tiles (order.c) --> tiles (ewa16.h, ray_form16.h)
        --> pixels
   d_image --> tiles --> one record per splat and tile --> gradients.c */
#include "raster/raster.h"

#include <math.h>
#include <stdatomic.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "raster/gradients.h"

struct raster_state {
    raster_view view;
    const raster_kernel *kernel;
    const gaussians *source; /* borrowed from raster_forward() */
    splat *splats;
    ray_splat *rays;
    size_t *drawn; /* splats in each block of SPLAT_GRAIN Gaussians */
    tile_lists lists;
    tile_tape *tapes;
    uint16_t *blocks; /* see tile_job */
    float *records;
    uint64_t *blended; /* per tile */
    size_t splat_capacity, ray_capacity, drawn_capacity, tape_capacity, blocks_capacity, record_capacity,
        blended_capacity;
    bool tape_kept;
};

raster_settings raster_settings_default(void)
{
    return (raster_settings){.alpha_min = 1.0f / 255.0f,
                             .alpha_max = 0.99f,
                             .transmittance_min = 1e-4f,
                             .near = 0.2f,
                             .dilation = 0.3f};
}

static const raster_kernel *kernel_for(cpu_isa isa) { return CPU_VARIANT(raster_kernel, isa); }

static size_t tile_count_of(const raster_view *view)
{
    return (size_t)view->tiles_across * (size_t)view->tiles_down;
}

/* ---- the view ---- */

static gbt_status check_settings(const raster_settings *s, gbt_error *err)
{
    /* The smallest alpha and T: the response is cut off at 2^-120 of the opacity, and the adjoint finds T by
       division. */
    const bool fine = (s->form == RASTER_EWA || s->form == RASTER_PER_RAY) && s->alpha_min >= 1e-30f &&
                      s->alpha_min < 1 && s->alpha_max > 0 && s->alpha_max < 1 &&
                      s->transmittance_min >= 1e-30f && s->transmittance_min < 1 && s->near >= 0 &&
                      isfinite(s->near) && s->dilation >= 0 && s->dilation < 1e6f &&
                      isfinite(s->background[0] + s->background[1] + s->background[2]);
    if (fine)
        return GBT_OK;
    return base_fail(err, GBT_ERR_ARGUMENT,
                     "raster: alpha in [%g, %g], T down to %g, near %g, dilation %g (wanted alpha and T in "
                     "[1e-30, 1), near and dilation >= 0)",
                     (double)s->alpha_min, (double)s->alpha_max, (double)s->transmittance_min,
                     (double)s->near, (double)s->dilation);
}

bool raster_takes(const gbt_camera *camera)
{
    return (camera->model == GBT_CAMERA_PINHOLE || camera->model == GBT_CAMERA_SIMPLE_PINHOLE) &&
           camera_is_still(camera);
}

void raster_limits(const gbt_camera *camera, double low[2], double high[2])
{
    const int side[2] = {camera->width, camera->height};
    const bool one_focal = camera->model == GBT_CAMERA_SIMPLE_PINHOLE;
    for (int k = 0; k < 2; k++) {
        const double focal = camera->params[one_focal ? 0 : k],
                     principal = camera->params[k + (one_focal ? 1 : 2)];
        low[k] = (-0.15 * side[k] - principal) / focal;
        high[k] = (1.15 * side[k] - principal) / focal;
    }
}

static gbt_status make_view(const gbt_camera *camera, const raster_settings *settings, raster_view *out,
                            gbt_error *err)
{
    const bool one_focal = camera->model == GBT_CAMERA_SIMPLE_PINHOLE;
    if (!raster_takes(camera))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "raster: camera model %d%s (wanted SIMPLE_PINHOLE or PINHOLE, standing still: splats are "
            "projected)",
            (int)camera->model, camera_is_still(camera) ? "" : " with a rolling shutter");
    GBT_TRY(check_settings(settings, err));
    const double *p = camera->params;
    *out = (raster_view){.settings = *settings, .width = camera->width, .height = camera->height};
    out->fx = p[0];
    out->fy = one_focal ? p[0] : p[1];
    out->cx = p[one_focal ? 1 : 2] - 0.5;
    out->cy = p[one_focal ? 2 : 3] - 0.5;
    double sum = out->cx + out->cy;
    for (int i = 0; i < 9; i++)
        sum += out->rotation[i] = camera->rotation[i];
    for (int i = 0; i < 3; i++)
        sum += out->center[i] = rounded_to_float(camera->center[i]);
    const int side_limit = TILE_LIMIT * TILE_PIXELS;
    if (!isfinite(sum) || !(out->fx > 0 && out->fx < 1e12) || !(out->fy > 0 && out->fy < 1e12) ||
        out->width < 1 || out->height < 1 || out->width > side_limit || out->height > side_limit)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "raster: a camera of %d x %d pixels, focal lengths %g and %g (wanted 1 to %d "
                         "pixels, lengths > 0, a finite pose)",
                         out->width, out->height, out->fx, out->fy, side_limit);
    raster_limits(camera, out->low, out->high);
    out->tiles_across = (out->width + TILE_PIXELS - 1) / TILE_PIXELS;
    out->tiles_down = (out->height + TILE_PIXELS - 1) / TILE_PIXELS;
    return GBT_OK;
}

static void project_block(size_t block, size_t begin, size_t end, void *context)
{
    struct raster_state *state = context;
    ray_splat *rays = state->view.settings.form == RASTER_EWA ? NULL : state->rays + begin;
    state->drawn[block] =
        state->kernel->project(&state->view, state->source, begin, end, state->splats + begin, rays);
}

static gbt_status project_all(struct raster_state *state, gbt_error *err)
{
    const size_t count = state->source->count;
    if (count > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "raster: %zu Gaussians (wanted at most 2^32 - 1)", count);
    GBT_TRY(mem_reserve((void **)&state->splats, &state->splat_capacity, 0, count, sizeof *state->splats,
                        "splats", err));
    GBT_TRY(mem_reserve((void **)&state->drawn, &state->drawn_capacity, 0,
                        parallel_block_count(count, SPLAT_GRAIN), sizeof *state->drawn, "splats", err));
    if (state->view.settings.form == RASTER_PER_RAY)
        GBT_TRY(mem_reserve((void **)&state->rays, &state->ray_capacity, 0, count, sizeof *state->rays,
                            "splats", err));
    parallel_blocks(count, SPLAT_GRAIN, project_block, state);
    return tile_lists_make(&state->lists, state->kernel, &state->view, state->splats, state->drawn, count,
                           err);
}

/* ---- passes over the tiles ---- */

typedef struct pass {
    struct raster_state *state;
    bool keep_tape;
    image *rgb;
    float *transmittance;
    const image *d_rgb;      /* NULL: forward */
    const atomic_bool *stop; /* raster_scene.stop */
    atomic_bool failed;
} pass;

/* Pixel of a lane of a tile; false when it lies outside the image. */
static bool lane_pixel(const tile_job *job, int block, int lane, size_t *out)
{
    const int x = job->x0 + block % BLOCKS_ACROSS * BLOCK_PIXELS + lane % BLOCK_PIXELS;
    const int y = job->y0 + block / BLOCKS_ACROSS * BLOCK_PIXELS + lane / BLOCK_PIXELS;
    *out = (size_t)y * (size_t)job->view->width + (size_t)x;
    return x < job->view->width && y < job->view->height;
}

static bool forward_tile(const pass *p, tile_job *job, ray_scratch *scratch)
{
    if (!p->state->kernel->forward[job->view->settings.form](job, scratch))
        return false;
    for (int block = 0; block < TILE_BLOCKS; block++)
        for (int lane = 0; lane < PIXEL_LANES; lane++) {
            size_t at;
            if (!lane_pixel(job, block, lane, &at))
                continue;
            for (size_t c = 0; c < 3; c++)
                p->rgb->pixels[3 * at + c] = job->pixels->rgb[block][c][lane];
            if (p->transmittance != NULL)
                p->transmittance[at] = job->pixels->transmittance[block][lane];
        }
    return true;
}

static bool backward_tile(const pass *p, tile_job *job, ray_scratch *scratch)
{
    for (int block = 0; block < TILE_BLOCKS; block++)
        for (int lane = 0; lane < PIXEL_LANES; lane++) {
            size_t at;
            const bool inside = lane_pixel(job, block, lane, &at);
            for (size_t c = 0; c < 3; c++)
                job->pixels->rgb[block][c][lane] = inside ? p->d_rgb->pixels[3 * at + c] : 0;
        }
    return p->state->kernel->backward[job->view->settings.form](job, scratch);
}

/* The background of every pixel of a tile. */
static void set_background(const tile_job *job)
{
    const raster_view *view = job->view;
    float dir[3][PIXEL_LANES];
    for (int block = 0; block < TILE_BLOCKS; block++) {
        for (int lane = 0; lane < PIXEL_LANES && view->settings.sky.varies; lane++) {
            const int x = job->x0 + block % BLOCKS_ACROSS * BLOCK_PIXELS + lane % BLOCK_PIXELS,
                      y = job->y0 + block / BLOCKS_ACROSS * BLOCK_PIXELS + lane / BLOCK_PIXELS;
            double ray[3] = {(x - view->cx) / view->fx, (y - view->cy) / view->fy, 1}, world[3];
            dvec_normalize(ray);
            dmat_apply_transposed(view->rotation, ray, world);
            for (int k = 0; k < 3; k++)
                dir[k][lane] = (float)world[k];
        }
        sky_colors(&view->settings.sky, view->settings.background, dir, job->pixels->background[block]);
    }
}

static bool is_stopped(const pass *p)
{
    return p->stop != NULL && atomic_load_explicit(p->stop, memory_order_relaxed);
}

static void run_tile(size_t index, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    pass *p = context;
    struct raster_state *state = p->state;
    const size_t first = state->lists.first[index], across = (size_t)state->view.tiles_across;
    const bool tape = p->d_rgb != NULL || p->keep_tape;
    tile_pixels pixels;
    ray_scratch scratch = {0};
    if (atomic_load_explicit(&p->failed, memory_order_relaxed) || is_stopped(p))
        return;
    tile_job job = {.view = &state->view,
                    .splats = state->splats,
                    .rays = state->rays,
                    .entries = state->lists.entries + first,
                    .count = state->lists.first[index + 1] - first,
                    .x0 = (int)(index % across) * TILE_PIXELS,
                    .y0 = (int)(index / across) * TILE_PIXELS,
                    .pixels = &pixels,
                    .tape = tape ? &state->tapes[index] : NULL,
                    .blocks = tape ? state->blocks + first : NULL,
                    .records = state->records};
    set_background(&job);
    if (!(p->d_rgb == NULL ? forward_tile(p, &job, &scratch) : backward_tile(p, &job, &scratch)))
        atomic_store(&p->failed, true);
    state->blended[index] = job.blended;
    mem_free(scratch.rows);
    mem_free(scratch.hits);
    mem_free(scratch.reached);
}

static gbt_status run_pass(pass *p, gbt_error *err)
{
    struct raster_state *state = p->state;
    const size_t count = tile_count_of(&state->view);
    GBT_TRY(mem_reserve((void **)&state->blended, &state->blended_capacity, 0, count, sizeof *state->blended,
                        "raster tiles", err));
    atomic_init(&p->failed, false);
    parallel_blocks(count, 1, run_tile, p);
    if (is_stopped(p))
        return base_fail(err, GBT_ERR_INTERRUPTED, "raster: stopped");
    if (atomic_load(&p->failed))
        return base_fail(err, GBT_ERR_NO_MEMORY, "raster: no memory for the hits of a %d x %d image",
                         state->view.width, state->view.height);
    return GBT_OK;
}

static void add_counters(const struct raster_state *state, raster_counters *counters)
{
    counters->pixels += (uint64_t)state->view.width * (uint64_t)state->view.height;
    counters->drawn += state->lists.splat_count;
    counters->pairs += state->lists.pair_count;
    for (size_t i = 0; i < tile_count_of(&state->view); i++)
        counters->blended += state->blended[i];
}

gbt_status raster_forward(raster_scene *scene, const gaussians *g, const gbt_camera *camera,
                          const raster_settings *settings, bool keep_tape, image *rgb, float *transmittance,
                          raster_counters *counters, gbt_error *err)
{
    if (rgb->width != camera->width || rgb->height != camera->height || rgb->channels != 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "raster: image is %d x %d x %d (wanted %d x %d x 3)",
                         rgb->width, rgb->height, rgb->channels, camera->width, camera->height);
    if (scene->state == NULL &&
        (scene->state = mem_calloc(1, sizeof *scene->state, "rasterizer", err)) == NULL)
        return GBT_ERR_NO_MEMORY;
    struct raster_state *state = scene->state;
    state->tape_kept = false;
    GBT_TRY(make_view(camera, settings, &state->view, err));
    state->kernel = kernel_for(cpu_best_isa());
    state->source = g;
    GBT_TRY(project_all(state, err));
    if (keep_tape) {
        GBT_TRY(mem_reserve((void **)&state->tapes, &state->tape_capacity, 0, tile_count_of(&state->view),
                            sizeof *state->tapes, "raster tape", err));
        GBT_TRY(mem_reserve((void **)&state->blocks, &state->blocks_capacity, 0, state->lists.pair_count,
                            sizeof *state->blocks, "raster tape", err));
    }
    pass p = {.state = state,
              .keep_tape = keep_tape,
              .rgb = rgb,
              .transmittance = transmittance,
              .stop = scene->stop};
    GBT_TRY(run_pass(&p, err));
    state->tape_kept = keep_tape;
    if (counters != NULL)
        add_counters(state, counters);
    return GBT_OK;
}

gbt_status raster_backward(raster_scene *scene, const image *d_rgb, gaussians *d_gaussians, float *weight,
                           gbt_error *err)
{
    struct raster_state *state = scene->state;
    if (state == NULL || !state->tape_kept)
        return base_fail(err, GBT_ERR_ARGUMENT, "raster: adjoint without a forward pass that kept its tape");
    const raster_view *view = &state->view;
    if (d_rgb->width != view->width || d_rgb->height != view->height || d_rgb->channels != 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "raster: gradient is %d x %d x %d (wanted %d x %d x 3)",
                         d_rgb->width, d_rgb->height, d_rgb->channels, view->width, view->height);
    const size_t floats = state->lists.pair_count * raster_sum_count(view->settings.form);
    GBT_TRY(mem_reserve((void **)&state->records, &state->record_capacity, 0, floats, sizeof *state->records,
                        "raster gradients", err));
    pass p = {.state = state, .d_rgb = d_rgb, .stop = scene->stop};
    GBT_TRY(run_pass(&p, err));
    return raster_gradients(view, state->source, state->splats, state->drawn, &state->lists, state->records,
                            d_gaussians, weight, err);
}

void raster_scene_free(raster_scene *scene)
{
    struct raster_state *state = scene->state;
    if (state == NULL)
        return;
    tile_lists_free(&state->lists);
    void *const owned[] = {state->splats, state->rays,    state->drawn,  state->tapes,
                           state->blocks, state->records, state->blended};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        mem_free(owned[i]);
    mem_free(state);
    scene->state = NULL;
}
