/* SPDX-License-Identifier: Apache-2.0 */
/* view/pick.c -- find the point of the scene behind a pixel. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "render/render_outputs.h"
#include "view/viewer.h"

/* A camera of one pixel that looks along the ray of `camera` through `pixel`, with the same pixel size. False
   if the lens has no ray there. */
static bool aim(const gbt_camera *camera, const double pixel[2], gbt_camera *out)
{
    double origin[3], dir[3], target[3], half_fov_tan[2];
    if (!gbt_camera_ray(camera, pixel[0], pixel[1], origin, dir))
        return false;
    gbt_camera_half_fov_tan(camera, half_fov_tan);
    const double focal = half_fov_tan[0] > 0 ? 0.5 * camera->width / half_fov_tan[0] : 1000;
    int least = 0;
    for (int k = 0; k < 3; k++) {
        target[k] = origin[k] + dir[k];
        if (fabs(dir[k]) < fabs(dir[least]))
            least = k;
    }
    double up[3] = {0, 0, 0};
    up[least] = 1; /* not parallel to the view */
    memset(out, 0, sizeof *out);
    out->model = GBT_CAMERA_PINHOLE;
    out->width = out->height = 1;
    out->params[0] = out->params[1] = focal;
    out->params[2] = out->params[3] = 0.5;
    return gbt_camera_look_at(origin, target, up, out);
}

/* The median depth along the ray of a one-pixel camera, where its transmittance falls below one half; 0 if it
   does not. */
static gbt_status find_depth(viewer_state *s, const gbt_camera *one, int view, double *depth, gbt_error *err)
{
    const ray_shot shot = ray_shot_of(one);
    const request plain = {.renderer = GBT_RENDERER_TRACE, .preset = GBT_PRESET_DEFAULT, .view = view};
    render_output_images images = {0};
    GBT_TRY(viewer_prepare(s, one, &plain, false, err));
    const gbt_status status = render_outputs_trace(s->run, &shot, 1u << OUTPUT_MEDIAN_DEPTH, &images, err);
    *depth = status == GBT_OK ? (double)images.of[OUTPUT_MEDIAN_DEPTH].pixels[0] : 0;
    render_output_images_free(&images);
    return status;
}

gbt_status viewer_pick(viewer_state *s, const request *what, answer *out, gbt_error *err)
{
    gbt_camera camera, one;
    double depth = 0;
    char text[256];
    GBT_TRY(viewer_camera(s, what, &camera, err));
    if (!(what->pixel[0] < camera.width && what->pixel[1] < camera.height))
        return base_fail(err, GBT_ERR_ARGUMENT, "x, y: %g, %g (the picture has %d x %d pixels)",
                         what->pixel[0], what->pixel[1], camera.width, camera.height);
    if (aim(&camera, what->pixel, &one))
        GBT_TRY(find_depth(s, &one, what->view, &depth, err));
    if (depth > 0) {
        const double *forward = one.rotation + 6, *origin = s->run->model.origin;
        double point[3];
        for (int k = 0; k < 3; k++)
            point[k] = one.center[k] + origin[k] + depth * forward[k];
        snprintf(text, sizeof text, "{\"hit\":true,\"depth\":%.9g,\"point\":[%.17g,%.17g,%.17g]}", depth,
                 point[0], point[1], point[2]);
    } else {
        snprintf(text, sizeof text, "{\"hit\":false}");
    }
    answer_text(out, 200, "application/json", text);
    return GBT_OK;
}
