/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_camera.c -- reads the image size and lens of one frame of a transforms.json. */
#include "data/transforms_camera.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/camera_model.h"
#include "base/fail.h"
#include "base/image_header.h"
#include "base/vec.h"

/* A number, if the key is present; `*found` says whether it is. */
static gbt_status find_number(const transforms_frame *s, const char *key, double *out, bool *found,
                              gbt_error *err)
{
    const json_t *value = transforms_find(s, key);
    *found = value != NULL;
    if (value == NULL)
        return GBT_OK;
    if (!json_is_number(value))
        return transforms_fail(s, err, "not a number", key);
    *out = json_number_value(value);
    if (!(fabs(*out) <= RAW_COORDINATE_LIMIT))
        return transforms_fail(s, err, "number is too large", key);
    return GBT_OK;
}

static gbt_status find_size(const transforms_frame *s, const char *key, int *out, bool *found, gbt_error *err)
{
    double value = 0;
    GBT_TRY(find_number(s, key, &value, found, err));
    if (!*found)
        return GBT_OK;
    if (!(value >= 1 && value <= RAW_IMAGE_LIMIT && value == floor(value)))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: frame %zu: %s: out of range (wanted a whole number in 1..%d, got %g)",
                         s->file->name, s->frame_index, key, RAW_IMAGE_LIMIT, value);
    *out = (int)value;
    return GBT_OK;
}

/* The focal length in pixels from a field of view: camera_angle_x or _y in radians, else x_fov or y_fov in
   degrees; 0 when neither is present. */
static gbt_status focal_from_angle(const transforms_frame *s, char axis, int size, double *focal,
                                   gbt_error *err)
{
    double value = 0, unit = 1;
    bool found;
    char key[16];
    snprintf(key, sizeof key, "camera_angle_%c", axis);
    GBT_TRY(find_number(s, key, &value, &found, err));
    if (!found) {
        snprintf(key, sizeof key, "%c_fov", axis);
        GBT_TRY(find_number(s, key, &value, &found, err));
        unit = PI / 180;
    }
    *focal = 0;
    if (!found)
        return GBT_OK;
    const double angle = value * unit;
    if (!(angle > 0 && angle < PI))
        return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s: out of range (wanted %s, got %g)",
                         s->file->name, s->frame_index, key, unit == 1 ? "0..pi radians" : "0..180 degrees",
                         value);
    *focal = 0.5 * size / tan(0.5 * angle);
    if (!(*focal > 0 && *focal <= RAW_COORDINATE_LIMIT))
        return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s: no lens has this angle (got %g)",
                         s->file->name, s->frame_index, key, value);
    return GBT_OK;
}

/* A transforms.json can give the coefficients k1 to k4, p1 and p2. Models that use only these are supported,
   and FULL_OPENCV with its other coefficients 0. */
static bool is_supported(gbt_camera_model model)
{
    const lens_kind kind = camera_model_of(model)->kind;
    return (kind == LENS_PERSPECTIVE || kind == LENS_FISHEYE || kind == LENS_EQUIRECTANGULAR) &&
           !camera_model_has_prism(model);
}

static gbt_status find_kind(const transforms_frame *s, lens_kind *kind, bool *is_opencv, gbt_error *err)
{
    gbt_camera_model model;
    *is_opencv = false;
    const json_t *value = transforms_find(s, "camera_model");
    if (value == NULL) {
        *kind = json_is_true(transforms_find(s, "is_fisheye"))        ? LENS_FISHEYE
                : json_is_true(transforms_find(s, "equirectangular")) ? LENS_EQUIRECTANGULAR
                                                                      : LENS_PERSPECTIVE;
        return GBT_OK;
    }
    if (!json_is_string(value))
        return transforms_fail(s, err, "not a string", "camera_model");
    const char *name = json_string_value(value);
    if (camera_model_find(name, strlen(name), &model) && is_supported(model)) {
        *kind = camera_model_of(model)->kind;
        *is_opencv = model == GBT_CAMERA_OPENCV;
        return GBT_OK;
    }
    return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: camera_model is not supported: %.60s",
                     s->file->name, s->frame_index, name);
}

enum { K1, K2, K3, K4, P1, P2, LENS_COUNT };

/* Read k1 k2 k3 k4 p1 p2 from their own keys or, in this order, from distortion_params; default 0. */
static gbt_status find_distortion(const transforms_frame *s, double lens[LENS_COUNT], bool *any,
                                  gbt_error *err)
{
    static const char *const keys[LENS_COUNT] = {"k1", "k2", "k3", "k4", "p1", "p2"};
    *any = false;
    memset(lens, 0, LENS_COUNT * sizeof *lens);
    const json_t *list = transforms_find(s, "distortion_params");
    if (list != NULL && (!json_is_array(list) || json_array_size(list) != LENS_COUNT))
        return transforms_fail(s, err, "wanted 6 numbers: k1 k2 k3 k4 p1 p2", "distortion_params");
    for (size_t i = 0; i < LENS_COUNT; i++) {
        bool found;
        if (list != NULL && !json_is_number(json_array_get(list, i)))
            return transforms_fail(s, err, "not a number", "distortion_params");
        if (list != NULL)
            lens[i] = json_number_value(json_array_get(list, i));
        GBT_TRY(find_number(s, keys[i], &lens[i], &found, err));
        *any = *any || found || list != NULL;
    }
    return GBT_OK;
}

/* Read the focal lengths fl_x and fl_y, else derive them from angles; a missing y equals x. */
static gbt_status find_focal(const transforms_frame *s, const gbt_camera *camera, double focal[2],
                             raw_scene *out, gbt_error *err)
{
    bool has_x, has_y;
    double from_angle[2];
    GBT_TRY(find_number(s, "fl_x", &focal[0], &has_x, err));
    GBT_TRY(find_number(s, "fl_y", &focal[1], &has_y, err));
    GBT_TRY(focal_from_angle(s, 'x', camera->width, &from_angle[0], err));
    GBT_TRY(focal_from_angle(s, 'y', camera->height, &from_angle[1], err));
    if (!has_x && !has_y && from_angle[0] == 0 && from_angle[1] == 0)
        return transforms_fail(s, err, "neither fl_x nor camera_angle_x is given", "focal length");
    if (has_x && from_angle[0] > 0 && fabs(from_angle[0] - focal[0]) > 0.01 * fabs(focal[0]))
        out->angles_disagreeing++;
    if (!has_x)
        focal[0] = from_angle[0] > 0 ? from_angle[0] : has_y ? focal[1] : from_angle[1];
    if (!has_y)
        focal[1] = !has_x && from_angle[1] > 0 ? from_angle[1] : focal[0];
    return GBT_OK;
}

gbt_status transforms_camera(const transforms_frame *s, const char *photo, gbt_camera *camera, raw_scene *out,
                             gbt_error *err)
{
    bool has_width, has_height, has_cx, has_cy, is_opencv, any;
    lens_kind kind = LENS_PERSPECTIVE;
    double focal[2] = {0}, lens[LENS_COUNT];
    GBT_TRY(find_size(s, "w", &camera->width, &has_width, err));
    GBT_TRY(find_size(s, "h", &camera->height, &has_height, err));
    if (!has_width || !has_height) {
        image_header header;
        GBT_TRY(image_header_read(photo, &header, err));
        camera->width = has_width ? camera->width : header.width;
        camera->height = has_height ? camera->height : header.height;
    }
    GBT_TRY(find_kind(s, &kind, &is_opencv, err));
    double *p = camera->params;
    const raw_place place = {s->file->name, RAW_MARK_FRAME, s->frame_index};
    if (kind == LENS_EQUIRECTANGULAR) {
        camera->model = GBT_CAMERA_EQUIRECTANGULAR;
        p[0] = camera->width;
        p[1] = camera->height;
        return raw_check_camera(camera, place, err);
    }
    GBT_TRY(find_focal(s, camera, focal, out, err));
    double cx = 0.5 * camera->width, cy = 0.5 * camera->height;
    GBT_TRY(find_number(s, "cx", &cx, &has_cx, err));
    GBT_TRY(find_number(s, "cy", &cy, &has_cy, err));
    GBT_TRY(find_distortion(s, lens, &any, err));
    p[0] = focal[0];
    p[1] = focal[1];
    p[2] = cx;
    p[3] = cy;
    if (kind == LENS_FISHEYE) {
        if (lens[P1] != 0 || lens[P2] != 0)
            return transforms_fail(s, err, "a fisheye with tangential distortion is not supported", "p1, p2");
        camera->model = GBT_CAMERA_OPENCV_FISHEYE;
        memcpy(p + 4, lens, 4 * sizeof *p);
    } else if (!any && !is_opencv) {
        camera->model = GBT_CAMERA_PINHOLE;
    } else {
        if (lens[K4] != 0)
            return transforms_fail(s, err, "not supported for a lens that is not a fisheye", "k4");
        camera->model = lens[K3] != 0 ? GBT_CAMERA_FULL_OPENCV : GBT_CAMERA_OPENCV;
        p[4] = lens[K1];
        p[5] = lens[K2];
        p[6] = lens[P1];
        p[7] = lens[P2];
        if (lens[K3] != 0)
            p[8] = lens[K3];
    }
    return raw_check_camera(camera, place, err);
}
