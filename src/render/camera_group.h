/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_group.h -- what a set of cameras has in common: which way is up, what they look at, from how
   far, through which lens. */
#ifndef GBT_RENDER_CAMERA_GROUP_H
#define GBT_RENDER_CAMERA_GROUP_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct camera_group {
    double up[3];    /* unit: across the plane that more than three cameras lie in when there is one, else the
                        mean of their upward axes */
    double focus[3]; /* the point that they look at */
    double distance; /* median from a camera to the focus, > 0; to the points where they turned on the spot */
    gbt_camera lens; /* a pinhole at rest: the size of the first camera, and the median view across the
                        shorter side */
} camera_group;

/**
 * The focus is the point nearest to all axes of view (least squares). Where the axes are within about 6
 * degrees of each other, most cameras look away from that point, or it is where they stand, it is the median
 * depth of the points in front of the mean camera; without such points the local origin.
 *
 * @param cameras [in] [count], count >= 1, poses finite
 * @param points  [in] [point_count][3], scene-local
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status camera_group_make(const gbt_camera *cameras, size_t count, const float *points, size_t point_count,
                             camera_group *out, gbt_error *err);

/** The group's lens for pictures of another size: the shorter side sees as much as before. */
gbt_camera camera_group_lens(const camera_group *group, int width, int height);

#endif
