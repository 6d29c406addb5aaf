/* SPDX-License-Identifier: Apache-2.0 */
/* gb/fill.c -- make the members and statistics of balls from a reordered cloud and the marks where balls
   begin. */
#include "gb/fill.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum {
    BALLS_PER_BLOCK = 512,
    INSERTION_POINTS = 24 /* sets up to this size are sorted in place, larger ones by qsort */
};

static int compare_indices(const void *a, const void *b)
{
    const uint32_t x = ((const cloud_point *)a)->index, y = ((const cloud_point *)b)->index;
    return (x > y) - (x < y);
}

static void sort_by_index(cloud_point *points, size_t count)
{
    if (count > INSERTION_POINTS) {
        qsort(points, count, sizeof *points, compare_indices);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        const cloud_point point = points[i];
        size_t j = i;
        for (; j > 0 && points[j - 1].index > point.index; j--)
            points[j] = points[j - 1];
        points[j] = point;
    }
}

/* Saturate: coordinates near FLT_MAX have variances beyond the range of float. */
static float to_float(double x) { return (float)fmin(fmax(x, (double)-FLT_MAX), (double)FLT_MAX); }

typedef struct fill_job {
    cloud_point *points;
    const uint8_t *leaf_depth;
    const float *color;
    double radius_floor;
    balls *out;
} fill_job;

static void fill_balls(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const fill_job *job = context;
    balls *out = job->out;
    for (size_t j = begin; j < end; j++) {
        const size_t first = out->first[j], count = out->first[j + 1] - first;
        cloud_point *points = job->points + first;
        sort_by_index(points, count);
        for (size_t i = 0; i < count; i++)
            out->member[first + i] = points[i].index;
        moments m;
        moments_compute(points, count, &m);
        double color[3] = {0, 0, 0}, color_std = 0;
        if (job->color != NULL)
            color_std = moments_color_std(points, count, job->color, color);
        for (int k = 0; k < 3; k++) {
            out->center[3 * j + k] = to_float(m.mean[k]);
            out->color[3 * j + k] = (float)color[k];
        }
        for (int k = 0; k < 6; k++)
            out->covariance[6 * j + k] = to_float(m.covariance[k]);
        out->radius[j] = to_float(fmax(moments_radius(&m), job->radius_floor));
        out->color_std[j] = (float)color_std;
        out->depth[j] = job->leaf_depth[first] - 1;
    }
}

static gbt_status alloc_balls(balls *out, size_t count, size_t point_count, gbt_error *err)
{
    out->count = count;
    out->point_count = point_count;
    if ((out->first = mem_alloc(count + 1, sizeof *out->first, "balls.first", err)) == NULL ||
        (out->member = mem_alloc(point_count, sizeof *out->member, "balls.member", err)) == NULL ||
        (out->center = mem_alloc(count, 3 * sizeof *out->center, "balls.center", err)) == NULL ||
        (out->radius = mem_alloc(count, sizeof *out->radius, "balls.radius", err)) == NULL ||
        (out->covariance = mem_alloc(count, 6 * sizeof *out->covariance, "balls.covariance", err)) == NULL ||
        (out->color = mem_alloc(count, 3 * sizeof *out->color, "balls.color", err)) == NULL ||
        (out->color_std = mem_alloc(count, sizeof *out->color_std, "balls.color_std", err)) == NULL ||
        (out->depth = mem_alloc(count, sizeof *out->depth, "balls.depth", err)) == NULL)
        return GBT_ERR_NO_MEMORY;
    return GBT_OK;
}

gbt_status balls_fill(cloud_point *points, const uint8_t *leaf_depth, size_t count, const float *color,
                      double radius_floor, balls *out, gbt_error *err)
{
    size_t ball_count = 0, ball = 0;
    for (size_t i = 0; i < count; i++)
        ball_count += leaf_depth[i] != 0;
    GBT_TRY(alloc_balls(out, ball_count, count, err)); /* the caller frees */
    for (size_t i = 0; i < count; i++)
        if (leaf_depth[i] != 0)
            out->first[ball++] = (uint32_t)i;
    out->first[ball_count] = (uint32_t)count;
    fill_job job = {points, leaf_depth, color, radius_floor, out};
    parallel_blocks(ball_count, BALLS_PER_BLOCK, fill_balls, &job);
    return GBT_OK;
}

void balls_free(balls *b)
{
    if (b == NULL)
        return;
    mem_free(b->first);
    mem_free(b->member);
    mem_free(b->center);
    mem_free(b->radius);
    mem_free(b->covariance);
    mem_free(b->color);
    mem_free(b->color_std);
    mem_free(b->depth);
    *b = (balls){0};
}
