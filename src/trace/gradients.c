/* SPDX-License-Identifier: Apache-2.0 */
/* trace/gradients.c -- one record per Gaussian and block; their sum, in the order of the blocks. */
#include "trace/gradients.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { RECORD_BLOCK = 512, FIRST_SLOTS = 4096 };

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

/* The gradient of the fields of Gaussian `i` from its sums; NULL: it was not seen, and may hold anything,
   even NaN. */
static void write_gradient(const gaussians *g, const float *records, size_t i, const float *sum,
                           gaussians *out, float *weight)
{
    static const float nothing[GRADIENT_FLOATS];
    const bool seen = sum != NULL;
    sum = seen ? sum : nothing;
    const float *m = records + i * RECORD_FLOATS + RECORD_MATRIX;
    const float s[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    const float *v = sum + GRADIENT_V, *vv = sum + GRADIENT_VV;
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
    out->red[i] = sum[GRADIENT_COLOR];
    out->green[i] = sum[GRADIENT_COLOR + 1];
    out->blue[i] = sum[GRADIENT_COLOR + 2];
    if (weight != NULL)
        weight[i] = sum[GRADIENT_WEIGHT];
}

static void reduce_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const reduction *job = context;
    for (size_t i = begin; i < end; i++) {
        float sum[GRADIENT_FLOATS] = {0};
        for (uint32_t k = job->first[i]; k < job->first[i + 1]; k++)
            for (int j = 0; j < GRADIENT_FLOATS; j++)
                sum[j] += job->record[k]->sum[j];
        write_gradient(job->g, job->records, i, job->first[i] != job->first[i + 1] ? sum : NULL, job->out,
                       job->weight);
    }
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
    /* Counting sort, stable: first[id + 1] counts, then becomes the place of the next record of id. */
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
    parallel_blocks(g->count, RECORD_BLOCK, reduce_block, &job);
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

/* The sums of Gaussian `begin` and those after it over all faces, in their order. */
static void add_faces(const list_reduction *job, size_t block, size_t begin, gradient_record *sum, bool *seen)
{
    const list_view *view = job->view;
    gradient_record of_face[VIEW_GRAIN];
    for (int f = 0; f < view->face_count; f++) {
        const view_kept *kept = &view->kept[(size_t)f * view->block_count + block];
        job->kernel->turn_sums(job->scene, view, &view->face[f], kept->first, kept->first + kept->records,
                               of_face);
        for (size_t k = 0; k < kept->records; k++) {
            const size_t i = of_face[k].id - begin;
            if (!(of_face[k].sum[GRADIENT_WEIGHT] > 0))
                continue;
            if (!seen[i])
                sum[i] = of_face[k];
            else
                for (int j = 0; j < GRADIENT_FLOATS; j++)
                    sum[i].sum[j] += of_face[k].sum[j];
            seen[i] = true;
        }
    }
}

static void reduce_view_block(size_t block, size_t begin, size_t end, void *context)
{
    const list_reduction *job = context;
    gradient_record sum[VIEW_GRAIN];
    bool seen[VIEW_GRAIN] = {false};
    add_faces(job, block, begin, sum, seen);
    for (size_t i = begin; i < end; i++)
        write_gradient(job->g, job->scene->records, i, seen[i - begin] ? sum[i - begin].sum : NULL, job->out,
                       job->weight);
}

gbt_status gradients_reduce_view(const list_kernel *kernel, const kernel_scene *scene, const list_view *view,
                                 const gaussians *g, gaussians *out, float *weight, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_zero_padding(out);
    list_reduction job = {
        .kernel = kernel, .scene = scene, .view = view, .g = g, .out = out, .weight = weight};
    parallel_blocks(g->count, VIEW_GRAIN, reduce_view_block, &job);
    return GBT_OK;
}

void gradient_order_free(gradient_order *order)
{
    mem_free(order->record);
    mem_free(order->first);
    memset(order, 0, sizeof *order);
}
