/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_group.h -- what a set of cameras has in common: the up direction, the point they look at, its
   distance, and a typical lens. */
#ifndef GBT_RENDER_CAMERA_GROUP_H
#define GBT_RENDER_CAMERA_GROUP_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct camera_group {
    double up[3]; /* unit; normal of the plane in which more than three cameras lie, else the mean of their up
                     axes */
    double focus[3]; /* the point that they look at */
    double distance; /* median from a camera to the focus, > 0; to the points if the cameras only rotated in
                        place */
    gbt_camera lens; /* a pinhole without motion: the size of the first camera, and the median field of view
                        across the shorter side */
} camera_group;

/**
 * The focus is the point nearest to all viewing axes (least squares). It is replaced if the axes are within
 * about 6 degrees of each other, if most cameras look away from it, or if it is where the cameras stand: then
 * it lies in the mean viewing direction at the median depth of the points in front, or, without such points,
 * at the local origin.
 *
 * @param cameras [in] [count], count >= 1, poses finite
 * @param points  [in] [point_count][3], scene-local
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status camera_group_make(const gbt_camera *cameras, size_t count, const float *points, size_t point_count,
                             camera_group *out, gbt_error *err);

/** The group's lens for pictures of another size, with the same field of view across the shorter side. */
gbt_camera camera_group_lens(const camera_group *group, int width, int height);

#endif
