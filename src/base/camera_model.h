/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_model.h -- the list of camera models: name and parameters of each, and the slots of the lens
   pipeline (base/camera_lens.h) that they fill. */
#ifndef GBT_BASE_CAMERA_MODEL_H
#define GBT_BASE_CAMERA_MODEL_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/camera.h"

/** How a direction is projected to a point of the plane, before distortion. */
typedef enum lens_kind {
    LENS_PERSPECTIVE, /* (X / Z, Y / Z), Z > 0 */
    LENS_FISHEYE,     /* (X, Y) scaled to length theta = angle to the axis, theta in [0, pi] */
    LENS_FOV,         /* perspective, then radius atan(2 r tan(omega / 2)) / omega */
    LENS_DIVISION,
    LENS_EUCM,
    LENS_EQUIRECTANGULAR,
    LENS_ORTHOGRAPHIC /* (X, Y), whatever Z > 0 */
} lens_kind;

/** The slot of the lens pipeline that a parameter fills. */
typedef enum lens_slot {
    LENS_F, /* both focal lengths */
    LENS_FX,
    LENS_FY,
    LENS_CX,
    LENS_CY,
    LENS_N1, /* radial factor: coefficients of r^2, r^4, ... in the numerator */
    LENS_N2,
    LENS_N3,
    LENS_N4,
    LENS_N5,
    LENS_N6,
    LENS_D1, /* and in the denominator */
    LENS_D2,
    LENS_D3,
    LENS_TX, /* tangential */
    LENS_TY,
    LENS_S0, /* thin prism */
    LENS_S1,
    LENS_S2,
    LENS_S3,
    LENS_SHAPE0, /* shape of closed-form lenses: omega; k; alpha */
    LENS_SHAPE1  /* beta */
} lens_slot;

typedef struct camera_model {
    const char *name;
    const char *param_names; /* separated by spaces */
    lens_kind kind;
    lens_slot slots[GBT_CAMERA_MAX_PARAMS]; /* slot of each parameter, in order */
    bool extra_last; /* tangential and prism terms are evaluated at the radially distorted point */
} camera_model;

/** NULL for an unknown model. */
const camera_model *camera_model_of(gbt_camera_model model);

/** Find a model by its name of `length` letters; false when there is none. */
bool camera_model_find(const char *name, size_t length, gbt_camera_model *out);

/** Number of focal lengths, which come before the principal point: 1 or 2; 0 for an unknown model. */
int camera_focal_count(gbt_camera_model model);

/** Index of the principal point in params, after the focal lengths. Panoramas have none in files; the
    corresponding image point, where the whole panorama begins, is stored in the last two params, where values
    left over from another model are unlikely. */
int camera_center_at(gbt_camera_model model);

/** Whether the model has thin prism terms. */
bool camera_model_has_prism(gbt_camera_model model);

#endif
