/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_model.h -- what the parameters of a camera model are, beside what gbtrace/camera.h tells. */
#ifndef GBT_BASE_CAMERA_MODEL_H
#define GBT_BASE_CAMERA_MODEL_H

#include "gbtrace/camera.h"

/** How many focal lengths stand before the principal point: 1 or 2; 0 for an unknown model. */
int camera_focal_count(gbt_camera_model model);

#endif
