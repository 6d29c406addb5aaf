/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/sound.h -- what must hold for whatever a reader accepted. */
#ifndef GBT_TEST_DATA_SOUND_H
#define GBT_TEST_DATA_SOUND_H

#include <math.h>

#include "data/gaussian_cloud.h"
#include "data/raw.h"

static inline bool raw_is_sound(const raw_scene *raw)
{
    for (size_t i = 0; i < raw->view_count; i++) {
        const gbt_camera *camera = &raw->views[i].camera;
        const char *name = raw->views[i].name;
        if (name == NULL || name[0] == '\0' || name[0] == '/' || camera->width < 1 || camera->height < 1 ||
            !(camera->params[0] > 0))
            return false;
        for (int k = 0; k < 3; k++) {
            const double *row = camera->rotation + 3 * k;
            const double length = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
            if (!isfinite(camera->center[k]) || !(fabs(length - 1) < 1e-9))
                return false;
        }
    }
    for (size_t i = 0; i < 3 * raw->point_count; i++)
        if (!isfinite(raw->position[i]) || !(raw->color[i] >= 0 && raw->color[i] <= 1))
            return false;
    return true;
}

static inline bool cloud_is_sound(const gaussian_cloud *cloud)
{
    if (cloud->count == 0 || cloud->sh_degree < 0 || cloud->sh_degree > 3)
        return false;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *q = cloud->quat + 4 * i, *scale = cloud->scale_log + 3 * i;
        if (!(fabsf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) < 1e-5f) ||
            !(cloud->opacity[i] >= 0 && cloud->opacity[i] <= 1))
            return false;
        for (size_t k = 0; k < 3; k++)
            if (!isfinite(cloud->mean[3 * i + k]) || !(fabsf(scale[k]) <= 30) ||
                !(scale[k] >= scale[(k + 1) % 3] - 9.211f))
                return false;
        for (size_t k = 0; k < 48; k++)
            if (!isfinite(cloud->sh[48 * i + k]))
                return false;
    }
    return true;
}

#endif
