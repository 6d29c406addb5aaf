/* SPDX-License-Identifier: Apache-2.0 */
/* train/camera_sees.h -- does a point project into a camera's image? Occlusion is ignored. */
#ifndef GBT_TRAIN_CAMERA_SEES_H
#define GBT_TRAIN_CAMERA_SEES_H

#include <stdbool.h>

#include "gbtrace/camera.h"

/** Image point of a world point, pixels; false when it is outside the image. */
bool camera_sees_at(const gbt_camera *camera, const float position[3], double pixel[2]);

/** @param distance [out] optional (NULL): from the camera centre, also set for a point outside the image.
                      Cost: one projection. */
bool camera_sees(const gbt_camera *camera, const float position[3], double *distance);

#endif
