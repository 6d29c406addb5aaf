/* SPDX-License-Identifier: Apache-2.0 */
/* bake/backdrop.c -- represents the background by a sphere of Gaussians around everything. */
#include "bake/backdrop.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/vec.h"

/* On the unit sphere the Gaussians are sqrt(4 pi / BACKDROP_COUNT) = 0.112 apart. With this standard
   deviation they overlap enough that nothing shines through between them. */
static const double deviation = 0.135;
static const float opacity = 0.99f;

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

static double radius_around(const gaussian_cloud *cloud, const gbt_camera *cameras, size_t count,
                            const double middle[3])
{
    double radius = 0;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *m = cloud->mean + 3 * i;
        radius =
            fmax(radius, 2 * distance(middle, (const double[3]){(double)m[0], (double)m[1], (double)m[2]}));
    }
    for (size_t i = 0; i < count; i++)
        radius = fmax(radius, 4 * distance(middle, cameras[i].center));
    return fmax(radius, 1e-6);
}

gbt_status backdrop_add(gaussian_cloud *cloud, const gbt_camera *cameras, size_t count, const float color[3],
                        const sky *behind, gbt_error *err)
{
    const size_t n = cloud->count, sh_width = GAUSSIAN_SH_COUNT * 3;
    double middle[3] = {0};
    for (size_t i = 0; i < 3 * count; i++)
        middle[i % 3] += cameras[i / 3].center[i % 3] / (double)count;
    const double radius = radius_around(cloud, cameras, count, middle);
    gaussian_cloud all;
    GBT_TRY(gaussian_cloud_alloc(&all, n + BACKDROP_COUNT, err));
    memcpy(all.mean, cloud->mean, 3 * n * sizeof *all.mean);
    memcpy(all.scale_log, cloud->scale_log, 3 * n * sizeof *all.scale_log);
    memcpy(all.quat, cloud->quat, 4 * n * sizeof *all.quat);
    memcpy(all.opacity, cloud->opacity, n * sizeof *all.opacity);
    memcpy(all.sh, cloud->sh, n * sh_width * sizeof *all.sh);
    for (int i = 0; i < BACKDROP_COUNT; i++) {
        const size_t to = n + (size_t)i;
        double direction[3];
        dvec_on_sphere(i, BACKDROP_COUNT, direction);
        const float dir[3] = {(float)direction[0], (float)direction[1], (float)direction[2]};
        float seen[3];
        sky_color(behind, color, dir, seen);
        float *sh = memset(all.sh + to * sh_width, 0, sh_width * sizeof *all.sh);
        for (int k = 0; k < 3; k++) {
            all.mean[3 * to + (size_t)k] = (float)(middle[k] + radius * direction[k]);
            all.scale_log[3 * to + (size_t)k] = (float)log(deviation * radius);
            sh[k] = (seen[k] - 0.5f) / (float)GAUSSIAN_SH_0;
        }
        memcpy(all.quat + 4 * to, (const float[4]){1, 0, 0, 0}, 4 * sizeof *all.quat);
        all.opacity[to] = opacity;
    }
    all.sh_degree = cloud->sh_degree;
    gaussian_cloud_free(cloud);
    *cloud = all;
    return GBT_OK;
}
