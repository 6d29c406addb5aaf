/* SPDX-License-Identifier: Apache-2.0 */
/* command/init_quality.c -- compare how well centres represent a cloud: the paper's balls, adaptive balls,
   and voxels. */
#include "command/init_quality.h"

#include <math.h>
#include <stdint.h>

#include "anchor/init.h"
#include "base/fail.h"
#include "base/memory.h"
#include "bvh/points.h"

/* For each point find the nearest centre, and sum the squared distances. */
static gbt_status find_nearest(const scene_points *points, const float *center, size_t count,
                               uint32_t *nearest, double *squares, gbt_error *err)
{
    double *square = mem_alloc(points->count, sizeof *square, "nearest anchors", err);
    if (square == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status =
        points_find_nearest(center, count, points->position, points->count, nearest, square, err);
    for (size_t i = 0; i < points->count && status == GBT_OK; i++)
        *squares += square[i];
    mem_free(square);
    return status;
}

/* Sum over points and channels of the squared differences to the mean colour of the points that share a
   centre. */
static double color_squares(const scene_points *points, const uint32_t *nearest, double *mean,
                            size_t *members)
{
    double squares = 0;
    for (size_t i = 0; i < points->count; i++) { /* Welford's update: one pass without cancellation */
        const double n = (double)++members[nearest[i]];
        for (size_t k = 0; k < 3; k++) {
            double *m = &mean[3 * (size_t)nearest[i] + k];
            const double away = (double)points->color[3 * i + k] - *m;
            *m += away / n;
            squares += away * ((double)points->color[3 * i + k] - *m);
        }
    }
    return squares;
}

static gbt_status measure(const scene_points *points, const float *center, size_t count, init_quality *out,
                          gbt_error *err)
{
    double squares = 0, *mean = mem_calloc(count, 3 * sizeof *mean, "anchor colours", err);
    uint32_t *nearest = mem_alloc(points->count, sizeof *nearest, "nearest anchors", err);
    size_t *members = mem_calloc(count, sizeof *members, "anchor members", err);
    gbt_status status = mean != NULL && nearest != NULL && members != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK)
        status = find_nearest(points, center, count, nearest, &squares, err);
    if (status == GBT_OK) {
        out->anchors = count;
        out->distance = sqrt(squares / (double)points->count);
        out->color = points->has_color
                         ? sqrt(color_squares(points, nearest, mean, members) / (3.0 * (double)points->count))
                         : 0.0;
    }
    mem_free(mean);
    mem_free(nearest);
    mem_free(members);
    return status;
}

/* The finest voxel grid of at most `most` voxels: bisection of the logarithm of the edge length. */
static gbt_status finest_voxels(const scene_points *points, float voxel_size, size_t most, float **center,
                                size_t *count, gbt_error *err)
{
    float low = voxel_size, high = voxel_size;
    GBT_TRY(voxel_centers(points->position, points->count, high, center, count, err));
    while (*count > most && high < 1e30f) { /* may not end: points on both sides of all three planes through
                                               the origin fill eight voxels at any edge length */
        mem_free(*center);
        low = high;
        high *= 2;
        GBT_TRY(voxel_centers(points->position, points->count, high, center, count, err));
    }
    for (int i = 0; i < 16 && low < high; i++) {
        const float edge = sqrtf(low) * sqrtf(high);
        float *finer;
        size_t finer_count;
        GBT_TRY(voxel_centers(points->position, points->count, edge, &finer, &finer_count, err));
        if (finer_count > most) {
            low = edge;
            mem_free(finer);
            continue;
        }
        high = edge;
        mem_free(*center);
        *center = finer;
        *count = finer_count;
    }
    return GBT_OK;
}

gbt_status init_quality_measure(const scene_points *points, float voxel_size, int max_depth, double fraction,
                                init_quality *out, gbt_error *err)
{
    const float *color = points->has_color ? points->color : NULL;
    anchor_init_def def = anchor_init_def_default();
    def.balls.voxel_size = voxel_size;
    def.balls.max_depth = max_depth;
    def.fraction = fraction;
    static const struct {
        const char *name;
        gbt_init_kind kind;
    } rows[] = {{"gb", GBT_INIT_GB}, {"adaptive", GBT_INIT_ADAPTIVE}};
    for (int i = 0; i < 2; i++) {
        anchors a;
        def.kind = rows[i].kind;
        GBT_TRY(anchors_init(points->position, color, points->count, &def, &a, NULL, err));
        out[i].name = rows[i].name;
        const gbt_status status = measure(points, a.position, a.count, &out[i], err);
        anchors_free(&a);
        GBT_TRY(status);
    }
    float *center = NULL;
    size_t count = 0;
    gbt_status status = finest_voxels(points, voxel_size, out[1].anchors, &center, &count, err);
    out[2].name = "voxel";
    if (status == GBT_OK)
        status = measure(points, center, count, &out[2], err);
    mem_free(center);
    return status;
}
