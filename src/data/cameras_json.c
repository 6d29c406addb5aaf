/* SPDX-License-Identifier: Apache-2.0 */
/* data/cameras_json.c -- cameras.json, [{id, img_name, width, height, position[3], rotation[3][3], fy, fx}],
   to views. */
#include "data/cameras_json.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"
#include "data/json_fields.h"
#include "data/raw.h"

static bool get_number(const json_t *value, double *out)
{
    *out = json_number_value(value);
    return json_is_number(value) && fabs(*out) <= RAW_COORDINATE_LIMIT;
}

static gbt_status read_camera(const json_t *entry, raw_place place, gbt_camera *out, gbt_error *err)
{
    const json_t *position = json_object_get(entry, "position"),
                 *rotation = json_object_get(entry, "rotation");
    double width = 0, height = 0, fx = 0, fy = 0;
    bool fine = get_number(json_object_get(entry, "width"), &width) &&
                get_number(json_object_get(entry, "height"), &height) &&
                get_number(json_object_get(entry, "fx"), &fx) &&
                get_number(json_object_get(entry, "fy"), &fy) && json_array_size(position) == 3 &&
                json_array_size(rotation) == 3;
    for (size_t i = 0; i < 3 && fine; i++) {
        const json_t *row = json_array_get(rotation, i);
        fine = json_array_size(row) == 3 && get_number(json_array_get(position, i), &out->center[i]);
        for (size_t k = 0; k < 3 && fine; k++)
            fine = get_number(json_array_get(row, k), &out->rotation[3 * k + i]); /* transposed: world to
                                                                                     camera */
    }
    if (!fine)
        return raw_fail(err, place,
                        "not a camera (wanted width, height, fx, fy, position [3] and rotation [3][3])");
    if (!dmat_is_rotation(out->rotation, 1e-3))
        return raw_fail(err, place, "not a rotation (wanted orthonormal within 1e-3, no reflection)");
    if (!(width >= 1 && width <= RAW_IMAGE_LIMIT && height >= 1 && height <= RAW_IMAGE_LIMIT))
        return raw_fail(err, place, "%g x %g pixels (wanted 1 to %d)", width, height, (int)RAW_IMAGE_LIMIT);
    out->model = GBT_CAMERA_PINHOLE;
    out->width = (int)width;
    out->height = (int)height;
    out->params[0] = fx;
    out->params[1] = fy;
    out->params[2] = 0.5 * out->width;
    out->params[3] = 0.5 * out->height;
    return raw_check_camera(out, place, err);
}

/* 3DGS stores image names without folders, so in Blender's synthetic scenes a training view and a test view
   are both called "r_0". */
static bool is_taken(const scene *s, const char *name)
{
    for (size_t i = 0; i < s->view_count; i++)
        if (strcmp(s->views[i].name, name) == 0)
            return true;
    return false;
}

static gbt_status read_list(const json_t *list, const char *path, scene *out, gbt_error *err)
{
    const size_t count = json_array_size(list);
    if (count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no cameras (wanted a list)", path);
    out->views = mem_calloc(count, sizeof *out->views, "views", err);
    if (out->views == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++) {
        const json_t *entry = json_array_get(list, i);
        const char *given = json_string_value(json_object_get(entry, "img_name"));
        char numbered[RAW_NAME_LIMIT + 32];
        snprintf(numbered, sizeof numbered, "%.*s%s%05zu", RAW_NAME_LIMIT, given != NULL ? given : "",
                 given != NULL ? "-" : "", i);
        const char *name = given != NULL && !is_taken(out, given) ? given : numbered;
        const raw_place place = {path, RAW_MARK_FRAME, i};
        scene_view *view = &out->views[i];
        GBT_TRY(raw_check_name("image name", name, strlen(name), place, err));
        GBT_TRY(read_camera(entry, place, &view->camera, err));
        view->name = raw_copy_text(name, strlen(name), err);
        if (view->name == NULL)
            return GBT_ERR_NO_MEMORY;
        view->is_test = true;
        out->view_count++;
    }
    out->has_split = true;
    return GBT_OK;
}

gbt_status cameras_json_load(const char *path, scene *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    json_t *root;
    GBT_TRY(json_read_list(path, &root, err));
    gbt_status status = read_list(root, path, out, err);
    json_decref(root);
    if (status == GBT_OK) {
        snprintf(out->source, sizeof out->source, "cameras.json");
        out->folder = raw_copy_text(path, strlen(path), err);
        status = out->folder != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    }
    if (status != GBT_OK)
        scene_free(out);
    return status;
}
