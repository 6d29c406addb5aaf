/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_model.c -- the 18 COLMAP camera models and the orthographic one: names and parameters. */
#include "base/camera_model.h"

#include <stddef.h>

typedef struct model_row {
    const char *name;
    int param_count, focal_count;
} model_row;

static const model_row models[GBT_CAMERA_MODEL_COUNT] = {
    [GBT_CAMERA_SIMPLE_PINHOLE] = {"SIMPLE_PINHOLE", 3, 1},
    [GBT_CAMERA_PINHOLE] = {"PINHOLE", 4, 2},
    [GBT_CAMERA_SIMPLE_RADIAL] = {"SIMPLE_RADIAL", 4, 1},
    [GBT_CAMERA_RADIAL] = {"RADIAL", 5, 1},
    [GBT_CAMERA_OPENCV] = {"OPENCV", 8, 2},
    [GBT_CAMERA_OPENCV_FISHEYE] = {"OPENCV_FISHEYE", 8, 2},
    [GBT_CAMERA_FULL_OPENCV] = {"FULL_OPENCV", 12, 2},
    [GBT_CAMERA_FOV] = {"FOV", 5, 2},
    [GBT_CAMERA_SIMPLE_RADIAL_FISHEYE] = {"SIMPLE_RADIAL_FISHEYE", 4, 1},
    [GBT_CAMERA_RADIAL_FISHEYE] = {"RADIAL_FISHEYE", 5, 1},
    [GBT_CAMERA_THIN_PRISM_FISHEYE] = {"THIN_PRISM_FISHEYE", 12, 2},
    [GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE] = {"RAD_TAN_THIN_PRISM_FISHEYE", 16, 2},
    [GBT_CAMERA_SIMPLE_DIVISION] = {"SIMPLE_DIVISION", 4, 1},
    [GBT_CAMERA_DIVISION] = {"DIVISION", 5, 2},
    [GBT_CAMERA_SIMPLE_FISHEYE] = {"SIMPLE_FISHEYE", 3, 1},
    [GBT_CAMERA_FISHEYE] = {"FISHEYE", 4, 2},
    [GBT_CAMERA_EUCM] = {"EUCM", 6, 2},
    [GBT_CAMERA_EQUIRECTANGULAR] = {"EQUIRECTANGULAR", 2, 2},
};

static const model_row orthographic_row = {"ORTHOGRAPHIC", 4, 2};

static const model_row *row_of(gbt_camera_model model)
{
    if (model == GBT_CAMERA_ORTHOGRAPHIC)
        return &orthographic_row;
    return (unsigned)model < GBT_CAMERA_MODEL_COUNT ? &models[model] : NULL;
}

int gbt_camera_param_count(gbt_camera_model model)
{
    const model_row *row = row_of(model);
    return row != NULL ? row->param_count : 0;
}

const char *gbt_camera_model_name(gbt_camera_model model)
{
    const model_row *row = row_of(model);
    return row != NULL ? row->name : NULL;
}

int camera_focal_count(gbt_camera_model model)
{
    const model_row *row = row_of(model);
    return row != NULL ? row->focal_count : 0;
}
