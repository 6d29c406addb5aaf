/* SPDX-License-Identifier: Apache-2.0 */
/* train/scale_limit.c -- upper limits of scales from the distance to the nearest training camera. */
#include "train/scale_limit.h"

#include <math.h>

#include "base/memory.h"
#include "bvh/points.h"

/* The given camera centres of the data set: learned poses would give a resumed run other limits. */
static void camera_centers(const trainer *t, float *center)
{
    for (size_t v = 0; v < t->train_count; v++) {
        const gbt_camera *camera = poses_given(&t->poses, &t->scene, t->train_views[v]);
        for (size_t k = 0; k < 3; k++)
            center[3 * v + k] = (float)camera->center[k];
    }
}

static gbt_status find_distances(const trainer *t, double *squared, gbt_error *err)
{
    float *center = mem_alloc(3 * t->train_count, sizeof *center, "cameras", err);
    uint32_t *nearest = mem_alloc(t->anchors.count, sizeof *nearest, "cameras", err);
    gbt_status status = center == NULL || nearest == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK) {
        camera_centers(t, center);
        status = points_find_nearest(center, t->train_count, t->anchors.position, t->anchors.count, nearest,
                                     squared, err);
    }
    mem_free(nearest);
    mem_free(center);
    return status;
}

gbt_status scale_limit_update(trainer *t, gbt_error *err)
{
    const size_t count = t->anchors.count;
    float *log_max = mem_alloc(count, sizeof *log_max, "largest scales", err);
    double *squared = mem_alloc(count, sizeof *squared, "cameras", err);
    gbt_status status = log_max == NULL || squared == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = find_distances(t, squared, err);
    if (status == GBT_OK) {
        for (size_t i = 0; i < count; i++)
            log_max[i] = fminf(t->scale_log_limit, (float)(log(t->rules.widest) + 0.5 * log(squared[i])));
        mem_free(t->scale_log_max);
        t->scale_log_max = log_max;
        log_max = NULL;
    }
    mem_free(squared);
    mem_free(log_max);
    return status;
}
