/* trace/trace.c -- packets over an image, in blocks; and the sum of the gradient records that come back.

   image --> blocks of 16 x 16 pixels (one task each) --> packets of 4 x 4 --> packet kernel --> pixels, tape
   d_image + tape --> packet kernel --> one record per block and Gaussian --> counting sort by Gaussian --> gradients of the fields */
#include "trace/trace.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { BLOCK_PIXELS = 16, TILE_PIXELS = TILE_ACROSS * PACKET_PIXELS, RECORD_BLOCK = 2048 };

typedef struct trace_block {
    hit_tape tape;
    gradient_list gradients;
    kernel_counters counters;
    float d_background[3];
} trace_block;

static const tile_kernel *kernel_for(cpu_isa isa)
{
    switch (isa) {
    case CPU_AVX512: return &tile_kernel_avx512;
    case CPU_AVX2: return &tile_kernel_avx2;
    case CPU_PLAIN: break;
    }
    return &tile_kernel_plain;
}

/* ---- build ------------------------------------------------------------------------------------------------------------------------- */

static void write_records(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    trace_scene *scene = context;
    const gaussians *g = scene->source;
    for (size_t i = begin; i < end; i++) {
        float *record = scene->records + i * RECORD_FLOATS;
        const double q[4] = {(double)g->quat_w[i], (double)g->quat_x[i], (double)g->quat_y[i], (double)g->quat_z[i]};
        const double scale[3] = {(double)g->scale_x[i], (double)g->scale_y[i], (double)g->scale_z[i]};
        double m[9];
        dquat_to_matrix(q, m);
        for (int row = 0; row < 3; row++) /* S^-1 R^T: row i is axis i of the ellipsoid over its length */
            for (int column = 0; column < 3; column++)
                record[RECORD_MATRIX + 3 * row + column] = (float)(m[3 * column + row] / scale[row]);
        record[RECORD_MEAN] = g->mean_x[i], record[RECORD_MEAN + 1] = g->mean_y[i], record[RECORD_MEAN + 2] = g->mean_z[i];
        record[RECORD_OPACITY] = g->opacity[i];
        record[RECORD_COLOR] = g->red[i], record[RECORD_COLOR + 1] = g->green[i], record[RECORD_COLOR + 2] = g->blue[i];
    }
}

gbt_status trace_build(trace_scene *scene, const gaussians *g, const trace_settings *settings, float reach, gbt_error *err)
{
    scene->source = g;
    scene->settings = *settings;
    scene->reach = reach;
    scene->tape_width = scene->tape_height = 0;
    GBT_TRY(mem_reserve((void **)&scene->records, &scene->record_capacity, 0, g->count + 1, RECORD_FLOATS * sizeof(float), "gaussian records", err));
    parallel_blocks(g->count, RECORD_BLOCK, write_records, scene);
    return gaussian_tree_build(g, settings->alpha_min, reach, &scene->tree, err);
}

static kernel_scene scene_for_kernel(const trace_scene *scene)
{
    return (kernel_scene){.root = scene->tree.root,
                          .records = scene->records,
                          .coordinate_max = fmaxf(scene->tree.coordinate_max, scene->reach),
                          .settings = scene->settings};
}

/* ---- gradient records of a block ------------------------------------------------------------------------------------------------------- */

static size_t slot_of(uint32_t id, size_t slot_count)
{
    return (size_t)(id * 2654435769u) & (slot_count - 1); /* Knuth's multiplicative hash */
}

static bool grow_slots(gradient_list *list)
{
    const size_t wanted = list->slot_count == 0 ? 1024 : 2 * list->slot_count;
    uint32_t *slots = mem_calloc(wanted, sizeof *slots, "gradient table", NULL);
    if (slots == NULL)
        return false;
    for (size_t i = 0; i < list->count; i++) {
        size_t at = slot_of(list->records[i].id, wanted);
        while (slots[at] != 0)
            at = (at + 1) & (wanted - 1);
        slots[at] = (uint32_t)i + 1;
    }
    mem_free(list->slots);
    list->slots = slots, list->slot_count = wanted;
    return true;
}

gradient_record *gradient_list_find(gradient_list *list, uint32_t id)
{
    if (2 * (list->count + 1) > list->slot_count && !grow_slots(list))
        return NULL;
    size_t at = slot_of(id, list->slot_count);
    for (; list->slots[at] != 0; at = (at + 1) & (list->slot_count - 1)) {
        gradient_record *record = &list->records[list->slots[at] - 1];
        if (record->id == id)
            return record;
    }
    if (mem_reserve((void **)&list->records, &list->capacity, list->count, list->count + 1, sizeof *list->records, "gradient records", NULL) != GBT_OK)
        return NULL;
    list->slots[at] = (uint32_t)++list->count;
    gradient_record *record = &list->records[list->count - 1];
    memset(record, 0, sizeof *record);
    record->id = id;
    return record;
}

/* Buffers that grew while the block was worked on, cut to what is used: a hundred views of different depth must not add up. */
static bool keep_exactly(void **array, size_t *capacity, size_t used, size_t size)
{
    if (used == *capacity)
        return true;
    void *exact = mem_alloc(used, size, "trace block", NULL);
    if (exact == NULL)
        return false;
    if (used > 0)
        memcpy(exact, *array, used * size);
    mem_free(*array);
    *array = exact, *capacity = used;
    return true;
}

/* ---- passes over the image ----------------------------------------------------------------------------------------------------------- */

typedef struct pass {
    trace_scene *scene;
    kernel_scene view;
    const tile_kernel *kernel;
    const ray_image *rays;
    int blocks_across;
    bool keep_tape;
    image *rgb;
    float *transmittance;
    const image *d_rgb;
    atomic_bool failed;
} pass;

/* Pixel of a lane; false when it lies outside the image. */
static bool lane_pixel(const ray_image *rays, int x0, int y0, int packet, int lane, size_t *out)
{
    const int x = x0 + packet % TILE_ACROSS * PACKET_PIXELS + lane % PACKET_PIXELS;
    const int y = y0 + packet / TILE_ACROSS * PACKET_PIXELS + lane / PACKET_PIXELS;
    *out = (size_t)y * (size_t)rays->width + (size_t)x;
    return x < rays->width && y < rays->height;
}

/* Rays of the tile whose first pixel is (x0, y0); lanes outside the image or without a ray are not active. */
static void load_tile(const ray_image *rays, int x0, int y0, tile_rays *out)
{
    out->common_origin = rays->common_origin;
    for (int packet = 0; packet < TILE_PACKETS; packet++) {
        packet_rays *p = &out->packet[packet];
        p->active = 0;
        for (int lane = 0; lane < PACKET_LANES; lane++) {
            size_t at;
            if (!lane_pixel(rays, x0, y0, packet, lane, &at))
                continue;
            const float *d = rays->dir + 3 * at, *o = ray_image_origin(rays, at);
            const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            /* Written so that NaN fails: a ray that is not a unit vector from a sensible place sees the background. */
            if (!(square > 0.99f && square < 1.01f) || !(fabsf(o[0]) + fabsf(o[1]) + fabsf(o[2]) < 1e17f))
                continue;
            for (int axis = 0; axis < 3; axis++)
                p->dir[axis][lane] = d[axis], p->origin[axis][lane] = o[axis];
            p->active |= 1u << lane;
        }
        if (p->active == 0 || p->active == (1u << PACKET_LANES) - 1)
            continue;
        const int first = __builtin_ctz(p->active);
        for (int lane = 0; lane < PACKET_LANES; lane++)
            if ((p->active >> lane & 1) == 0)
                for (int axis = 0; axis < 3; axis++)
                    p->dir[axis][lane] = p->dir[axis][first], p->origin[axis][lane] = p->origin[axis][first];
    }
}

static void drop_tape(hit_tape *tape)
{
    mem_free(tape->entries);
    memset(tape, 0, sizeof *tape);
}

static void drop_gradients(gradient_list *list)
{
    mem_free(list->records);
    mem_free(list->slots);
    memset(list, 0, sizeof *list);
}

static void free_scratch(kernel_scratch *scratch)
{
    mem_free(scratch->rows);
    mem_free(scratch->hits);
    mem_free(scratch->heap);
}

static void forward_tile(pass *p, trace_block *block, int x0, int y0, kernel_scratch *scratch)
{
    tile_rays rays;
    packet_color color[TILE_PACKETS];
    load_tile(p->rays, x0, y0, &rays);
    if (!p->kernel->forward(&p->view, &rays, color, p->keep_tape ? &block->tape : NULL, scratch, &block->counters)) {
        atomic_store(&p->failed, true);
        return;
    }
    for (int packet = 0; packet < TILE_PACKETS; packet++)
        for (int lane = 0; lane < PACKET_LANES; lane++) {
            size_t at;
            if (!lane_pixel(p->rays, x0, y0, packet, lane, &at))
                continue;
            const bool traced = (rays.packet[packet].active >> lane & 1) != 0;
            for (int c = 0; c < 3; c++)
                p->rgb->pixels[3 * at + (size_t)c] = traced ? color[packet].rgb[c][lane] : p->view.settings.background[c];
            if (p->transmittance != NULL)
                p->transmittance[at] = traced ? color[packet].transmittance[lane] : 1.0f;
        }
}

static void backward_tile(pass *p, trace_block *block, int x0, int y0, size_t *cursor, kernel_scratch *scratch)
{
    tile_rays rays;
    _Alignas(64) float d_rgb[TILE_PACKETS][3][PACKET_LANES] = {0};
    load_tile(p->rays, x0, y0, &rays);
    for (int packet = 0; packet < TILE_PACKETS; packet++)
        for (int lane = 0; lane < PACKET_LANES; lane++) {
            size_t at;
            if (!lane_pixel(p->rays, x0, y0, packet, lane, &at))
                continue;
            const float *d = p->d_rgb->pixels + 3 * at;
            for (int c = 0; c < 3; c++)
                if (rays.packet[packet].active >> lane & 1)
                    d_rgb[packet][c][lane] = d[c];
                else
                    block->d_background[c] += d[c]; /* the pixel is the background */
        }
    if (!p->kernel->backward(&p->view, &rays, d_rgb, block->tape.entries, cursor, &block->gradients, block->d_background, scratch))
        atomic_store(&p->failed, true);
}

static void run_block(size_t index, size_t begin, size_t end, void *context)
{
    (void)begin, (void)end;
    pass *p = context;
    trace_block *block = &p->scene->blocks[index];
    kernel_scratch scratch = {0};
    size_t cursor = 0;
    const int x_first = (int)(index % (size_t)p->blocks_across) * BLOCK_PIXELS, y_first = (int)(index / (size_t)p->blocks_across) * BLOCK_PIXELS;
    drop_gradients(&block->gradients);
    memset(block->d_background, 0, sizeof block->d_background);
    if (p->d_rgb == NULL) {
        drop_tape(&block->tape);
        memset(&block->counters, 0, sizeof block->counters);
    }
    for (int y = y_first; y < y_first + BLOCK_PIXELS && y < p->rays->height; y += TILE_PIXELS)
        for (int x = x_first; x < x_first + BLOCK_PIXELS && x < p->rays->width; x += TILE_PIXELS) {
            if (atomic_load_explicit(&p->failed, memory_order_relaxed))
                break;
            if (p->d_rgb == NULL)
                forward_tile(p, block, x, y, &scratch);
            else
                backward_tile(p, block, x, y, &cursor, &scratch);
        }
    free_scratch(&scratch);
    mem_free(block->gradients.slots);
    block->gradients.slots = NULL, block->gradients.slot_count = 0;
    if (!keep_exactly((void **)&block->tape.entries, &block->tape.capacity, block->tape.count, sizeof *block->tape.entries) ||
        !keep_exactly((void **)&block->gradients.records, &block->gradients.capacity, block->gradients.count, sizeof *block->gradients.records))
        atomic_store(&p->failed, true);
}

static gbt_status run_pass(pass *p, gbt_error *err)
{
    trace_scene *scene = p->scene;
    p->blocks_across = (p->rays->width + BLOCK_PIXELS - 1) / BLOCK_PIXELS;
    const size_t count = (size_t)p->blocks_across * (size_t)((p->rays->height + BLOCK_PIXELS - 1) / BLOCK_PIXELS);
    if (count > scene->block_capacity) {
        const size_t old = scene->block_capacity;
        GBT_TRY(mem_reserve((void **)&scene->blocks, &scene->block_capacity, old, count, sizeof *scene->blocks, "trace blocks", err));
        memset(scene->blocks + old, 0, (scene->block_capacity - old) * sizeof *scene->blocks);
    }
    scene->block_count = count;
    p->view = scene_for_kernel(scene);
    p->kernel = kernel_for(cpu_best_isa());
    atomic_init(&p->failed, false);
    parallel_blocks(count, 1, run_block, p);
    if (atomic_load(&p->failed))
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: no memory for the hits of a %d x %d image", p->rays->width, p->rays->height);
    return GBT_OK;
}

gbt_status trace_forward(trace_scene *scene, const ray_image *rays, bool keep_tape, image *rgb, float *transmittance, kernel_counters *counters,
                         gbt_error *err)
{
    if (rgb->width != rays->width || rgb->height != rays->height || rgb->channels != 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "trace: image is %d x %d x %d (wanted %d x %d x 3)", rgb->width, rgb->height, rgb->channels, rays->width,
                         rays->height);
    pass p = {.scene = scene, .rays = rays, .keep_tape = keep_tape, .rgb = rgb, .transmittance = transmittance};
    scene->tape_width = scene->tape_height = 0;
    GBT_TRY(run_pass(&p, err));
    if (keep_tape)
        scene->tape_width = rays->width, scene->tape_height = rays->height;
    for (size_t i = 0; counters != NULL && i < scene->block_count; i++) {
        const kernel_counters *c = &scene->blocks[i].counters;
        counters->rays += c->rays, counters->nodes += c->nodes, counters->candidates += c->candidates, counters->tests += c->tests;
        counters->hits += c->hits, counters->blended += c->blended, counters->rows += c->rows, counters->pairs += c->pairs;
        counters->spilled_packets += c->spilled_packets;
    }
    return GBT_OK;
}

/* ---- gradient records --> gradients of the fields ------------------------------------------------------------------------------------- */

typedef struct reduction {
    const trace_scene *scene;
    const gradient_record *const *record; /* all records, ordered by Gaussian, then by block */
    const uint32_t *first;                /* [count + 1] */
    gaussians *out;
    float *weight;
} reduction;

/* Envelope theorem: at the nearest point d(d2)/dt = 0 (or t is fixed at t_near), so t needs no derivative. With v the canonical point:
   d(d2)/dmean = -2 (S^-1 R^T)^T v, d(d2)/dlog s_i = -2 v_i^2, d(d2)/domega = 2 (S^-1 v) x (S v). */
static void reduce_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const reduction *job = context;
    const gaussians *g = job->scene->source;
    gaussians *out = job->out;
    for (size_t i = begin; i < end; i++) {
        float sum[GRADIENT_FLOATS] = {0};
        for (uint32_t k = job->first[i]; k < job->first[i + 1]; k++)
            for (int j = 0; j < GRADIENT_FLOATS; j++)
                sum[j] += job->record[k]->sum[j];
        const float *m = job->scene->records + i * RECORD_FLOATS + RECORD_MATRIX;
        const float s[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
        const float *v = sum + GRADIENT_V, *vv = sum + GRADIENT_VV;
        const bool seen = job->first[i] != job->first[i + 1]; /* unseen ones may hold anything, even NaN */
        out->mean_x[i] = seen ? -2 * (m[0] * v[0] + m[3] * v[1] + m[6] * v[2]) : 0;
        out->mean_y[i] = seen ? -2 * (m[1] * v[0] + m[4] * v[1] + m[7] * v[2]) : 0;
        out->mean_z[i] = seen ? -2 * (m[2] * v[0] + m[5] * v[1] + m[8] * v[2]) : 0;
        out->scale_x[i] = seen ? -2 * vv[0] / s[0] : 0;
        out->scale_y[i] = seen ? -2 * vv[1] / s[1] : 0;
        out->scale_z[i] = seen ? -2 * vv[2] / s[2] : 0;
        const float wx = seen ? 2 * vv[3] * (s[2] / s[1] - s[1] / s[2]) : 0;
        const float wy = seen ? 2 * vv[4] * (s[0] / s[2] - s[2] / s[0]) : 0;
        const float wz = seen ? 2 * vv[5] * (s[1] / s[0] - s[0] / s[1]) : 0;
        const float qw = g->quat_w[i], qx = g->quat_x[i], qy = g->quat_y[i], qz = g->quat_z[i];
        /* dL/dq = 2 q (0, dL/domega), a quaternion product: tangent to the unit sphere */
        out->quat_w[i] = seen ? 2 * (-qx * wx - qy * wy - qz * wz) : 0;
        out->quat_x[i] = seen ? 2 * (qw * wx + qy * wz - qz * wy) : 0;
        out->quat_y[i] = seen ? 2 * (qw * wy + qz * wx - qx * wz) : 0;
        out->quat_z[i] = seen ? 2 * (qw * wz + qx * wy - qy * wx) : 0;
        out->opacity[i] = sum[GRADIENT_OPACITY];
        out->red[i] = sum[GRADIENT_COLOR], out->green[i] = sum[GRADIENT_COLOR + 1], out->blue[i] = sum[GRADIENT_COLOR + 2];
        if (job->weight != NULL)
            job->weight[i] = sum[GRADIENT_WEIGHT];
    }
}

static gbt_status reduce_records(trace_scene *scene, gaussians *d_gaussians, float *weight, gbt_error *err)
{
    const size_t count = scene->source->count;
    size_t total = 0;
    for (size_t i = 0; i < scene->block_count; i++)
        total += scene->blocks[i].gradients.count;
    if (total > UINT32_MAX)
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: %zu gradient records (limit 2^32)", total);
    GBT_TRY(mem_reserve((void **)&scene->record_order, &scene->record_order_capacity, 0, total + 1, sizeof *scene->record_order, "record order", err));
    GBT_TRY(mem_reserve((void **)&scene->record_first, &scene->record_first_capacity, 0, count + 2, sizeof *scene->record_first, "record ranges", err));
    /* Counting sort, stable: first[id + 1] counts, then becomes the place of the next record of id. */
    uint32_t *first = scene->record_first;
    memset(first, 0, (count + 2) * sizeof *first);
    for (size_t i = 0; i < scene->block_count; i++)
        for (size_t k = 0; k < scene->blocks[i].gradients.count; k++)
            first[scene->blocks[i].gradients.records[k].id + 2]++;
    for (size_t i = 2; i < count + 2; i++)
        first[i] += first[i - 1];
    for (size_t i = 0; i < scene->block_count; i++)
        for (size_t k = 0; k < scene->blocks[i].gradients.count; k++) {
            const gradient_record *record = &scene->blocks[i].gradients.records[k];
            scene->record_order[first[record->id + 1]++] = record;
        }
    reduction job = {.scene = scene, .record = scene->record_order, .first = first, .out = d_gaussians, .weight = weight};
    parallel_blocks(count, RECORD_BLOCK, reduce_block, &job);
    for (size_t i = 0; i < scene->block_count; i++)
        drop_gradients(&scene->blocks[i].gradients);
    return GBT_OK;
}

gbt_status trace_backward(trace_scene *scene, const ray_image *rays, const image *d_rgb, gaussians *d_gaussians, float *weight,
                          float d_background[3], gbt_error *err)
{
    if (scene->tape_width != rays->width || scene->tape_height != rays->height || d_rgb->width != rays->width || d_rgb->height != rays->height)
        return base_fail(err, GBT_ERR_ARGUMENT, "trace: adjoint of %d x %d rays, but the kept forward pass has %d x %d", rays->width, rays->height,
                         scene->tape_width, scene->tape_height);
    pass p = {.scene = scene, .rays = rays, .d_rgb = d_rgb};
    GBT_TRY(run_pass(&p, err));
    GBT_TRY(gaussians_resize(d_gaussians, scene->source->count, err));
    gaussians_zero(d_gaussians);
    GBT_TRY(reduce_records(scene, d_gaussians, weight, err));
    for (int c = 0; c < 3 && d_background != NULL; c++) {
        d_background[c] = 0;
        for (size_t i = 0; i < scene->block_count; i++)
            d_background[c] += scene->blocks[i].d_background[c];
    }
    return GBT_OK;
}

void trace_scene_free(trace_scene *scene)
{
    gaussian_tree_free(&scene->tree);
    for (size_t i = 0; i < scene->block_capacity; i++) {
        drop_tape(&scene->blocks[i].tape);
        drop_gradients(&scene->blocks[i].gradients);
    }
    mem_free(scene->blocks);
    mem_free(scene->records);
    mem_free(scene->record_order);
    mem_free(scene->record_first);
    memset(scene, 0, sizeof *scene);
}
