/* SPDX-License-Identifier: Apache-2.0 */
/* run/shared_points.c -- the part of the scene that most photos show. */
#include "run/shared_points.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "train/camera_sees.h"

enum { ASKED_MOST = 20000, SHARED_LEAST = 20, POINT_BLOCK = 256 };

static const double shown = 0.99;  /* share of the points that must be in the image */
static const double border = 0.05; /* margin, as a fraction of half the image */

typedef struct point_job {
    const gbt_camera *cameras;
    size_t camera_count;
    const float *points;
    size_t stride;
    uint32_t *seen_by; /* [asked] */
} point_job;

static void count_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const point_job *job = context;
    for (size_t i = begin; i < end; i++)
        for (size_t c = 0; c < job->camera_count; c++)
            job->seen_by[i] += camera_sees(&job->cameras[c], job->points + 3 * i * job->stride, NULL);
}

gbt_status shared_points_find(const gbt_camera *cameras, size_t count, const float *points,
                              size_t point_count, shared_points *out, gbt_error *err)
{
    *out = (shared_points){0};
    const size_t stride = point_count / ASKED_MOST + 1, asked = point_count / stride;
    point_job job = {cameras, count, points, stride,
                     mem_calloc(asked + 1, sizeof *job.seen_by, "shared points", err)};
    out->position = mem_alloc(asked + 1, 3 * sizeof *out->position, "shared points", err);
    if (job.seen_by == NULL || out->position == NULL) {
        mem_free(job.seen_by);
        shared_points_free(out);
        return GBT_ERR_NO_MEMORY;
    }
    parallel_blocks(asked, POINT_BLOCK, count_block, &job);
    uint32_t most = 0;
    for (size_t i = 0; i < asked; i++)
        most = job.seen_by[i] > most ? job.seen_by[i] : most;
    for (size_t i = 0; i < asked; i++)
        if (3 * (uint64_t)job.seen_by[i] >= 2 * (uint64_t)most)
            memcpy(out->position + 3 * out->count++, points + 3 * i * stride, 3 * sizeof *points);
    if (2 * (size_t)most < count || out->count < SHARED_LEAST)
        out->count = 0;
    mem_free(job.seen_by);
    return GBT_OK;
}

void shared_points_free(shared_points *shared)
{
    mem_free(shared->position);
    *shared = (shared_points){0};
}

double shared_points_zoom(const shared_points *shared, const gbt_camera *camera, double *scratch)
{
    const double *r = camera->rotation, *p = camera->params;
    size_t before = 0;
    for (size_t i = 0; i < shared->count; i++) {
        double at[3], way[3];
        for (int k = 0; k < 3; k++)
            way[k] = (double)shared->position[3 * i + (size_t)k] - camera->center[k];
        for (int k = 0; k < 3; k++)
            at[k] = r[3 * k] * way[0] + r[3 * k + 1] * way[1] + r[3 * k + 2] * way[2];
        const double x = fabs(at[0]) * p[0] / (0.5 * camera->width),
                     y = fabs(at[1]) * p[1] / (0.5 * camera->height);
        if (at[2] > 0)
            scratch[before++] = fmax(x, y) / at[2];
    }
    if (before == 0)
        return 1;
    qsort(scratch, before, sizeof *scratch, compare_doubles);
    return fmax(1, scratch[(size_t)(shown * (double)(before - 1))] / (1 - border));
}
