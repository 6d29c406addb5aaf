/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_model.c -- the list of camera models. A new model is a row here and a number in
   gbtrace/camera.h, unless its formula is new. */
#include "base/camera_model.h"

#include <string.h>

/* COLMAP's models, indexed by its numbers. docs/cameras.md has the same list; tests/base/test_camera.c
   compares them. */
static const camera_model models[GBT_CAMERA_MODEL_COUNT] = {
    [GBT_CAMERA_SIMPLE_PINHOLE] =
        {"SIMPLE_PINHOLE", "f cx cy", LENS_PERSPECTIVE, {LENS_F, LENS_CX, LENS_CY}, false},
    [GBT_CAMERA_PINHOLE] =
        {"PINHOLE", "fx fy cx cy", LENS_PERSPECTIVE, {LENS_FX, LENS_FY, LENS_CX, LENS_CY}, false},
    [GBT_CAMERA_SIMPLE_RADIAL] =
        {"SIMPLE_RADIAL", "f cx cy k", LENS_PERSPECTIVE, {LENS_F, LENS_CX, LENS_CY, LENS_N1}, false},
    [GBT_CAMERA_RADIAL] =
        {"RADIAL", "f cx cy k1 k2", LENS_PERSPECTIVE, {LENS_F, LENS_CX, LENS_CY, LENS_N1, LENS_N2}, false},
    [GBT_CAMERA_OPENCV] = {"OPENCV",
                           "fx fy cx cy k1 k2 p1 p2",
                           LENS_PERSPECTIVE,
                           {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_N1, LENS_N2, LENS_TY, LENS_TX},
                           false},
    [GBT_CAMERA_OPENCV_FISHEYE] = {"OPENCV_FISHEYE",
                                   "fx fy cx cy k1 k2 k3 k4",
                                   LENS_FISHEYE,
                                   {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_N1, LENS_N2, LENS_N3, LENS_N4},
                                   false},
    [GBT_CAMERA_FULL_OPENCV] = {"FULL_OPENCV",
                                "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
                                LENS_PERSPECTIVE,
                                {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_N1, LENS_N2, LENS_TY, LENS_TX,
                                 LENS_N3, LENS_D1, LENS_D2, LENS_D3},
                                false},
    [GBT_CAMERA_FOV] =
        {"FOV", "fx fy cx cy omega", LENS_FOV, {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_SHAPE0}, false},
    [GBT_CAMERA_SIMPLE_RADIAL_FISHEYE] =
        {"SIMPLE_RADIAL_FISHEYE", "f cx cy k", LENS_FISHEYE, {LENS_F, LENS_CX, LENS_CY, LENS_N1}, false},
    [GBT_CAMERA_RADIAL_FISHEYE] = {"RADIAL_FISHEYE",
                                   "f cx cy k1 k2",
                                   LENS_FISHEYE,
                                   {LENS_F, LENS_CX, LENS_CY, LENS_N1, LENS_N2},
                                   false},
    [GBT_CAMERA_THIN_PRISM_FISHEYE] = {"THIN_PRISM_FISHEYE",
                                       "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1",
                                       LENS_FISHEYE,
                                       {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_N1, LENS_N2, LENS_TY,
                                        LENS_TX, LENS_N3, LENS_N4, LENS_S0, LENS_S2},
                                       false},
    [GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE] = {"RAD_TAN_THIN_PRISM_FISHEYE",
                                               "fx fy cx cy k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3",
                                               LENS_FISHEYE,
                                               {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_N1, LENS_N2, LENS_N3,
                                                LENS_N4, LENS_N5, LENS_N6, LENS_TX, LENS_TY, LENS_S0, LENS_S1,
                                                LENS_S2, LENS_S3},
                                               .extra_last = true},
    [GBT_CAMERA_SIMPLE_DIVISION] =
        {"SIMPLE_DIVISION", "f cx cy k", LENS_DIVISION, {LENS_F, LENS_CX, LENS_CY, LENS_SHAPE0}, false},
    [GBT_CAMERA_DIVISION] = {"DIVISION",
                             "fx fy cx cy k",
                             LENS_DIVISION,
                             {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_SHAPE0},
                             false},
    [GBT_CAMERA_SIMPLE_FISHEYE] =
        {"SIMPLE_FISHEYE", "f cx cy", LENS_FISHEYE, {LENS_F, LENS_CX, LENS_CY}, false},
    [GBT_CAMERA_FISHEYE] =
        {"FISHEYE", "fx fy cx cy", LENS_FISHEYE, {LENS_FX, LENS_FY, LENS_CX, LENS_CY}, false},
    [GBT_CAMERA_EUCM] = {"EUCM",
                         "fx fy cx cy alpha beta",
                         LENS_EUCM,
                         {LENS_FX, LENS_FY, LENS_CX, LENS_CY, LENS_SHAPE0, LENS_SHAPE1},
                         false},
    [GBT_CAMERA_EQUIRECTANGULAR] = {"EQUIRECTANGULAR", "w h", LENS_EQUIRECTANGULAR, {LENS_FX, LENS_FY}},
};

/* Models that COLMAP does not have. */
static const camera_model orthographic = {.name = "ORTHOGRAPHIC",
                                          .param_names = "sx sy cx cy",
                                          .kind = LENS_ORTHOGRAPHIC,
                                          .slots = {LENS_FX, LENS_FY, LENS_CX, LENS_CY}};

const camera_model *camera_model_of(gbt_camera_model model)
{
    if (model == GBT_CAMERA_ORTHOGRAPHIC)
        return &orthographic;
    return (unsigned)model < GBT_CAMERA_MODEL_COUNT ? &models[model] : NULL;
}

int gbt_camera_model_count(void) { return GBT_CAMERA_MODEL_COUNT + 1; }

gbt_camera_model gbt_camera_model_at(int index)
{
    return index == GBT_CAMERA_MODEL_COUNT ? GBT_CAMERA_ORTHOGRAPHIC : (gbt_camera_model)index;
}

int gbt_camera_param_count(gbt_camera_model model)
{
    const camera_model *m = camera_model_of(model);
    int count = m != NULL;
    for (const char *at = m != NULL ? m->param_names : ""; *at != '\0'; at++)
        count += *at == ' ';
    return count;
}

const char *gbt_camera_param_names(gbt_camera_model model)
{
    const camera_model *m = camera_model_of(model);
    return m != NULL ? m->param_names : NULL;
}

const char *gbt_camera_model_name(gbt_camera_model model)
{
    const camera_model *m = camera_model_of(model);
    return m != NULL ? m->name : NULL;
}

bool camera_model_find(const char *name, size_t length, gbt_camera_model *out)
{
    for (int i = 0; i < gbt_camera_model_count(); i++) {
        const char *here = gbt_camera_model_name(gbt_camera_model_at(i));
        if (strlen(here) == length && memcmp(here, name, length) == 0) {
            *out = gbt_camera_model_at(i);
            return true;
        }
    }
    return false;
}

int camera_focal_count(gbt_camera_model model)
{
    const camera_model *m = camera_model_of(model);
    return m == NULL ? 0 : m->slots[0] == LENS_F ? 1 : 2;
}

int camera_center_at(gbt_camera_model model)
{
    return model == GBT_CAMERA_EQUIRECTANGULAR ? GBT_CAMERA_MAX_PARAMS - 2 : camera_focal_count(model);
}

bool camera_model_has_prism(gbt_camera_model model)
{
    const camera_model *m = camera_model_of(model);
    for (int i = 0; i < gbt_camera_param_count(model); i++)
        if (m->slots[i] >= LENS_S0 && m->slots[i] <= LENS_S3)
            return true;
    return false;
}
