/* base/camera.c -- the 18 COLMAP camera models and the orthographic one: names, parameters, rays, other sizes. */
#include "base/camera_lens.h"

#include <stddef.h>

#include "base/vec.h"

#define PI 3.14159265358979323846

typedef struct model_row {
    const char *name;
    int param_count;
    bool single_f;
} model_row;

static const model_row models[GBT_CAMERA_MODEL_COUNT] = {
    [GBT_CAMERA_SIMPLE_PINHOLE] = {"SIMPLE_PINHOLE", 3, true},
    [GBT_CAMERA_PINHOLE] = {"PINHOLE", 4, false},
    [GBT_CAMERA_SIMPLE_RADIAL] = {"SIMPLE_RADIAL", 4, true},
    [GBT_CAMERA_RADIAL] = {"RADIAL", 5, true},
    [GBT_CAMERA_OPENCV] = {"OPENCV", 8, false},
    [GBT_CAMERA_OPENCV_FISHEYE] = {"OPENCV_FISHEYE", 8, false},
    [GBT_CAMERA_FULL_OPENCV] = {"FULL_OPENCV", 12, false},
    [GBT_CAMERA_FOV] = {"FOV", 5, false},
    [GBT_CAMERA_SIMPLE_RADIAL_FISHEYE] = {"SIMPLE_RADIAL_FISHEYE", 4, true},
    [GBT_CAMERA_RADIAL_FISHEYE] = {"RADIAL_FISHEYE", 5, true},
    [GBT_CAMERA_THIN_PRISM_FISHEYE] = {"THIN_PRISM_FISHEYE", 12, false},
    [GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE] = {"RAD_TAN_THIN_PRISM_FISHEYE", 16, false},
    [GBT_CAMERA_SIMPLE_DIVISION] = {"SIMPLE_DIVISION", 4, true},
    [GBT_CAMERA_DIVISION] = {"DIVISION", 5, false},
    [GBT_CAMERA_SIMPLE_FISHEYE] = {"SIMPLE_FISHEYE", 3, true},
    [GBT_CAMERA_FISHEYE] = {"FISHEYE", 4, false},
    [GBT_CAMERA_EUCM] = {"EUCM", 6, false},
    [GBT_CAMERA_EQUIRECTANGULAR] = {"EQUIRECTANGULAR", 2, false},
};

static const model_row orthographic_row = {"ORTHOGRAPHIC", 4, false};

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
    return row == NULL ? 0 : row->single_f ? 1 : 2;
}

bool gbt_camera_unproject(const gbt_camera *camera, double px, double py, double dir_cam[3])
{
    camera_lens lens;
    return camera_lens_prepare(camera, &lens) && camera_lens_unproject(&lens, px, py, dir_cam);
}

bool gbt_camera_ray(const gbt_camera *camera, double px, double py, double origin[3], double dir[3])
{
    camera_lens lens;
    double start[3], forward[3];
    if (!camera_lens_prepare(camera, &lens) || !camera_lens_unproject(&lens, px, py, forward))
        return false;
    camera_lens_origin(&lens, px, py, start);
    dmat_apply_transposed(camera->rotation, start, start);
    dmat_apply_transposed(camera->rotation, forward, dir);
    for (int i = 0; i < 3; i++)
        origin[i] = camera->center[i] + start[i];
    return true;
}

bool gbt_camera_project(const gbt_camera *camera, const double point_cam[3], double pixel[2])
{
    camera_lens lens;
    return camera_lens_prepare(camera, &lens) && camera_lens_project(&lens, point_cam, pixel);
}

gbt_camera gbt_camera_resized(const gbt_camera *camera, int width, int height)
{
    gbt_camera out = *camera;
    const model_row *row = row_of(camera->model);
    if (row == NULL || width <= 0 || height <= 0 || camera->width <= 0 || camera->height <= 0)
        return out;
    const double by_x = (double)width / camera->width, by_y = (double)height / camera->height;
    out.width = width, out.height = height;
    if (row->single_f) {
        /* Rounding a size to whole pixels makes the two ratios differ a little; the mean halves the error. */
        out.params[0] *= 0.5 * (by_x + by_y), out.params[1] *= by_x, out.params[2] *= by_y;
        return out;
    }
    out.params[0] *= by_x, out.params[1] *= by_y;
    if (row->param_count > 2)
        out.params[2] *= by_x, out.params[3] *= by_y;
    return out;
}

bool gbt_camera_every(const gbt_camera *camera, int step, int x, int y, gbt_camera *out)
{
    const model_row *row = row_of(camera->model);
    if (row == NULL || row->param_count < 3 || step < 1 || camera->width < step || camera->height < step)
        return false;
    *out = *camera;
    out->width = camera->width / step, out->height = camera->height / step;
    /* The middle of pixel i of `out`, i + 0.5, is the middle of pixel x + step i of `camera`. */
    const int focal_count = camera_focal_count(camera->model);
    for (int i = 0; i < focal_count; i++)
        out->params[i] /= step;
    out->params[focal_count] = (camera->params[focal_count] - x - 0.5) / step + 0.5;
    out->params[focal_count + 1] = (camera->params[focal_count + 1] - y - 0.5) / step + 0.5;
    return true;
}

bool gbt_camera_shifted(const gbt_camera *camera, double dx, double dy, gbt_camera *out)
{
    if (!gbt_camera_every(camera, 1, 0, 0, out))
        return false;
    const int focal_count = camera_focal_count(camera->model);
    out->params[focal_count] -= dx, out->params[focal_count + 1] -= dy;
    return true;
}

void gbt_camera_half_fov_tan(const gbt_camera *camera, double tan_half[2])
{
    camera_lens lens;
    tan_half[0] = tan_half[1] = 0;
    if (!camera_lens_prepare(camera, &lens) || lens.kind == LENS_ORTHOGRAPHIC)
        return;
    /* The full turn of an equirectangular image has, at its centre, w / (2 pi) pixels per radian. */
    const bool turn = lens.kind == LENS_EQUIRECTANGULAR;
    tan_half[0] = camera->width / (2 * (turn ? lens.fx / (2 * PI) : lens.fx));
    tan_half[1] = camera->height / (2 * (turn ? lens.fy / PI : lens.fy));
}
