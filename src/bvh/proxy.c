/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/proxy.c -- the padded tight box of every Gaussian that can be seen. */
#include "bvh/proxy.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "bvh/device.h"

/* Embree drops boxes beyond 1.844e18; squares of coordinates must stay finite in float32 as well. */
static const float coordinate_limit = 1e17f;
enum { BLOCK = 4096 };

typedef struct box_job {
    const gaussians *g;
    struct RTCBuildPrimitive *out; /* NULL: count only */
    float alpha_min, pad;
    uint32_t *block_kept;
    float *block_max;
    uint32_t *block_rejected;
} box_job;

/* Tight half extents of the proxy: k * sqrt(sum_i (R_ji s_i)^2). False when the Gaussian cannot be seen. */
static bool proxy_box(const gaussians *g, size_t i, float alpha_min, float center[3], float half[3],
                      bool *rejected)
{
    *rejected = false;
    const float opacity = g->opacity[i];
    const float q[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]};
    const float s[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    center[0] = g->mean_x[i];
    center[1] = g->mean_y[i];
    center[2] = g->mean_z[i];
    if (opacity <= alpha_min)
        return false;
    const float k = sqrtf(2 * logf(opacity / alpha_min));
    float m[9];
    quat_to_matrix(q, m);
    bool fine = isfinite(opacity) && s[0] > 0 && s[1] > 0 && s[2] > 0 && isfinite(g->red[i]) &&
                isfinite(g->green[i]) && isfinite(g->blue[i]);
    for (int j = 0; j < 3; j++) {
        const float a = m[3 * j] * s[0], b = m[3 * j + 1] * s[1], c = m[3 * j + 2] * s[2];
        half[j] = k * sqrtf(a * a + b * b + c * c);
        fine = fine && fabsf(center[j]) + half[j] < coordinate_limit; /* false for NaN too */
    }
    *rejected = !fine;
    return fine;
}

static void box_block(size_t block, size_t begin, size_t end, void *context)
{
    box_job *job = context;
    uint32_t kept = 0, rejected_count = 0;
    float largest = 0;
    struct RTCBuildPrimitive *out = job->out != NULL ? job->out + job->block_kept[block] : NULL;
    for (size_t i = begin; i < end; i++) {
        float center[3], half[3];
        bool rejected;
        if (!proxy_box(job->g, i, job->alpha_min, center, half, &rejected)) {
            rejected_count += rejected;
            continue;
        }
        if (out == NULL) {
            for (int j = 0; j < 3; j++)
                largest = fmaxf(largest, fabsf(center[j]) + half[j]);
            kept++;
            continue;
        }
        /* 1e-5 of the half extent covers the rounding of k and of the rotation; the pad covers the rounding
           of coordinates. */
        struct RTCBuildPrimitive *p = &out[kept++];
        p->lower_x = center[0] - half[0] * 1.00001f - job->pad;
        p->upper_x = center[0] + half[0] * 1.00001f + job->pad;
        p->lower_y = center[1] - half[1] * 1.00001f - job->pad;
        p->upper_y = center[1] + half[1] * 1.00001f + job->pad;
        p->lower_z = center[2] - half[2] * 1.00001f - job->pad;
        p->upper_z = center[2] + half[2] * 1.00001f + job->pad;
        p->geomID = 0;
        p->primID = (unsigned)i;
    }
    if (out == NULL) {
        job->block_kept[block] = kept;
        job->block_max[block] = largest;
        job->block_rejected[block] = rejected_count;
    }
}

gbt_status proxy_boxes_make(const gaussians *g, float alpha_min, float reach, proxy_boxes *boxes,
                            gbt_error *err)
{
    boxes->count = boxes->rejected_count = 0;
    boxes->coordinate_max = 0;
    if (g->count == 0)
        return GBT_OK;
    if (g->count > UINT32_MAX / 2)
        return base_fail(err, GBT_ERR_NO_MEMORY, "bvh: %zu Gaussians (limit 2^31)", g->count);
    const size_t blocks = parallel_block_count(g->count, BLOCK);
    uint32_t *scratch = mem_alloc(blocks, 3 * sizeof *scratch, "bvh blocks", err);
    if (scratch == NULL)
        return GBT_ERR_NO_MEMORY;
    box_job job = {.g = g,
                   .alpha_min = alpha_min,
                   .block_kept = scratch,
                   .block_rejected = scratch + blocks,
                   .block_max = (float *)(scratch + 2 * blocks)};
    parallel_blocks(g->count, BLOCK, box_block, &job);
    size_t count = 0;
    for (size_t i = 0; i < blocks; i++) {
        const uint32_t kept = job.block_kept[i];
        job.block_kept[i] = (uint32_t)count;
        count += kept;
        boxes->rejected_count += job.block_rejected[i];
        boxes->coordinate_max = fmaxf(boxes->coordinate_max, job.block_max[i]);
    }
    gbt_status status = GBT_OK;
    if (count > 0)
        status = mem_reserve((void **)&boxes->box, &boxes->capacity, 0, count + count / 4 + 2,
                             sizeof *boxes->box, "bvh boxes", err);
    if (status == GBT_OK && count > 0) {
        job.pad = bvh_box_pad(fmaxf(boxes->coordinate_max, reach));
        job.out = boxes->box;
        parallel_blocks(g->count, BLOCK, box_block, &job);
        boxes->count = count;
    }
    mem_free(scratch);
    return status;
}

void proxy_boxes_free(proxy_boxes *boxes)
{
    mem_free(boxes->box);
    memset(boxes, 0, sizeof *boxes);
}
