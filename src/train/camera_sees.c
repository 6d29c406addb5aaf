/* SPDX-License-Identifier: Apache-2.0 */
/* train/camera_sees.c -- projection of points into the image, and whether they are inside it. */
#include "train/camera_sees.h"

#include <stddef.h>

#include "base/vec.h"

bool camera_sees_at(const gbt_camera *camera, const float position[3], double pixel[2])
{
    const double point[3] = {(double)position[0], (double)position[1], (double)position[2]};
    return gbt_camera_pixel(camera, point, pixel) && pixel[0] >= 0 && pixel[1] >= 0 &&
           pixel[0] < camera->width && pixel[1] < camera->height;
}

bool camera_sees(const gbt_camera *camera, const float position[3], double *distance)
{
    double d[3], pixel[2];
    for (int k = 0; k < 3; k++)
        d[k] = (double)position[k] - camera->center[k];
    if (distance != NULL)
        *distance = dvec_length(d);
    return camera_sees_at(camera, position, pixel);
}
