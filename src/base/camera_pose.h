/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_pose.h -- where a camera stands on the way between two poses, and while its image is read out.
 */
#ifndef GBT_BASE_CAMERA_POSE_H
#define GBT_BASE_CAMERA_POSE_H

#include <stdbool.h>

#include "base/camera_lens.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

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

/** Does the camera stand still while its image is taken? So it does when its motion is zero. */
bool camera_is_still(const gbt_camera *camera);

/** World to camera, and the centre. */
typedef struct camera_pose {
    double rotation[9], center[3];
} camera_pose;

/** Pose when the place `share` of the readout is taken: 0 is the top or left edge of the image, 0.5 the
    camera's own pose, to the bit. */
camera_pose camera_pose_during(const gbt_camera *camera, double share);

/** Pose when an image point is taken. */
camera_pose camera_pose_at(const gbt_camera *camera, double px, double py);

/** When the middle of each line of the image is taken: a pose per row or column, or one for a camera that
    stands still. [*count], mem_free(); NULL without memory. */
camera_pose *camera_line_poses(const gbt_camera *camera, int *count, gbt_error *err);

/** Image point of a point of the world, from one pose; false where the lens does not see it. */
bool camera_pose_pixel(const camera_pose *pose, const camera_lens *lens, const double point[3],
                       double pixel[2]);

/** gbt_camera_pixel() with the camera's lens prepared, same bits. */
bool camera_pixel(const gbt_camera *camera, const camera_lens *lens, const double point[3], double pixel[2]);

/** The same camera with the pose and motion that it has while a part of its image is read out: `width` by
    `height` pixels from (x, y) on, which may lie beyond the edges. */
gbt_camera camera_reading(const gbt_camera *camera, double x, double y, double width, double height);

/**
 * Give `camera` a rolling shutter from two poses (camera_motion): at the top or left edge of the image it is
 * at time `first` of the way from `start` (0) to `end` (1), at the other edge at time `last`.
 *
 * @return as camera_motion_prepare(); `camera` is unchanged on failure
 */
bool camera_set_readout(const gbt_camera *start, const gbt_camera *end, gbt_camera_shutter shutter,
                        double first, double last, gbt_camera *camera);

#endif
