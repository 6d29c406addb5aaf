/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_write.c -- writes a transforms.json for cameras with a rolling shutter. */
#include "data/transforms_write.h"

#include <stdbool.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "data/json_out.h"

/* The pose at the fraction `share` of the readout: camera to world, OpenGL's axes. NULL without memory. */
static json_t *matrix_at(const gbt_camera *camera, double share)
{
    const camera_pose pose = camera_pose_during(camera, share);
    const double *r = pose.rotation, *c = pose.center;
    return json_pack("[[f,f,f,f],[f,f,f,f],[f,f,f,f],[i,i,i,i]]", r[0], -r[3], -r[6], c[0], r[1], -r[4],
                     -r[7], c[1], r[2], -r[5], -r[8], c[2], 0, 0, 0, 1);
}

static json_t *frame_of(const char *name, const gbt_camera *camera)
{
    return json_pack("{s:o,s:o,s:o}", "file_path", json_sprintf("images/%s", name), "transform_matrix_start",
                     matrix_at(camera, 0), "transform_matrix_end", matrix_at(camera, 1));
}

static bool is_like(const gbt_camera *a, const gbt_camera *b)
{
    return a->model == GBT_CAMERA_PINHOLE && b->model == a->model && a->width == b->width &&
           a->height == b->height && a->shutter == b->shutter &&
           memcmp(a->params, b->params, 4 * sizeof *a->params) == 0;
}

gbt_status transforms_write(const char *path, const char *const *names, const gbt_camera *cameras,
                            size_t count, const char *points, gbt_error *err)
{
    const gbt_camera *first = &cameras[0];
    json_t *frames = json_array();
    for (size_t i = 0; i < count; i++) {
        if (!is_like(first, &cameras[i])) {
            json_decref(frames);
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: camera %zu is not a pinhole like the first", path,
                             i);
        }
        if (json_array_append_new(frames, frame_of(names[i], &cameras[i])) != 0) {
            json_decref(frames);
            return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for the cameras", path);
        }
    }
    json_t *root =
        json_pack("{s:s,s:i,s:i,s:f,s:f,s:f,s:f,s:s}", "camera_model", "PINHOLE", "w", first->width, "h",
                  first->height, "fl_x", first->params[0], "fl_y", first->params[1], "cx", first->params[2],
                  "cy", first->params[3], "ply_file_path", points);
    const bool by_columns = first->shutter == GBT_CAMERA_SHUTTER_COLUMNS;
    if (first->shutter != GBT_CAMERA_SHUTTER_GLOBAL)
        json_object_set_new(root, "rolling_shutter", json_pack("[i,i,i,i]", 0, by_columns, !by_columns, 0));
    json_object_set_new(root, "frames", frames);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}
