/* SPDX-License-Identifier: Apache-2.0 */
/* trace/view_lists.c -- lists of tiles, from the records of a view.

   rays --> axes --> slopes of each tile
   Gaussians --> records (list_kernel.make_records) --> groups of blocks: tiles reached, a histogram per group
        --> place of each group in each tile --> lists, by index of the Gaussian */
#include "trace/view_lists.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { TILE_SIDE = TILE_ACROSS * PACKET_PIXELS, GROUPS = 64, LOOKUP = 1024 };

/* Pairs of Gaussians that need their ellipsoids tested and tiles: beyond this the tree is cheaper. */
static const size_t general_pairs_most = (size_t)1 << 24;

/* Blocks of records that are put into lists together. */
typedef struct list_group {
    uint32_t *tiles; /* of the pairs, record by record */
    size_t count, capacity;
} list_group;

static bool ray_is_sound(const float d[3])
{
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return square > 0.99f && square < 1.01f;
}

/* ---- axes ---- */

/* Sum of the sound directions among a few all over the picture, and along its rows. */
static void find_directions(const ray_image *rays, double middle[3], double along[3])
{
    enum { STEPS = 8 };
    memset(middle, 0, 3 * sizeof *middle);
    memset(along, 0, 3 * sizeof *along);
    for (int i = 0; i <= STEPS; i++)
        for (int k = 0; k <= STEPS; k++) {
            const size_t x = (size_t)((rays->width - 1) * (int64_t)k / STEPS),
                         y = (size_t)((rays->height - 1) * (int64_t)i / STEPS);
            const float *d = rays->dir + 3 * (y * (size_t)rays->width + x);
            for (int c = 0; c < 3 && ray_is_sound(d); c++) {
                middle[c] += (double)d[c];
                along[c] += (k - STEPS / 2) * (double)d[c];
            }
        }
}

static bool make_frame(const ray_image *rays, view_frame *out)
{
    double u[3], v[3], w[3];
    const float *o = rays->origin;
    find_directions(rays, w, u);
    if (!(dvec_length(w) > 0) || !(fabsf(o[0]) + fabsf(o[1]) + fabsf(o[2]) < 1e17f))
        return false;
    dvec_normalize(w);
    const double lean = dvec_dot(u, w);
    for (int c = 0; c < 3; c++)
        u[c] -= lean * w[c];
    if (!(dvec_length(u) > 1e-9)) { /* one column */
        const double axis[3] = {fabs(w[0]) < 0.6, fabs(w[0]) >= 0.6, 0};
        dvec_cross(w, axis, u);
    }
    dvec_normalize(u);
    dvec_cross(w, u, v);
    const double *const axes[3] = {u, v, w};
    double m[3][3];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            out->axis[k][c] = (float)axes[k][c];
            m[k][c] = (double)out->axis[k][c];
        }
    for (int k = 0; k < 3; k++) {
        dvec_cross(m[(k + 1) % 3], m[(k + 2) % 3], out->dual[k]);
        const double det = dvec_dot(m[k], out->dual[k]);
        for (int c = 0; c < 3; c++)
            out->dual[k][c] /= det;
    }
    for (int c = 0; c < 3; c++)
        out->origin[c] = (double)o[c];
    return true;
}

/* ---- slopes of the tiles ---- */

typedef struct box_job {
    const ray_image *rays;
    const view_frame *frame;
    slope_box *tiles;
    unsigned char *sees;
    int across;
    atomic_bool apart;
} box_job;

/* The boxes of tiles do not depend on which parts of rays are asked for: depths round as those of whole rays.
   But where no ray sees anything no Gaussian needs to be listed. */
static void find_seeing(const box_job *job, int row, unsigned char *sees)
{
    const ray_image *rays = job->rays;
    const size_t first = (size_t)row * (size_t)rays->width;
    for (size_t x = 0; x < (size_t)rays->width; x++)
        if (rays->near == NULL ||
            rays->near[first + x] < (rays->far != NULL ? rays->far[first + x] : INFINITY))
            sees[x / TILE_SIDE] = 1;
}

static void add_row_of_rays(const box_job *job, int row, slope_box *tiles, bool *apart)
{
    float dual[3][3];
    for (int k = 0; k < 9; k++)
        dual[k / 3][k % 3] = (float)job->frame->dual[k / 3][k % 3];
    const int width = job->rays->width;
    const float *d = job->rays->dir + 3 * (size_t)row * (size_t)width;
    for (int x = 0; x < width; x++, d += 3) {
        if (!ray_is_sound(d))
            continue;
        slope_box *box = &tiles[x / TILE_SIDE];
        const float w = dual[2][0] * d[0] + dual[2][1] * d[1] + dual[2][2] * d[2], inverse = 1 / w;
        *apart = *apart || !(w > 0.3f);
        for (int k = 0; k < 2; k++) {
            const float s = (dual[k][0] * d[0] + dual[k][1] * d[1] + dual[k][2] * d[2]) * inverse;
            box->low[k] = s < box->low[k] ? s : box->low[k];
            box->high[k] = s > box->high[k] ? s : box->high[k];
        }
    }
}

static void box_row(size_t block, size_t begin, size_t end, void *context)
{
    box_job *job = context;
    bool apart = false;
    (void)begin;
    (void)end;
    slope_box *tiles = job->tiles + block * (size_t)job->across;
    for (int x = 0; x < job->across; x++)
        tiles[x] = (slope_box){{FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX}};
    for (int row = (int)block * TILE_SIDE; row < ((int)block + 1) * TILE_SIDE && row < job->rays->height;
         row++) {
        add_row_of_rays(job, row, tiles, &apart);
        find_seeing(job, row, job->sees + block * (size_t)job->across);
    }
    for (int x = 0; x < job->across; x++)
        for (int k = 0; k < 2 && tiles[x].low[0] <= tiles[x].high[0]; k++) {
            const float open = 4e-6f + 2e-3f * (tiles[x].high[k] - tiles[x].low[k]);
            tiles[x].low[k] -= open;
            tiles[x].high[k] += open;
        }
    if (apart)
        atomic_store(&job->apart, true);
}

static gbt_status make_boxes(view_lists *lists, const ray_image *rays, bool *usable, gbt_error *err)
{
    list_view *view = &lists->view;
    view->tiles_across = (rays->width + TILE_SIDE - 1) / TILE_SIDE;
    view->tiles_down = (rays->height + TILE_SIDE - 1) / TILE_SIDE;
    const size_t tiles = (size_t)view->tiles_across * (size_t)view->tiles_down;
    GBT_TRY(mem_reserve((void **)&view->tiles, &lists->tile_capacity, 0, tiles, sizeof *view->tiles,
                        "tile lists", err));
    GBT_TRY(mem_reserve((void **)&lists->sees, &lists->sees_capacity, 0, tiles, 1, "tile lists", err));
    memset(lists->sees, 0, tiles);
    box_job job = {.rays = rays,
                   .frame = &view->frame,
                   .tiles = view->tiles,
                   .sees = lists->sees,
                   .across = view->tiles_across};
    atomic_init(&job.apart, false);
    parallel_blocks((size_t)view->tiles_down, 1, box_row, &job);
    *usable = !atomic_load(&job.apart);
    return GBT_OK;
}

/* ---- records ---- */

typedef struct list_job {
    view_lists *lists;
    const list_kernel *kernel;
    const kernel_scene *scene;
    const gaussians *g;
    slope_box bounds; /* of all tiles */
    size_t tile_count, blocks_per_group;
    float scale[2]; /* from slopes to places in the lookup tables */
    atomic_bool failed;
} list_job;

static void record_block(size_t block, size_t begin, size_t end, void *context)
{
    list_job *job = context;
    list_view *view = &job->lists->view;
    view->kept[block] = job->kernel->make_records(job->scene, job->g, &view->frame, &job->bounds, begin, end,
                                                  view->records + begin, view->shapes + begin);
}

static gbt_status make_records_of(list_job *job, gbt_error *err)
{
    view_lists *lists = job->lists;
    list_view *view = &lists->view;
    const size_t count = job->g->count;
    view->block_count = parallel_block_count(count, VIEW_GRAIN);
    if (view->records == NULL || count > lists->record_capacity) {
        const size_t wanted = count + count / 4 + 16;
        size_t capacity[4] = {0};
        void **const arrays[4] = {(void **)&view->records, (void **)&view->shapes, (void **)&view->slot_first,
                                  (void **)&view->slot_count};
        const size_t size[4] = {sizeof *view->records, sizeof *view->shapes, sizeof *view->slot_first,
                                sizeof *view->slot_count};
        lists->record_capacity = 0;
        for (int k = 0; k < 4; k++) {
            mem_free(*arrays[k]);
            *arrays[k] = NULL;
            GBT_TRY(mem_reserve(arrays[k], &capacity[k], 0, wanted + 1, size[k], "records of a view", err));
        }
        lists->record_capacity = wanted;
    }
    GBT_TRY(mem_reserve((void **)&view->kept, &lists->kept_capacity, 0, view->block_count + 1,
                        sizeof *view->kept, "records of a view", err));
    parallel_blocks(count, VIEW_GRAIN, record_block, job);
    return GBT_OK;
}

/* ---- pairs ---- */

/* Table of the first and the last row or column of tiles that slopes from a place on, and up to it, can be
   in: [0] first, [1] last. */
static void fill_lookup(const list_view *view, int axis, const list_job *job, uint16_t *first, uint16_t *last)
{
    const int lines = axis == 0 ? view->tiles_across : view->tiles_down,
              others = axis == 0 ? view->tiles_down : view->tiles_across;
    for (int i = 0; i < LOOKUP; i++) {
        first[i] = (uint16_t)lines;
        last[i] = 0;
    }
    for (int line = 0; line < lines; line++) {
        float low = FLT_MAX, high = -FLT_MAX;
        for (int k = 0; k < others; k++) {
            const slope_box *box = axis == 0 ? &view->tiles[(size_t)k * (size_t)lines + (size_t)line]
                                             : &view->tiles[(size_t)line * (size_t)others + (size_t)k];
            low = fminf(low, box->low[axis]);
            high = fmaxf(high, box->high[axis]);
        }
        if (low > high)
            continue;
        int from = (int)((low - job->bounds.low[axis]) * job->scale[axis]),
            to = (int)((high - job->bounds.low[axis]) * job->scale[axis]) + 1;
        from = from < 0 ? 0 : from;
        to = to > LOOKUP ? LOOKUP : to;
        for (int i = from; i < to; i++) {
            first[i] = first[i] < line ? first[i] : (uint16_t)line;
            last[i] = last[i] > line ? last[i] : (uint16_t)line;
        }
    }
    for (int i = LOOKUP - 1; i-- > 0;) /* the first that begins here or later */
        first[i] = first[i] < first[i + 1] ? first[i] : first[i + 1];
    for (int i = 1; i < LOOKUP; i++)
        last[i] = last[i] > last[i - 1] ? last[i] : last[i - 1];
}

static int lookup_place(const list_job *job, int axis, float slope)
{
    const float at = (slope - job->bounds.low[axis]) * job->scale[axis];
    return at < 0 ? 0 : at > LOOKUP - 1 ? LOOKUP - 1 : (int)at;
}

/* (c0 x + c1 y)^2 + (c2 y)^2 */
static float ellipse_form(const float c[3], float x, float y)
{
    const float u = c[0] * x + c[1] * y, v = c[2] * y;
    return u * u + v * v;
}

static float clamp(float a, float low, float high) { return a < low ? low : a > high ? high : a; }

/* Does the ellipse about (x, y) reach into the box? See list16.h. */
static bool outline_in_box(const view_outline *o, float x, float y, const slope_box *box)
{
    const float left = box->low[0] - x, right = box->high[0] - x, bottom = box->low[1] - y,
                top = box->high[1] - y, *c = o->chol;
    if (!(left <= o->half[0] && -right <= o->half[0] && bottom <= o->half[1] && -top <= o->half[1]))
        return false;
    const float near_x = clamp(0, left, right), near_y = clamp(0, bottom, top);
    const float row_x = clamp(-c[1] * near_y / c[0], left, right),
                column_y = clamp(-c[0] * c[1] * near_x / (c[1] * c[1] + c[2] * c[2]), bottom, top);
    return fminf(ellipse_form(c, row_x, near_y), ellipse_form(c, near_x, column_y)) <= 1;
}

/* The tiles of record `at` to the end of the group's. False when memory ran out. */
static bool add_tiles(const list_job *job, list_group *group, size_t at)
{
    const list_view *view = &job->lists->view;
    const view_record *r = &view->records[at];
    const view_shape *shape = &view->shapes[at];
    const uint16_t *table = job->lists->lookup;
    int box[4] = {0, view->tiles_across - 1, 0, view->tiles_down - 1};
    const float x = (float)(r->a + (double)shape->outline.x), y = (float)(r->b + (double)shape->outline.y);
    if (!record_is_general(r)) {
        box[0] = table[lookup_place(job, 0, x - shape->outline.half[0])];
        box[1] = table[LOOKUP + lookup_place(job, 0, x + shape->outline.half[0])];
        box[2] = table[2 * LOOKUP + lookup_place(job, 1, y - shape->outline.half[1])];
        box[3] = table[3 * LOOKUP + lookup_place(job, 1, y + shape->outline.half[1])];
    }
    if (box[0] > box[1] || box[2] > box[3])
        return true;
    const size_t area = (size_t)(box[1] - box[0] + 1) * (size_t)(box[3] - box[2] + 1);
    if (mem_reserve((void **)&group->tiles, &group->capacity, group->count, group->count + area,
                    sizeof *group->tiles, "pairs of Gaussian and tile", NULL) != GBT_OK)
        return false;
    for (int row = box[2]; row <= box[3]; row++)
        for (int column = box[0]; column <= box[1]; column++) {
            const uint32_t tile = (uint32_t)(row * view->tiles_across + column);
            const slope_box *bounds = &view->tiles[tile];
            group->tiles[group->count] = tile;
            group->count += job->lists->sees[tile] != 0 && bounds->low[0] <= bounds->high[0] &&
                            (record_is_general(r) ? ellipsoid_meets_box(&shape->ellipsoid, bounds)
                                                  : outline_in_box(&shape->outline, x, y, bounds));
        }
    return true;
}

static void find_pairs(size_t index, size_t begin, size_t end, void *context)
{
    list_job *job = context;
    list_view *view = &job->lists->view;
    list_group *group = &job->lists->groups[index];
    uint32_t *histogram = job->lists->histogram + index * job->tile_count;
    memset(histogram, 0, job->tile_count * sizeof *histogram);
    group->count = 0;
    for (size_t block = begin; block < end; block++)
        for (size_t at = block * VIEW_GRAIN; at < block * VIEW_GRAIN + view->kept[block].records; at++) {
            const size_t before = group->count;
            if (!add_tiles(job, group, at)) {
                atomic_store(&job->failed, true);
                return;
            }
            view->slot_count[at] = (uint32_t)(group->count - before);
            for (size_t k = before; k < group->count; k++)
                histogram[group->tiles[k]]++;
        }
}

static void place_pairs(size_t index, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    list_view *view = &job->lists->view;
    const uint32_t *tile = job->lists->groups[index].tiles;
    uint32_t *place = job->lists->histogram + index * job->tile_count;
    for (size_t block = begin; block < end; block++)
        for (size_t at = block * VIEW_GRAIN; at < block * VIEW_GRAIN + view->kept[block].records; at++)
            for (uint32_t k = 0; k < view->slot_count[at]; k++)
                view->pairs[place[*tile++]++] = (list_pair){(uint32_t)at, view->slot_first[at] + k};
}

/* Counts per group and tile become places in the list of all tiles. */
static gbt_status place_groups(const list_job *job, size_t groups, gbt_error *err)
{
    list_view *view = &job->lists->view;
    size_t total = 0;
    for (size_t i = 0; i < groups; i++)
        total += job->lists->groups[i].count;
    if (total >= UINT32_MAX)
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: %zu pairs of Gaussian and tile (limit 2^32)", total);
    view->pair_count = total;
    size_t next = 0;
    for (size_t tile = 0; tile < job->tile_count; tile++) {
        view->first[tile] = next;
        for (size_t i = 0; i < groups; i++) {
            uint32_t *place = &job->lists->histogram[i * job->tile_count + tile];
            const uint32_t count = *place;
            *place = (uint32_t)next;
            next += count;
        }
    }
    view->first[job->tile_count] = next;
    return GBT_OK;
}

static void number_slots(list_view *view)
{
    uint32_t next = 0;
    for (size_t block = 0; block < view->block_count; block++)
        for (size_t at = block * VIEW_GRAIN; at < block * VIEW_GRAIN + view->kept[block].records; at++) {
            view->slot_first[at] = next;
            next += view->slot_count[at];
        }
}

static gbt_status reserve_groups(view_lists *lists, size_t count, gbt_error *err)
{
    const size_t old = lists->group_capacity;
    GBT_TRY(mem_reserve((void **)&lists->groups, &lists->group_capacity, old, count, sizeof *lists->groups,
                        "tile lists", err));
    memset(lists->groups + old, 0, (lists->group_capacity - old) * sizeof *lists->groups);
    return GBT_OK;
}

static gbt_status make_pairs(list_job *job, gbt_error *err)
{
    view_lists *lists = job->lists;
    list_view *view = &lists->view;
    job->blocks_per_group = (view->block_count + GROUPS - 1) / GROUPS;
    if (job->blocks_per_group == 0)
        job->blocks_per_group = 1;
    const size_t groups = parallel_block_count(view->block_count, job->blocks_per_group);
    GBT_TRY(reserve_groups(lists, groups + 1, err));
    GBT_TRY(mem_reserve((void **)&lists->histogram, &lists->histogram_capacity, 0,
                        groups * job->tile_count + 1, sizeof *lists->histogram, "tile lists", err));
    GBT_TRY(mem_reserve((void **)&view->first, &lists->first_capacity, 0, job->tile_count + 1,
                        sizeof *view->first, "tile lists", err));
    GBT_TRY(mem_reserve((void **)&lists->lookup, &lists->lookup_capacity, 0, 4 * LOOKUP,
                        sizeof *lists->lookup, "tile lists", err));
    for (int axis = 0; axis < 2; axis++)
        fill_lookup(view, axis, job, lists->lookup + 2 * axis * LOOKUP,
                    lists->lookup + (2 * axis + 1) * LOOKUP);
    parallel_blocks(view->block_count, job->blocks_per_group, find_pairs, job);
    if (atomic_load(&job->failed))
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: no memory for pairs of Gaussian and tile");
    GBT_TRY(place_groups(job, groups, err));
    number_slots(view);
    GBT_TRY(mem_reserve((void **)&view->pairs, &lists->pair_capacity, 0, view->pair_count + 1,
                        sizeof *view->pairs, "tile lists", err));
    parallel_blocks(view->block_count, job->blocks_per_group, place_pairs, job);
    return GBT_OK;
}

/* The slopes of all tiles, and from there to the lookup tables. */
static void find_bounds(list_job *job)
{
    const list_view *view = &job->lists->view;
    job->bounds = (slope_box){{FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX}};
    for (size_t i = 0; i < job->tile_count; i++)
        for (int k = 0; k < 2; k++) {
            job->bounds.low[k] = fminf(job->bounds.low[k], view->tiles[i].low[k]);
            job->bounds.high[k] = fmaxf(job->bounds.high[k], view->tiles[i].high[k]);
        }
    for (int k = 0; k < 2; k++) {
        const float range = job->bounds.high[k] - job->bounds.low[k];
        job->scale[k] = range > 0 ? LOOKUP / range : 0;
    }
}

static bool few_general(const list_job *job)
{
    const list_view *view = &job->lists->view;
    size_t general = 0;
    for (size_t block = 0; block < view->block_count; block++)
        general += view->kept[block].general;
    return general * job->tile_count <= general_pairs_most;
}

gbt_status view_lists_make(view_lists *lists, const list_kernel *kernel, const kernel_scene *scene,
                           const gaussians *g, const ray_image *rays, bool *usable, gbt_error *err)
{
    list_view *view = &lists->view;
    *usable = rays->common_origin && g->count < UINT32_MAX / 2 && make_frame(rays, &view->frame);
    if (!*usable)
        return GBT_OK;
    GBT_TRY(make_boxes(lists, rays, usable, err));
    if (!*usable)
        return GBT_OK;
    list_job job = {.lists = lists,
                    .kernel = kernel,
                    .scene = scene,
                    .g = g,
                    .tile_count = (size_t)view->tiles_across * (size_t)view->tiles_down};
    atomic_init(&job.failed, false);
    find_bounds(&job);
    GBT_TRY(make_records_of(&job, err));
    *usable = few_general(&job);
    return *usable ? make_pairs(&job, err) : GBT_OK;
}

gbt_status view_lists_reserve_slots(view_lists *lists, gbt_error *err)
{
    list_view *view = &lists->view;
    GBT_TRY(mem_reserve((void **)&view->slots, &lists->slot_capacity, 0, view->pair_count + 1,
                        sizeof *view->slots, "gradient records", err));
    return mem_reserve((void **)&view->slot_used, &lists->used_capacity, 0, view->pair_count + 1,
                       sizeof *view->slot_used, "gradient records", err);
}

void view_lists_free(view_lists *lists)
{
    list_view *v = &lists->view;
    for (size_t i = 0; i < lists->group_capacity; i++)
        mem_free(lists->groups[i].tiles);
    void *const owned[] = {v->tiles,      v->records,       v->shapes,     v->kept,    v->slot_first,
                           v->slot_count, v->pairs,         v->first,      v->slots,   v->slot_used,
                           lists->groups, lists->histogram, lists->lookup, lists->sees};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        mem_free(owned[i]);
    memset(lists, 0, sizeof *lists);
}
