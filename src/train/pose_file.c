/* SPDX-License-Identifier: Apache-2.0 */
/* train/pose_file.c -- poses as JSON. */
#include "train/pose_file.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/vec.h"
#include "data/json_fields.h"
#include "data/json_out.h"

static json_t *numbers(const double *values, int count)
{
    json_t *array = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(array, json_real(values[i]));
    return array;
}

gbt_status pose_file_write(const scene *s, bool held_out_aligned, const char *path, gbt_error *err)
{
    json_t *root = json_object(), *photos = json_array();
    json_object_set_new(root, "schema", json_integer(1));
    json_object_set_new(root, "meaning",
                        json_string("point in camera axes (x right, y down, z forward) = rotation (3 x 3, "
                                    "rows) * (point in world axes - center)"));
    json_object_set_new(root, "held_out_aligned", json_boolean(held_out_aligned));
    for (size_t i = 0; i < s->view_count; i++) {
        const gbt_camera *camera = &s->views[i].camera;
        double center[3];
        for (int k = 0; k < 3; k++)
            center[k] = camera->center[k] + s->origin[k];
        json_array_append_new(photos, json_pack("{s:o,s:b,s:o,s:o}", "name", json_text(s->views[i].name),
                                                "held_out", s->views[i].is_test, "rotation",
                                                numbers(camera->rotation, 9), "center", numbers(center, 3)));
    }
    json_object_set_new(root, "photos", photos);
    const gbt_status status = json_save_styled(root, JSON_INDENT(1) | JSON_REAL_PRECISION(17), path, err);
    json_decref(root);
    return status;
}

static bool get_numbers(const json_t *array, size_t count, double *out)
{
    bool fine = json_array_size(array) == count;
    for (size_t i = 0; fine && i < count; i++) {
        const json_t *value = json_array_get(array, i);
        out[i] = json_number_value(value);
        fine = json_is_number(value) && isfinite(out[i]);
    }
    return fine;
}

/* Find a view by the name that pose_file_write() gave it. The search starts at `place`, which is then set
   after the view found: the file is usually in the order of the views. */
static scene_view *find_view(const scene *s, const json_t *name, size_t *place)
{
    for (size_t k = 0; k < s->view_count; k++) {
        const size_t i = (*place + k) % s->view_count;
        json_t *own = json_text(s->views[i].name);
        const bool same = json_equal(own, name);
        json_decref(own);
        if (same) {
            *place = i + 1;
            return &s->views[i];
        }
    }
    return NULL;
}

static gbt_status take_poses(const json_t *root, const char *path, scene *s, gbt_error *err)
{
    const json_t *photos = json_object_get(root, "photos"), *photo;
    size_t i, place = 0;
    if (!json_is_array(photos))
        return base_fail(err, GBT_ERR_FORMAT, "%s: holds no poses (wanted an array \"photos\")", path);
    json_array_foreach(photos, i, photo)
    {
        double rotation[9], center[3];
        if (!get_numbers(json_object_get(photo, "rotation"), 9, rotation) ||
            !get_numbers(json_object_get(photo, "center"), 3, center) || !dmat_is_rotation(rotation, 1e-6))
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: photo %zu: no pose (wanted a rotation of 9 numbers and a center of 3)",
                             path, i);
        scene_view *view = find_view(s, json_object_get(photo, "name"), &place);
        if (view == NULL)
            continue;
        memcpy(view->camera.rotation, rotation, sizeof rotation);
        for (int k = 0; k < 3; k++)
            view->camera.center[k] = center[k] - s->origin[k];
    }
    return GBT_OK;
}

gbt_status pose_file_read(const char *path, scene *s, bool *held_out_aligned, gbt_error *err)
{
    json_t *root;
    GBT_TRY(json_read(path, &root, err));
    const gbt_status status = take_poses(root, path, s, err);
    *held_out_aligned = !json_is_false(json_object_get(root, "held_out_aligned"));
    json_decref(root);
    return status;
}
