/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera.c -- rays and pixels of a camera, and the camera of a resized, cropped or subsampled image. */
#include "base/camera_lens.h"
#include "base/camera_model.h"
#include "base/camera_pose.h"
#include "base/vec.h"

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
    const camera_pose at = camera_pose_at(camera, px, py);
    camera_lens_origin(&lens, px, py, start);
    dmat_apply_transposed(at.rotation, start, start);
    dmat_apply_transposed(at.rotation, forward, dir);
    for (int i = 0; i < 3; i++)
        origin[i] = at.center[i] + start[i];
    return true;
}

bool gbt_camera_project(const gbt_camera *camera, const double point_cam[3], double pixel[2])
{
    camera_lens lens;
    return camera_lens_prepare(camera, &lens) && camera_lens_project(&lens, point_cam, pixel);
}

bool gbt_camera_pixel(const gbt_camera *camera, const double point[3], double pixel[2])
{
    camera_lens lens;
    return camera_lens_prepare(camera, &lens) && camera_pixel(camera, &lens, point, pixel);
}

gbt_camera gbt_camera_resized(const gbt_camera *camera, int width, int height)
{
    gbt_camera out = *camera;
    const int focal_count = camera_focal_count(camera->model);
    if (focal_count == 0 || width <= 0 || height <= 0 || camera->width <= 0 || camera->height <= 0)
        return out;
    const double by_x = (double)width / camera->width, by_y = (double)height / camera->height;
    out.width = width;
    out.height = height;
    const int center = camera_center_at(camera->model);
    if (focal_count == 1) {
        /* Rounding a size to whole pixels makes the two ratios differ a little; the mean halves the error. */
        out.params[0] *= 0.5 * (by_x + by_y);
    } else {
        out.params[0] *= by_x;
        out.params[1] *= by_y;
    }
    out.params[center] *= by_x;
    out.params[center + 1] *= by_y;
    return out;
}

bool gbt_camera_every(const gbt_camera *camera, int step, int x, int y, gbt_camera *out)
{
    const int focal_count = camera_focal_count(camera->model), center = camera_center_at(camera->model);
    if (focal_count == 0 || step < 1 || camera->width < step || camera->height < step)
        return false;
    const double edge = 0.5 - 0.5 * step; /* offset of the edge of the first pixel of `out` from that of
                                             `camera` */
    *out = camera_of_readout_part(camera, x + edge, y + edge, (double)step * (camera->width / step),
                                  (double)step * (camera->height / step));
    out->width = camera->width / step;
    out->height = camera->height / step;
    /* The centre of pixel i of `out`, i + 0.5, is the centre of pixel x + step i of `camera`. */
    for (int i = 0; i < focal_count; i++)
        out->params[i] /= step;
    out->params[center] = (camera->params[center] - x - 0.5) / step + 0.5;
    out->params[center + 1] = (camera->params[center + 1] - y - 0.5) / step + 0.5;
    return true;
}

bool gbt_camera_shifted(const gbt_camera *camera, double dx, double dy, gbt_camera *out)
{
    const int center = camera_center_at(camera->model);
    if (center == 0)
        return false;
    *out = camera_of_readout_part(camera, dx, dy, camera->width, camera->height);
    out->params[center] -= dx;
    out->params[center + 1] -= dy;
    return true;
}

bool gbt_camera_cropped(const gbt_camera *camera, int x, int y, int width, int height, gbt_camera *out)
{
    gbt_camera shifted;
    if (width < 1 || height < 1 || !gbt_camera_shifted(camera, x, y, &shifted))
        return false;
    *out = camera_of_readout_part(&shifted, 0, 0, width, height);
    out->width = width;
    out->height = height;
    return true;
}

void gbt_camera_half_fov_tan(const gbt_camera *camera, double tan_half[2])
{
    camera_lens lens;
    if (camera_lens_prepare(camera, &lens))
        camera_lens_half_fov_tan(&lens, camera->width, camera->height, tan_half);
    else
        tan_half[0] = tan_half[1] = 0;
}
