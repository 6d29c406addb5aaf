/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_build.c -- the list of the Gaussians that each part of a tile may see, for one view.

     rays --> faces, parts and their slopes (list_faces.c)
     Gaussians --> records of each face (list_kernel.make_records)
     batches of records --> parts that each record reaches; a histogram over the parts per batch
     histograms --> where each batch begins in the list of each part --> lists, by index of the Gaussian

   A parallel counting sort: batches and places do not depend on the threads, so neither do the lists. An
   "entry" is the block of LIST_GRAIN Gaussians of one face. */
#include "trace/list_build.h"

#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "trace/list_faces.h"

enum { BATCHES = 64 };

/* Most pairs of part and general Gaussian, whose ellipsoid has to be tested; with more, the tree is cheaper.
   The limit does not hold for parts of rays, which never go through the tree: depths round differently there,
   so that a hit could be counted twice, or not at all. */
static const size_t general_pairs_most = (size_t)1 << 24;

/* Blocks of records that are put into lists together. */
typedef struct record_batch {
    uint32_t *parts; /* the part of each pair, record by record */
    size_t count, capacity;
} record_batch;

/* ---- records ---- */

typedef struct list_job {
    list_builder *lists;
    const list_kernel *kernel;
    const kernel_scene *scene;
    const gaussians *g;
    size_t entries; /* faces times blocks of Gaussians */
    size_t entries_per_batch;
    atomic_bool failed;
} list_job;

static const list_face *face_of_entry(const list_view *view, size_t entry)
{
    return &view->face[entry / view->block_count];
}

static void reach_block(size_t block, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    (void)begin;
    (void)end;
    job->kernel->find_reached(job->scene, job->g, &job->lists->view, block);
}

static void record_entry(size_t entry, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    list_view *view = &job->lists->view;
    const bool one = view->face_count == 1;
    list_kept *kept = &view->kept[entry];
    const size_t first = kept->first;
    (void)begin;
    (void)end;
    *kept = job->kernel->make_records(
        job->scene, job->g, face_of_entry(view, entry), entry % view->block_count,
        one ? NULL : view->reached + entry * (LIST_GRAIN / 16), view->records + first, view->shapes + first);
    kept->first = first;
}

static gbt_status reserve_records(list_builder *lists, size_t count, gbt_error *err)
{
    list_view *view = &lists->view;
    if (view->records != NULL && count <= lists->record_capacity)
        return GBT_OK;
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
    return GBT_OK;
}

/* Where the records of each entry begin. With one face there is room for all Gaussians; with six, for those
   that may reach into each. */
static gbt_status place_records(const list_job *job, size_t *total, gbt_error *err)
{
    list_builder *lists = job->lists;
    list_view *view = &lists->view;
    memset(view->kept, 0, job->entries * sizeof *view->kept);
    *total = 0;
    if (view->face_count > 1) {
        GBT_TRY(mem_reserve((void **)&view->reached, &lists->reached_capacity, 0,
                            job->entries * (LIST_GRAIN / 16) + 1, sizeof *view->reached, "records of a view",
                            err));
        parallel_blocks(view->block_count, 1, reach_block, (void *)job);
    }
    for (size_t i = 0; i < job->entries; i++) {
        view->kept[i].first = *total;
        *total += view->face_count > 1 ? view->kept[i].records : LIST_GRAIN;
    }
    return GBT_OK;
}

static gbt_status make_records_of(list_job *job, gbt_error *err)
{
    list_builder *lists = job->lists;
    list_view *view = &lists->view;
    size_t total;
    GBT_TRY(mem_reserve((void **)&view->kept, &lists->kept_capacity, 0, job->entries + 1, sizeof *view->kept,
                        "records of a view", err));
    GBT_TRY(place_records(job, &total, err));
    GBT_TRY(reserve_records(lists, total, err));
    parallel_blocks(job->entries, 1, record_entry, job);
    return GBT_OK;
}

/* ---- pairs ---- */

/* Appends the parts in which record `at` may be hit to those of the batch. False when memory ran out. */
static bool add_parts(const list_job *job, record_batch *batch, const list_face *face, size_t at)
{
    const size_t most = batch->count + face->part_count + 16;
    if (mem_reserve((void **)&batch->parts, &batch->capacity, batch->count, most, sizeof *batch->parts,
                    "pairs of Gaussian and tile", NULL) != GBT_OK)
        return false;
    batch->count += job->kernel->find_parts(&job->lists->view, face, at, batch->parts + batch->count);
    return true;
}

static void find_pairs(size_t index, size_t begin, size_t end, void *context)
{
    list_job *job = context;
    list_view *view = &job->lists->view;
    record_batch *batch = &job->lists->batches[index];
    uint32_t *histogram = job->lists->histogram + index * view->part_count;
    memset(histogram, 0, view->part_count * sizeof *histogram);
    batch->count = 0;
    for (size_t entry = begin; entry < end; entry++) {
        const list_kept *kept = &view->kept[entry];
        for (size_t at = kept->first; at < kept->first + kept->records; at++) {
            const size_t before = batch->count;
            if (!add_parts(job, batch, face_of_entry(view, entry), at)) {
                atomic_store(&job->failed, true);
                return;
            }
            view->slot_count[at] = (uint32_t)(batch->count - before);
            for (size_t k = before; k < batch->count; k++)
                histogram[batch->parts[k]]++;
        }
    }
}

static void place_pairs(size_t index, size_t begin, size_t end, void *context)
{
    const list_job *job = context;
    list_view *view = &job->lists->view;
    const uint32_t *part = job->lists->batches[index].parts;
    uint32_t *place = job->lists->histogram + index * view->part_count;
    for (size_t entry = begin; entry < end; entry++) {
        const list_kept *kept = &view->kept[entry];
        for (size_t at = kept->first; at < kept->first + kept->records; at++)
            for (uint32_t k = 0; k < view->slot_count[at]; k++)
                view->pairs[place[*part++]++] = (list_pair){(uint32_t)at, view->slot_first[at] + k};
    }
}

/* Exclusive prefix sum: counts per batch and part become first places in the pairs of all parts. */
static gbt_status place_batches(const list_job *job, size_t batches, gbt_error *err)
{
    list_view *view = &job->lists->view;
    size_t total = 0;
    for (size_t i = 0; i < batches; i++)
        total += job->lists->batches[i].count;
    if (total >= UINT32_MAX)
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: %zu pairs of Gaussian and tile (limit 2^32)", total);
    view->pair_count = total;
    size_t next = 0;
    for (size_t part = 0; part < view->part_count; part++) {
        view->first[part] = next;
        for (size_t i = 0; i < batches; i++) {
            uint32_t *place = &job->lists->histogram[i * view->part_count + part];
            const uint32_t count = *place;
            *place = (uint32_t)next;
            next += count;
        }
    }
    view->first[view->part_count] = next;
    return GBT_OK;
}

static void number_slots(list_view *view, size_t entries)
{
    uint32_t next = 0;
    for (size_t entry = 0; entry < entries; entry++) {
        const list_kept *kept = &view->kept[entry];
        for (size_t at = kept->first; at < kept->first + kept->records; at++) {
            view->slot_first[at] = next;
            next += view->slot_count[at];
        }
    }
}

static gbt_status reserve_batches(list_builder *lists, size_t count, gbt_error *err)
{
    const size_t old = lists->batch_capacity;
    GBT_TRY(mem_reserve((void **)&lists->batches, &lists->batch_capacity, old, count, sizeof *lists->batches,
                        "tile lists", err));
    memset(lists->batches + old, 0, (lists->batch_capacity - old) * sizeof *lists->batches);
    return GBT_OK;
}

static gbt_status make_pairs(list_job *job, gbt_error *err)
{
    list_builder *lists = job->lists;
    list_view *view = &lists->view;
    job->entries_per_batch = (job->entries + BATCHES - 1) / BATCHES;
    if (job->entries_per_batch == 0)
        job->entries_per_batch = 1;
    const size_t batches = parallel_block_count(job->entries, job->entries_per_batch);
    GBT_TRY(reserve_batches(lists, batches + 1, err));
    GBT_TRY(mem_reserve((void **)&lists->histogram, &lists->histogram_capacity, 0,
                        batches * view->part_count + 1, sizeof *lists->histogram, "tile lists", err));
    GBT_TRY(mem_reserve((void **)&view->first, &lists->first_capacity, 0, view->part_count + 1,
                        sizeof *view->first, "tile lists", err));
    parallel_blocks(job->entries, job->entries_per_batch, find_pairs, job);
    if (atomic_load(&job->failed))
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: no memory for pairs of Gaussian and tile");
    GBT_TRY(place_batches(job, batches, err));
    number_slots(view, job->entries);
    GBT_TRY(mem_reserve((void **)&view->pairs, &lists->pair_capacity, 0, view->pair_count + 1,
                        sizeof *view->pairs, "tile lists", err));
    parallel_blocks(job->entries, job->entries_per_batch, place_pairs, job);
    return GBT_OK;
}

static bool few_general(const list_job *job)
{
    const list_view *view = &job->lists->view;
    size_t pairs = 0;
    for (size_t entry = 0; entry < job->entries; entry++)
        pairs += view->kept[entry].general * face_of_entry(view, entry)->part_count;
    return pairs <= general_pairs_most;
}

gbt_status list_builder_make(list_builder *lists, const list_kernel *kernel, const kernel_scene *scene,
                             const gaussians *g, const ray_image *rays, bool *usable, gbt_error *err)
{
    list_view *view = &lists->view;
    *usable = g->count < UINT32_MAX / 2 / LIST_FACES;
    if (*usable)
        GBT_TRY(list_faces_make(lists, rays, usable, err));
    if (!*usable)
        return GBT_OK;
    view->block_count = parallel_block_count(g->count, LIST_GRAIN);
    list_job job = {.lists = lists,
                    .kernel = kernel,
                    .scene = scene,
                    .g = g,
                    .entries = (size_t)view->face_count * view->block_count};
    atomic_init(&job.failed, false);
    GBT_TRY(make_records_of(&job, err));
    *usable = rays->near != NULL || few_general(&job);
    return *usable ? make_pairs(&job, err) : GBT_OK;
}

gbt_status list_builder_reserve_slots(list_builder *lists, gbt_error *err)
{
    list_view *view = &lists->view;
    GBT_TRY(mem_reserve((void **)&view->slots, &lists->slot_capacity, 0, view->pair_count + 1,
                        sizeof *view->slots, "gradient records", err));
    return mem_reserve((void **)&view->slot_used, &lists->slot_used_capacity, 0, view->pair_count + 1,
                       sizeof *view->slot_used, "gradient records", err);
}

size_t list_builder_bytes(const list_builder *lists)
{
    const list_view *v = &lists->view;
    return lists->record_capacity *
               (sizeof *v->records + sizeof *v->shapes + sizeof *v->slot_first + sizeof *v->slot_count) +
           lists->pair_capacity * sizeof *v->pairs;
}

void list_builder_free(list_builder *lists)
{
    list_view *v = &lists->view;
    for (size_t i = 0; i < lists->batch_capacity; i++)
        mem_free(lists->batches[i].parts);
    void *const owned[] = {v->parts,         v->part_boxes,    v->boxes16, v->boxes256,   v->reached,
                           v->kept,          v->records,       v->shapes,  v->slot_first, v->slot_count,
                           v->pairs,         v->first,         v->slots,   v->slot_used,  lists->batches,
                           lists->histogram, lists->tile_faces};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        mem_free(owned[i]);
    memset(lists, 0, sizeof *lists);
}
