/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_cloud.c -- memory of plain Gaussians. */
#include "data/gaussian_cloud.h"

#include <math.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"

gbt_status gaussian_cloud_alloc(gaussian_cloud *cloud, size_t count, gbt_error *err)
{
    *cloud = (gaussian_cloud){.count = count};
    cloud->mean = mem_alloc(count, 3 * sizeof(float), "Gaussian means", err);
    cloud->scale_log = mem_alloc(count, 3 * sizeof(float), "Gaussian scales", err);
    cloud->quat = mem_alloc(count, 4 * sizeof(float), "Gaussian rotations", err);
    cloud->opacity = mem_alloc(count, sizeof(float), "Gaussian opacities", err);
    cloud->sh = mem_alloc(count, GAUSSIAN_SH_COUNT * 3 * sizeof(float), "Gaussian colours", err);
    if (cloud->mean != NULL && cloud->scale_log != NULL && cloud->quat != NULL && cloud->opacity != NULL &&
        cloud->sh != NULL)
        return GBT_OK;
    gaussian_cloud_free(cloud);
    return GBT_ERR_NO_MEMORY;
}

void gaussian_cloud_free(gaussian_cloud *cloud)
{
    mem_free(cloud->mean);
    mem_free(cloud->scale_log);
    mem_free(cloud->quat);
    mem_free(cloud->opacity);
    mem_free(cloud->sh);
    memset(cloud, 0, sizeof *cloud);
}

bool gaussian_limit_scales(float scale_log[3])
{
    const float least =
        fmaxf(scale_log[0], fmaxf(scale_log[1], scale_log[2])) - (float)log(GAUSSIAN_SCALE_RATIO);
    bool changed = false;
    for (int k = 0; k < 3; k++) {
        changed = changed || scale_log[k] < least;
        scale_log[k] = fmaxf(scale_log[k], least);
    }
    return changed;
}

void gaussian_cloud_warn(const gaussian_cloud *cloud, const char *name)
{
    if (cloud->dropped + cloud->identity_rotations + cloud->scales_clamped == 0)
        return;
    log_warn("%s: of %zu Gaussians %zu were left out (a value is not usable), %zu have no rotation (all "
             "zero: read as "
             "none), %zu a scale below 1/%g of their largest (raised to it)",
             name, cloud->count + cloud->dropped, cloud->dropped, cloud->identity_rotations,
             cloud->scales_clamped, GAUSSIAN_SCALE_RATIO);
}
