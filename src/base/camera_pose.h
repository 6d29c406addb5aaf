/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_pose.h -- poses of a camera in motion: between two given poses, and during a rolling-shutter
   read-out. */
#ifndef GBT_BASE_CAMERA_POSE_H
#define GBT_BASE_CAMERA_POSE_H

#include <stdbool.h>

#include "base/camera_lens.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/** Motion of a camera from one pose to another: rotation about a fixed axis at constant rate (slerp),
    translation along a line. */
typedef struct camera_motion {
    double start_rotation[9], axis[3],
        angle; /* the rotation, in the axes of the starting camera; angle in [0, pi] radians */
    double start_center[3], way[3];
} camera_motion;

/** False when one of the two matrices is not a rotation (to 1e-6), or a centre is not finite. */
bool camera_motion_prepare(const gbt_camera *start, const gbt_camera *end, camera_motion *out);

/** World-to-camera rotation and centre at time t: 0 gives exactly the start, 1 the end up to rounding. */
void camera_motion_at(const camera_motion *motion, double t, double rotation[9], double center[3]);

/** Whether the camera does not move during read-out: no rolling shutter, or a motion of zero. */
bool camera_is_still(const gbt_camera *camera);

/** World-to-camera rotation, and the centre. */
typedef struct camera_pose {
    double rotation[9], center[3];
} camera_pose;

/** Pose at the fraction `share` of the read-out: 0 is the top or left edge of the image, 0.5 gives exactly
    the camera's own pose. */
camera_pose camera_pose_during(const gbt_camera *camera, double share);

/** Pose at which an image point is exposed. */
camera_pose camera_pose_at(const gbt_camera *camera, double px, double py);

/** Poses at which the middle of each image line is exposed: one per row or column, or a single one for a
    camera that does not move. [*count], free with mem_free(); NULL without memory. */
camera_pose *camera_line_poses(const gbt_camera *camera, int *count, gbt_error *err);

/** Image point of a world point from a given pose; false where the lens does not see it. */
bool camera_pose_pixel(const camera_pose *pose, const camera_lens *lens, const double point[3],
                       double pixel[2]);

/** gbt_camera_pixel() with a prepared lens, with the same bits. */
bool camera_pixel(const gbt_camera *camera, const camera_lens *lens, const double point[3], double pixel[2]);

/** The camera with the pose and motion that it has while a part of its image is read out: `width` x `height`
    pixels from (x, y) on, which may extend beyond the edges. */
gbt_camera camera_of_readout_part(const gbt_camera *camera, double x, double y, double width, double height);

/**
 * Give `camera` a rolling shutter with the motion from `start` (time 0) to `end` (time 1) (camera_motion):
 * the top or left edge of the image is exposed at time `first`, the other edge at time `last`.
 *
 * @return as camera_motion_prepare(); `camera` is unchanged on failure
 */
bool camera_set_readout(const gbt_camera *start, const gbt_camera *end, gbt_camera_shutter shutter,
                        double first, double last, gbt_camera *camera);

#endif
