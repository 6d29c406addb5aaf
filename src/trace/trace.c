/* SPDX-License-Identifier: Apache-2.0 */
/* trace/trace.c -- tiles over an image, forward and back.

     rays --> lists of the tiles, if they can be made (list_build.c); else the tree (bvh/gaussian_tree.h)
     image --> tiles of 16 x 16 pixels (one task each) --> packets of 4 x 4 --> kernel --> pixels, tape
     d_image + tape --> kernel --> one record per tile and Gaussian --> gradients.c */
#include "trace/trace.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "trace/tile_pixels.h"
#include "trace/tree_kernel.h"

enum { RECORD_BLOCK = 512 };

typedef struct trace_tile { /* or the part of one that a face of a view sees */
    hit_tape tape;
    bool tape_dropped; /* it did not fit in the memory allowed: backward traces the tile again */
    gradient_list gradients;
    kernel_counters counters;
} trace_tile;

static const tree_kernel *tree_kernel_for(cpu_isa isa) { return CPU_VARIANT(tree_kernel, isa); }

static const list_kernel *list_kernel_for(cpu_isa isa) { return CPU_VARIANT(list_kernel, isa); }

/* ---- build ---- */

static void write_records(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    trace_scene *scene = context;
    const gaussians *g = scene->source;
    for (size_t i = begin; i < end; i++) {
        float *record = scene->records + i * RECORD_FLOATS;
        const double q[4] = {(double)g->quat_w[i], (double)g->quat_x[i], (double)g->quat_y[i],
                             (double)g->quat_z[i]};
        const double scale[3] = {(double)g->scale_x[i], (double)g->scale_y[i], (double)g->scale_z[i]};
        double m[9];
        dquat_to_matrix(q, m);
        for (int row = 0; row < 3; row++) /* S^-1 R^T: row i is the unit vector of axis i over its scale */
            for (int column = 0; column < 3; column++)
                record[RECORD_MATRIX + 3 * row + column] = (float)(m[3 * column + row] / scale[row]);
        record[RECORD_MEAN] = g->mean_x[i];
        record[RECORD_MEAN + 1] = g->mean_y[i];
        record[RECORD_MEAN + 2] = g->mean_z[i];
        record[RECORD_OPACITY] = g->opacity[i];
        record[RECORD_COLOR] = g->red[i];
        record[RECORD_COLOR + 1] = g->green[i];
        record[RECORD_COLOR + 2] = g->blue[i];
    }
}

static gbt_status build_tree(trace_scene *scene, gbt_error *err)
{
    if (scene->tree_ready)
        return GBT_OK;
    GBT_TRY(gaussian_tree_build(scene->source, scene->settings.alpha_min, scene->reach, &scene->tree, err));
    scene->tree_ready = true;
    return GBT_OK;
}

gbt_status trace_build(trace_scene *scene, const gaussians *g, const trace_settings *settings, float reach,
                       gbt_error *err)
{
    scene->source = g;
    scene->settings = *settings;
    scene->reach = reach;
    scene->tape_width = scene->tape_height = 0;
    GBT_TRY(mem_reserve((void **)&scene->records, &scene->record_capacity, 0, g->count + 1,
                        RECORD_FLOATS * sizeof(float), "gaussian records", err));
    parallel_blocks(g->count, RECORD_BLOCK, write_records, scene);
    scene->tree_ready = false;
    if (scene->kernel == TRACE_EMBREE)
        return gaussian_scene_build(g, settings->alpha_min, reach, &scene->embree, err);
    return scene->kernel == TRACE_LIST ? GBT_OK : build_tree(scene, err);
}

static kernel_scene scene_for_kernel(const trace_scene *scene)
{
    const bool embree = scene->kernel == TRACE_EMBREE;
    return (kernel_scene){
        .root = embree ? NULL : scene->tree.root,
        .embree = embree && scene->embree.box_count > 0 ? &scene->embree : NULL,
        .records = scene->records,
        .coordinate_max =
            fmaxf(embree ? scene->embree.coordinate_max : scene->tree.coordinate_max, scene->reach),
        .settings = scene->settings};
}

/* ---- memory of the tiles in flight, passed from tile to tile ---- */

typedef struct tile_scratch {
    tree_scratch tree;
    list_scratch list;
} tile_scratch;

static void scratch_free(tile_scratch *s)
{
    mem_free(s->tree.rows);
    mem_free(s->tree.hits);
    mem_free(s->tree.heap);
    mem_free(s->tree.lane_hits);
    list_scratch_free(&s->list);
}

enum { POOL_PLACES = 64 };
typedef struct scratch_pool {
    atomic_bool taken[POOL_PLACES];
    tile_scratch place[POOL_PLACES];
} scratch_pool;

/* A place that nobody uses; NULL when all are taken. */
static tile_scratch *scratch_take(scratch_pool *pool)
{
    for (int i = 0; i < POOL_PLACES; i++)
        if (!atomic_exchange(&pool->taken[i], true))
            return &pool->place[i];
    return NULL;
}

static void scratch_give(scratch_pool *pool, const tile_scratch *place)
{
    atomic_store(&pool->taken[place - pool->place], false);
}

static void scratch_pool_free(scratch_pool *pool)
{
    for (int i = 0; pool != NULL && i < POOL_PLACES; i++)
        scratch_free(&pool->place[i]);
    mem_free(pool);
}

/* ---- passes over the image ---- */

typedef struct pass {
    trace_scene *scene;
    kernel_scene inputs;
    const tree_kernel *tree;
    tree_forward_fn *forward;
    const list_kernel *list; /* NULL: the tree is walked by `forward` */
    const ray_image *rays;
    int tiles_across;
    bool keep_tape;
    trace_outputs out;
    const image *d_rgb;
    atomic_size_t tape_bytes;
    atomic_bool failed;
} pass;

static bool trace_tile_rays(pass *p, trace_tile *tile, const tile_rays *rays, packet_output out[TILE_PACKETS],
                            bool keep_tape, tile_scratch *scratch, kernel_counters *counters)
{
    hit_tape *tape = keep_tape ? &tile->tape : NULL;
    if (p->list == NULL)
        return p->forward(&p->inputs, rays, out, tape, &scratch->tree, counters);
    return p->list->forward(&p->inputs, &p->scene->lists.view, (size_t)(tile - p->scene->tiles), rays, out,
                            tape, &scratch->list, counters);
}

/* The tapes of lists are filled again view after view, and keep their memory. */
static void empty_tape(const pass *p, hit_tape *tape)
{
    if (p->list != NULL)
        tape->count = 0;
    else
        hit_tape_free(tape);
}

static bool forward_tile(pass *p, trace_tile *tile, const tile_rays *rays, int x0, int y0,
                         tile_scratch *scratch)
{
    packet_output out[TILE_PACKETS];
    for (int packet = 0; packet < TILE_PACKETS; packet++)
        out[packet].ended = 0;
    if (!trace_tile_rays(p, tile, rays, out, p->keep_tape, scratch, &tile->counters))
        return false;
    tile_store_pixels(p->rays, &p->inputs, &p->out, x0, y0, rays, out);
    const size_t bytes = hit_tape_bytes(&tile->tape);
    tile->tape_dropped = p->keep_tape &&
                         atomic_fetch_add(&p->tape_bytes, bytes) + bytes > p->scene->tape_bytes_max &&
                         p->scene->tape_bytes_max > 0;
    if (!tile->tape_dropped && p->list != NULL)
        return true;
    if (!tile->tape_dropped)
        return mem_trim((void **)&tile->tape.entries, &tile->tape.capacity, tile->tape.count,
                        sizeof *tile->tape.entries, "hit tape", NULL) == GBT_OK;
    hit_tape_free(&tile->tape);
    return true;
}

static bool backward_tile(pass *p, trace_tile *tile, const tile_rays *rays, int x0, int y0,
                          tile_scratch *scratch)
{
    _Alignas(64) float d_rgb[TILE_PACKETS][3][PACKET_LANES];
    tile_load_gradients(p->rays, p->d_rgb, x0, y0, rays, d_rgb);
    packet_output again[TILE_PACKETS];
    kernel_counters counters = {0};
    bool fine = !tile->tape_dropped || trace_tile_rays(p, tile, rays, again, true, scratch, &counters);
    if (p->list == NULL)
        fine = fine && p->tree->backward(&p->inputs, rays, d_rgb, tile->tape.entries, &tile->gradients,
                                         &scratch->tree);
    else
        fine = fine && p->list->backward(&p->inputs, &p->scene->lists.view, (size_t)(tile - p->scene->tiles),
                                         rays, d_rgb, &tile->tape, &scratch->list);
    empty_tape(p, &tile->tape);
    return fine && gradient_list_close(&tile->gradients) == GBT_OK;
}

static bool is_stopped(const trace_scene *scene)
{
    return scene->stop != NULL && atomic_load_explicit(scene->stop, memory_order_relaxed);
}

static void run_tile(size_t index, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    pass *p = context;
    trace_tile *tile = &p->scene->tiles[index];
    tile_rays rays;
    const list_view *view = &p->scene->lists.view;
    const list_part *part = p->list != NULL ? &view->parts[index] : NULL;
    const size_t number = part != NULL ? part->tile : index;
    const int x0 = (int)(number % (size_t)p->tiles_across) * TILE_PIXELS,
              y0 = (int)(number / (size_t)p->tiles_across) * TILE_PIXELS;
    if (atomic_load_explicit(&p->failed, memory_order_relaxed) || is_stopped(p->scene))
        return;
    gradient_list_free(&tile->gradients);
    if (p->d_rgb == NULL) {
        empty_tape(p, &tile->tape);
        memset(&tile->counters, 0, sizeof tile->counters);
    }
    tile_load_rays(p->rays, &p->inputs.settings, x0, y0, view, part, &rays);
    tile_scratch own = {{0}, {0}}, *place = scratch_take(p->scene->scratch),
                 *scratch = place != NULL ? place : &own;
    const bool fine = p->d_rgb == NULL ? forward_tile(p, tile, &rays, x0, y0, scratch)
                                       : backward_tile(p, tile, &rays, x0, y0, scratch);
    if (place != NULL)
        scratch_give(p->scene->scratch, place);
    else
        scratch_free(&own);
    if (!fine)
        atomic_store(&p->failed, true);
}

static gbt_status run_pass(pass *p, gbt_error *err)
{
    trace_scene *scene = p->scene;
    p->tiles_across = (p->rays->width + TILE_PIXELS - 1) / TILE_PIXELS;
    const size_t tiles =
                     (size_t)p->tiles_across * (size_t)((p->rays->height + TILE_PIXELS - 1) / TILE_PIXELS),
                 count = scene->listed ? scene->lists.view.part_count : tiles;
    if (count > scene->tile_capacity) {
        const size_t old = scene->tile_capacity;
        GBT_TRY(mem_reserve((void **)&scene->tiles, &scene->tile_capacity, old, count, sizeof *scene->tiles,
                            "trace tiles", err));
        memset(scene->tiles + old, 0, (scene->tile_capacity - old) * sizeof *scene->tiles);
    }
    scene->tile_count = count;
    if (scene->scratch == NULL &&
        (scene->scratch = mem_calloc(1, sizeof *scene->scratch, "scratch of tiles", err)) == NULL)
        return GBT_ERR_NO_MEMORY;
    p->tree = tree_kernel_for(cpu_best_isa());
    p->list = scene->listed ? list_kernel_for(cpu_best_isa()) : NULL;
    p->forward = scene->kernel == TRACE_EMBREE   ? p->tree->forward_embree
                 : scene->kernel == TRACE_SINGLE ? p->tree->forward_single
                                                 : p->tree->forward;
    atomic_init(&p->tape_bytes, 0);
    atomic_init(&p->failed, false);
    parallel_blocks(count, 1, run_tile, p);
    if (is_stopped(scene))
        return base_fail(err, GBT_ERR_INTERRUPTED, "trace: stopped");
    if (atomic_load(&p->failed))
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: no memory for the hits of a %d x %d image",
                         p->rays->width, p->rays->height);
    return GBT_OK;
}

/* For TRACE_LIST, makes lists of the tiles, or the tree where there can be no lists. */
static gbt_status prepare_view(trace_scene *scene, const ray_image *rays, gbt_error *err)
{
    scene->listed = false;
    if (scene->kernel != TRACE_LIST)
        return GBT_OK;
    const kernel_scene inputs = scene_for_kernel(scene);
    GBT_TRY(list_builder_make(&scene->lists, list_kernel_for(cpu_best_isa()), &inputs, scene->source, rays,
                              &scene->listed, err));
    if (!scene->listed && rays->near != NULL)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "trace: parts of rays that have no lists (wanted rays from one point within 1e17, and fewer "
            "than 3e8 Gaussians)");
    return scene->listed ? GBT_OK : build_tree(scene, err);
}

gbt_status trace_forward(trace_scene *scene, const ray_image *rays, bool keep_tape, const trace_outputs *out,
                         kernel_counters *counters, gbt_error *err)
{
    const image *rgb = out->rgb;
    if (rgb->width != rays->width || rgb->height != rays->height || rgb->channels != 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "trace: image is %d x %d x %d (wanted %d x %d x 3)",
                         rgb->width, rgb->height, rgb->channels, rays->width, rays->height);
    if (rays->near != NULL && (keep_tape || scene->kernel != TRACE_LIST))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "trace: parts of rays have no adjoint, and are traced by TRACE_LIST alone");
    GBT_TRY(prepare_view(scene, rays, err));
    pass p = {
        .scene = scene, .inputs = scene_for_kernel(scene), .rays = rays, .keep_tape = keep_tape, .out = *out};
    p.inputs.extra = out->depth != NULL || out->median_depth != NULL || out->normal != NULL ||
                     out->hit_count != NULL || out->strongest != NULL;
    scene->tape_width = scene->tape_height = 0;
    GBT_TRY(run_pass(&p, err));
    if (keep_tape) {
        scene->tape_width = rays->width;
        scene->tape_height = rays->height;
    }
    for (size_t i = 0; counters != NULL && i < scene->tile_count; i++) {
        const kernel_counters *c = &scene->tiles[i].counters;
        counters->rays += c->rays;
        counters->nodes += c->nodes;
        counters->candidates += c->candidates;
        counters->tests += c->tests;
        counters->hits += c->hits;
        counters->blended += c->blended;
        counters->rows += c->rows;
        counters->order_steps += c->order_steps;
        counters->spilled_packets += c->spilled_packets;
        counters->tape_bytes += hit_tape_bytes(&scene->tiles[i].tape);
    }
    return GBT_OK;
}

static gbt_status reduce(const pass *p, gaussians *d_gaussians, float *weight, gbt_error *err)
{
    trace_scene *scene = p->scene;
    if (scene->listed)
        return gradients_reduce_view(p->list, &p->inputs, &scene->lists.view, scene->source, d_gaussians,
                                     weight, err);
    const gradient_list **lists = mem_alloc(scene->tile_count, sizeof *lists, "gradient lists", err);
    if (lists == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < scene->tile_count; i++)
        lists[i] = &scene->tiles[i].gradients;
    const gbt_status status = gradients_reduce(&scene->order, lists, scene->tile_count, scene->source,
                                               scene->records, d_gaussians, weight, err);
    mem_free(lists);
    for (size_t i = 0; i < scene->tile_count; i++)
        gradient_list_free(&scene->tiles[i].gradients);
    return status;
}

gbt_status trace_backward(trace_scene *scene, const ray_image *rays, const image *d_rgb,
                          gaussians *d_gaussians, float *weight, gbt_error *err)
{
    if (scene->tape_width != rays->width || scene->tape_height != rays->height ||
        d_rgb->width != rays->width || d_rgb->height != rays->height)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "trace: adjoint of %d x %d rays, but the kept forward pass has %d x %d", rays->width,
                         rays->height, scene->tape_width, scene->tape_height);
    pass p = {.scene = scene, .inputs = scene_for_kernel(scene), .rays = rays, .d_rgb = d_rgb};
    scene->tape_width = scene->tape_height = 0; /* every tile releases its tape */
    if (scene->listed)
        GBT_TRY(list_builder_reserve_slots(&scene->lists, err));
    GBT_TRY(run_pass(&p, err));
    return reduce(&p, d_gaussians, weight, err);
}

void trace_scene_free(trace_scene *scene)
{
    gaussian_tree_free(&scene->tree);
    gaussian_scene_free(&scene->embree);
    for (size_t i = 0; i < scene->tile_capacity; i++) {
        hit_tape_free(&scene->tiles[i].tape);
        gradient_list_free(&scene->tiles[i].gradients);
    }
    mem_free(scene->tiles);
    mem_free(scene->records);
    gradient_order_free(&scene->order);
    list_builder_free(&scene->lists);
    scratch_pool_free(scene->scratch);
    memset(scene, 0, sizeof *scene);
}
