/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_pose.h -- where a camera stands on the way between two poses. */
#ifndef GBT_BASE_CAMERA_POSE_H
#define GBT_BASE_CAMERA_POSE_H

#include <stdbool.h>

#include "gbtrace/camera.h"

/** A camera on its way from one pose to another: turning about one axis at one rate (slerp), moving along a
    line. */
typedef struct camera_motion {
    double start_rotation[9], axis[3],
        angle; /* the turn, in the axes of the starting camera; angle in [0, pi] radians */
    double start_center[3], way[3];
} camera_motion;

/** False when one of the two rotations is not one (to 1e-6), or a centre is not finite. */
bool camera_motion_prepare(const gbt_camera *start, const gbt_camera *end, camera_motion *out);

/** World to camera and centre at time t: 0 gives the start's bits, 1 the end to rounding. */
void camera_motion_at(const camera_motion *motion, double t, double rotation[9], double center[3]);

#endif
