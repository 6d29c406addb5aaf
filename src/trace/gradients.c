/* SPDX-License-Identifier: Apache-2.0 */
/* trace/gradients.c -- from the sums that tiles leave to the gradients of the Gaussians' fields.

   Tree: every tile has a list of records, one for each Gaussian that it blended, found by a hash table. A
   stable counting sort brings the records of all tiles into the order of (Gaussian, tile), in which they are
   summed. Lists: every pair of Gaussian and tile has a slot; the kernel sums the slots of each record, and
   the faces are added in their order. Either way the sums of a Gaussian then become gradients of mean, scale
   and rotation by the formulas of gradients.h. All orders are fixed, so the bits do not depend on the
   threads. */
#include "trace/gradients.h"

#include <string.h>

#include "base/clones.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { FIRST_SLOTS = 4096, LANES = 64 /* Gaussians whose gradients are found together */ };

static size_t slot_of(uint32_t id, size_t slot_count)
{
    return (size_t)(id * 2654435769u) & (slot_count - 1); /* Knuth's multiplicative hash */
}

static bool grow_slots(gradient_list *list)
{
    const size_t wanted = list->slot_count == 0 ? FIRST_SLOTS : 2 * list->slot_count;
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
    list->slots = slots;
    list->slot_count = wanted;
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
    if (mem_reserve((void **)&list->records, &list->capacity, list->count, list->count + 1,
                    sizeof *list->records, "gradient records", NULL) != GBT_OK)
        return NULL;
    list->slots[at] = (uint32_t)++list->count;
    gradient_record *record = &list->records[list->count - 1];
    memset(record, 0, sizeof *record);
    record->id = id;
    return record;
}

gbt_status gradient_list_close(gradient_list *list)
{
    mem_free(list->slots);
    list->slots = NULL;
    list->slot_count = 0;
    return mem_trim((void **)&list->records, &list->capacity, list->count, sizeof *list->records,
                    "gradient records", NULL);
}

void gradient_list_free(gradient_list *list)
{
    mem_free(list->records);
    mem_free(list->slots);
    memset(list, 0, sizeof *list);
}

typedef struct reduction {
    const gaussians *g;
    const float *records;
    const gradient_record *const *record; /* all records, ordered by Gaussian, then by block */
    const uint32_t *first;                /* [count + 1] */
    gaussians *out;
    float *weight;
} reduction;

static inline float masked(float value, uint32_t mask)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits &= mask;
    memcpy(&value, &bits, sizeof bits);
    return value;
}

enum { MEAN, SCALE = MEAN + 3, QUAT = SCALE + 3, GEOMETRY = QUAT + 4 }; /* as in GAUSSIANS_FIELDS */

/* Gradients of mean, scale and rotation of `count` Gaussians from `first` on, whose sums begin at `from`. m:
   entries of S^-1 R^T. seen: a mask, all ones, or 0 for a Gaussian that no ray hit: its fields may hold
   anything, even NaN, and its gradients are 0. */
FASTEST_CLONE static void find_gradients(const gaussians *g, size_t first, size_t count,
                                         const float (*m)[LANES], const block_sums *sums, size_t from,
                                         const uint32_t *seen, float (*restrict out)[LANES])
{
    const float *scale[3] = {g->scale_x + first, g->scale_y + first, g->scale_z + first};
    const float *quat[4] = {g->quat_w + first, g->quat_x + first, g->quat_y + first, g->quat_z + first};
    const float(*v)[LIST_GRAIN + 16] = sums->sum + GRADIENT_V,
                                 (*vv)[LIST_GRAIN + 16] = sums->sum + GRADIENT_VV;
    for (size_t i = 0; i < count; i++) {
        const size_t at = from + i;
        const uint32_t mask = seen[at];
        const float sx = scale[0][i], sy = scale[1][i], sz = scale[2][i];
        for (int k = 0; k < 3; k++)
            out[MEAN + k][i] =
                masked(-2 * (m[k][i] * v[0][at] + m[3 + k][i] * v[1][at] + m[6 + k][i] * v[2][at]), mask);
        out[SCALE][i] = masked(-2 * vv[0][at] / sx, mask);
        out[SCALE + 1][i] = masked(-2 * vv[1][at] / sy, mask);
        out[SCALE + 2][i] = masked(-2 * vv[2][at] / sz, mask);
        const float wx = 2 * vv[3][at] * (sz / sy - sy / sz), wy = 2 * vv[4][at] * (sx / sz - sz / sx),
                    wz = 2 * vv[5][at] * (sy / sx - sx / sy);
        const float qw = quat[0][i], qx = quat[1][i], qy = quat[2][i], qz = quat[3][i];
        /* dL/dq = 2 q (0, dL/domega), a quaternion product: tangent to the unit sphere */
        out[QUAT][i] = masked(2 * (-qx * wx - qy * wy - qz * wz), mask);
        out[QUAT + 1][i] = masked(2 * (qw * wx + qy * wz - qz * wy), mask);
        out[QUAT + 2][i] = masked(2 * (qw * wy + qz * wx - qx * wz), mask);
        out[QUAT + 3][i] = masked(2 * (qw * wz + qx * wy - qy * wx), mask);
    }
}

/* The gradients of a block. The sums of Gaussians that were not seen are 0. */
static void write_gradients(const gaussians *g, const float *records, size_t begin, size_t end,
                            const block_sums *sums, const uint32_t *seen, gaussians *out, float *weight)
{
#define X(name, pad, meaning) out->name,
    float *const to[] = {GAUSSIANS_FIELDS(X)};
#undef X
    for (size_t first = begin; first < end; first += LANES) {
        const size_t count = smaller_size(LANES, end - first), at = first - begin,
                     bytes = count * sizeof(float);
        float matrix[9][LANES], d[GEOMETRY][LANES];
        for (size_t i = 0; i < count; i++)
            for (size_t k = 0; k < 9; k++)
                matrix[k][i] = records[(first + i) * RECORD_FLOATS + RECORD_MATRIX + k];
        find_gradients(g, first, count, (const float(*)[LANES])matrix, sums, at, seen, d);
        for (int k = 0; k < GAUSSIANS_FIELD_COUNT; k++) /* opacity and colour have the same order in both */
            memcpy(to[k] + first, k < GEOMETRY ? d[k] : sums->sum[GRADIENT_OPACITY + k - GEOMETRY] + at,
                   bytes);
        if (weight != NULL)
            memcpy(weight + first, sums->sum[GRADIENT_WEIGHT] + at, bytes);
    }
}

static void reduce_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const reduction *job = context;
    block_sums sums;
    uint32_t seen[LIST_GRAIN];
    for (size_t i = begin; i < end; i++) {
        float sum[GRADIENT_FLOATS] = {0};
        for (uint32_t k = job->first[i]; k < job->first[i + 1]; k++)
            for (int j = 0; j < GRADIENT_FLOATS; j++)
                sum[j] += job->record[k]->sum[j];
        for (int j = 0; j < GRADIENT_FLOATS; j++)
            sums.sum[j][i - begin] = sum[j];
        seen[i - begin] = job->first[i] != job->first[i + 1] ? UINT32_MAX : 0;
    }
    write_gradients(job->g, job->records, begin, end, &sums, seen, job->out, job->weight);
}

gbt_status gradients_reduce(gradient_order *order, const gradient_list *const *lists, size_t list_count,
                            const gaussians *g, const float *records, gaussians *out, float *weight,
                            gbt_error *err)
{
    size_t total = 0;
    for (size_t i = 0; i < list_count; i++)
        total += lists[i]->count;
    if (total > UINT32_MAX)
        return base_fail(err, GBT_ERR_NO_MEMORY, "trace: %zu gradient records (limit 2^32)", total);
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_zero_padding(out);
    GBT_TRY(mem_reserve((void **)&order->record, &order->record_capacity, 0, total + 1, sizeof *order->record,
                        "record order", err));
    GBT_TRY(mem_reserve((void **)&order->first, &order->first_capacity, 0, g->count + 2, sizeof *order->first,
                        "record ranges", err));
    /* Stable counting sort: first[id + 2] counts the records of id. After the prefix sum first[id + 1] is
       where the next record of id goes; when all have been placed, the records of id are first[id] ..
       first[id + 1] - 1. */
    uint32_t *first = order->first;
    memset(first, 0, (g->count + 2) * sizeof *first);
    for (size_t i = 0; i < list_count; i++)
        for (size_t k = 0; k < lists[i]->count; k++)
            first[lists[i]->records[k].id + 2]++;
    for (size_t i = 2; i < g->count + 2; i++)
        first[i] += first[i - 1];
    for (size_t i = 0; i < list_count; i++)
        for (size_t k = 0; k < lists[i]->count; k++) {
            const gradient_record *record = &lists[i]->records[k];
            order->record[first[record->id + 1]++] = record;
        }
    reduction job = {
        .g = g, .records = records, .record = order->record, .first = first, .out = out, .weight = weight};
    parallel_blocks(g->count, LIST_GRAIN, reduce_block, &job);
    return GBT_OK;
}

typedef struct list_reduction {
    const list_kernel *kernel;
    const kernel_scene *scene;
    const list_view *view;
    const gaussians *g;
    gaussians *out;
    float *weight;
} list_reduction;

/* The sums of the Gaussians of a block, from `begin` on, over all faces in their order. */
static void add_faces(const list_reduction *job, size_t block, size_t begin, block_sums *sums, uint32_t *seen)
{
    const list_view *view = job->view;
    block_sums of_face;
    for (int f = 0; f < view->face_count; f++) {
        const list_kept *kept = &view->kept[(size_t)f * view->block_count + block];
        job->kernel->turn_sums(job->scene, view, &view->face[f], kept->first, kept->first + kept->records,
                               &of_face);
        for (size_t k = 0; k < kept->records; k++) {
            const size_t i = record_id(&view->records[kept->first + k]) - begin;
            if (!(of_face.sum[GRADIENT_WEIGHT][k] > 0))
                continue;
            for (int j = 0; j <= GRADIENT_WEIGHT; j++)
                sums->sum[j][i] = seen[i] ? sums->sum[j][i] + of_face.sum[j][k] : of_face.sum[j][k];
            seen[i] = UINT32_MAX;
        }
    }
}

static void reduce_view_block(size_t block, size_t begin, size_t end, void *context)
{
    const list_reduction *job = context;
    block_sums sums;
    uint32_t seen[LIST_GRAIN] = {0};
    memset(&sums, 0, sizeof sums);
    add_faces(job, block, begin, &sums, seen);
    write_gradients(job->g, job->scene->records, begin, end, &sums, seen, job->out, job->weight);
}

gbt_status gradients_reduce_view(const list_kernel *kernel, const kernel_scene *scene, const list_view *view,
                                 const gaussians *g, gaussians *out, float *weight, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_zero_padding(out);
    list_reduction job = {
        .kernel = kernel, .scene = scene, .view = view, .g = g, .out = out, .weight = weight};
    parallel_blocks(g->count, LIST_GRAIN, reduce_view_block, &job);
    return GBT_OK;
}

void gradient_order_free(gradient_order *order)
{
    mem_free(order->record);
    mem_free(order->first);
    memset(order, 0, sizeof *order);
}
