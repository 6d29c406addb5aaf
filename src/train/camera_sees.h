/* SPDX-License-Identifier: Apache-2.0 */
/* train/camera_sees.h -- is a point in a picture? Of surfaces before it nothing is known. */
#ifndef GBT_TRAIN_CAMERA_SEES_H
#define GBT_TRAIN_CAMERA_SEES_H

#include <stdbool.h>

#include "gbtrace/camera.h"

/** Where in the picture a point is, pixels; false where it is not in it. */
bool camera_sees_at(const gbt_camera *camera, const float position[3], double pixel[2]);

/** @param distance [out] optional (NULL): from the camera centre, also of a point beside the picture. Cost:
                      one projection. */
bool camera_sees(const gbt_camera *camera, const float position[3], double *distance);

#endif
