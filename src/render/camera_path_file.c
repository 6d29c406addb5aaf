/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path_file.c -- read a camera path file: our own format, or the one that nerfstudio's viewer
   saves. */
#include "render/camera_path_file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/vec.h"
#include "render/camera_file.h"

static const double rotation_tolerance = 1e-3, fps_most = 1000;

/* ---- both formats ---- */

/** Element i of the array `field`, as an object whose fields can be taken. */
static gbt_status element_of(const json_fields *root, const char *field, size_t i, char prefix[64],
                             json_fields *out)
{
    snprintf(prefix, 64, "%s[%zu].", field, i);
    *out =
        (json_fields){root->path, prefix, json_array_get(json_object_get(root->object, field), i), root->err};
    if (!json_is_object(out->object))
        return base_fail(root->err, GBT_ERR_FORMAT, "%s: %s[%zu]: wanted an object", root->path, field, i);
    return GBT_OK;
}

static gbt_status count_of(const json_fields *root, const char *field, size_t *count)
{
    const json_t *list = json_object_get(root->object, field);
    *count = json_array_size(list);
    if (!json_is_array(list) || *count < 1 || *count > CAMERA_PATH_FRAMES_MAX)
        return base_fail(root->err, GBT_ERR_FORMAT, "%s: %s: wanted a list of 1 to %d cameras", root->path,
                         field, (int)CAMERA_PATH_FRAMES_MAX);
    return GBT_OK;
}

/* ---- our format ---- */

/** A camera of the array. Fields beside the array are common to all cameras; the camera's own override them.
 */
static gbt_status take_camera(const json_fields *root, const json_t *common, size_t i, const double origin[3],
                              ray_shot *shot)
{
    char prefix[64];
    json_fields own;
    camera_file file = {0};
    GBT_TRY(element_of(root, "cameras", i, prefix, &own));
    json_t *merged = json_copy((json_t *)own.object);
    if (merged == NULL || json_object_update_missing(merged, (json_t *)common) != 0) {
        json_decref(merged);
        return base_fail(root->err, GBT_ERR_NO_MEMORY, "%s: no memory", root->path);
    }
    own.object = merged;
    const gbt_status status = json_field_given(&own, "rays")
                                  ? json_field_fail(&own, "rays", "not supported in a path (wanted a camera)")
                                  : camera_file_take(&own, origin, &file);
    *shot = file.shot;
    json_decref(merged);
    return status;
}

static bool is_moving(const ray_shot *shot)
{
    return !camera_is_still(&shot->camera) || shot->aperture_radius > 0;
}

static gbt_status check_alike(const json_fields *root, const camera_path *path, bool same_lens)
{
    const gbt_camera *first = &path->shots[0].camera;
    for (size_t i = 1; i < path->count; i++) {
        const gbt_camera *camera = &path->shots[i].camera;
        if (camera->width != first->width || camera->height != first->height)
            return base_fail(root->err, GBT_ERR_FORMAT,
                             "%s: cameras[%zu]: %d x %d pixels (wanted %d x %d, as the first)", root->path, i,
                             camera->width, camera->height, first->width, first->height);
        if (same_lens && camera->model != first->model)
            return base_fail(
                root->err, GBT_ERR_FORMAT,
                "%s: cameras[%zu].model: not that of the first (wanted one lens in a path with \"frames\")",
                root->path, i);
    }
    for (size_t i = 0; i < path->count && same_lens; i++)
        if (is_moving(&path->shots[i]))
            return base_fail(
                root->err, GBT_ERR_FORMAT,
                "%s: cameras[%zu]: an aperture or a shutter (not possible in a path with \"frames\")",
                root->path, i);
    return GBT_OK;
}

static gbt_status take_cameras(const json_fields *root, const double origin[3], int *frames, camera_path *out)
{
    int schema = 1;
    size_t count;
    GBT_TRY(json_field_whole(root, "schema", 1, 1, &schema));
    GBT_TRY(count_of(root, "cameras", &count));
    GBT_TRY(camera_path_alloc(out, count, root->err));
    GBT_TRY(json_field_number(root, "fps", 0, false, fps_most, &out->fps));
    GBT_TRY(json_field_whole(root, "frames", 1, CAMERA_PATH_FRAMES_MAX, frames));
    json_t *common = json_copy((json_t *)root->object);
    static const char *const not_common[] = {"cameras", "fps", "frames", "schema"};
    for (size_t i = 0; i < sizeof not_common / sizeof *not_common; i++)
        json_object_del(common, not_common[i]);
    gbt_status status =
        common != NULL ? GBT_OK : base_fail(root->err, GBT_ERR_NO_MEMORY, "%s: no memory", root->path);
    for (size_t i = 0; i < count && status == GBT_OK; i++)
        status = take_camera(root, common, i, origin, &out->shots[i]);
    json_decref(common);
    return status;
}

/* ---- nerfstudio ---- */

/* nerfstudio's trainer rotates, moves and scales the world: p' = scale (rotation p + move). */
typedef struct similarity {
    double rotation[9], move[3], scale;
} similarity;

/** A matrix of `rows` x 4 numbers, as nested lists or as one flat list: its upper 3 x 3 part into `rotation`,
    its last column into `move`. */
static gbt_status take_matrix(const json_fields *r, const char *field, double rotation[9], double move[3])
{
    const json_t *list = json_object_get(r->object, field);
    const size_t count = json_array_size(list);
    const bool nested = json_is_array(json_array_get(list, 0));
    if (!json_is_array(list) || (nested ? count != 3 && count != 4 : count != 12 && count != 16))
        return json_field_fail(r, field, "wanted 12 or 16 numbers, row after row");
    for (size_t i = 0; i < 12; i++) {
        const json_t *row = nested ? json_array_get(list, i / 4) : list,
                     *value = json_array_get(row, nested ? i % 4 : i);
        if (!json_is_number(value) || !(fabs(json_number_value(value)) <= JSON_VALUE_MAX))
            return json_field_fail(r, field, "wanted 12 or 16 numbers, row after row, within 1e15");
        *(i % 4 == 3 ? &move[i / 4] : &rotation[3 * (i / 4) + i % 4]) = json_number_value(value);
    }
    return dmat_is_rotation(rotation, rotation_tolerance)
               ? GBT_OK
               : json_field_fail(r, field, "not a rotation (wanted |R R' - I| <= 1e-3, and no reflection)");
}

static gbt_status take_similarity(const json_fields *r, similarity *out)
{
    *out = (similarity){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .scale = 1};
    GBT_TRY(json_field_number(r, "scale", 0, false, JSON_VALUE_MAX, &out->scale));
    return json_field_given(r, "transform") ? take_matrix(r, "transform", out->rotation, out->move) : GBT_OK;
}

/** The transform of the world: from the path file itself, else from the file of nerfstudio's trainer in the
    same folder; without both, the identity. */
static gbt_status find_similarity(const json_fields *root, similarity *out)
{
    static const char name[] = "dataparser_transforms.json";
    char path[JSON_PATH_SIZE];
    json_t *beside;
    const char *slash = strrchr(root->path, '/');
    const int folder = slash != NULL ? (int)(slash - root->path) + 1 : 0;
    if (json_field_given(root, "transform") ||
        snprintf(path, sizeof path, "%.*s%s", folder, root->path, name) >= (int)sizeof path ||
        !file_exists(path))
        return take_similarity(root, out);
    GBT_TRY(json_read(path, &beside, root->err));
    const json_fields r = {path, "", beside, root->err};
    const gbt_status status = take_similarity(&r, out);
    json_decref(beside);
    return status;
}

/** A camera-to-world matrix with OpenGL's axes (x right, y up, z back) to a pose in the data set's world. */
static gbt_status take_pose(const json_fields *r, const similarity *s, const double origin[3],
                            gbt_camera *camera)
{
    static const double zero[3] = {0, 0, 0};
    double m[9], at[3], up[3], forward[3];
    GBT_TRY(take_matrix(r, "camera_to_world", m, at));
    for (int k = 0; k < 3; k++) {
        up[k] = m[3 * k + 1];
        forward[k] = -m[3 * k + 2];
        at[k] = at[k] / s->scale - s->move[k];
    }
    dmat_apply_transposed(s->rotation, up, up);
    dmat_apply_transposed(s->rotation, forward, forward);
    dmat_apply_transposed(s->rotation, at, at);
    gbt_camera_look_at(zero, forward, up, camera); /* makes the rotation orthonormal; cannot fail for a matrix
                                                      that is nearly a rotation */
    for (int k = 0; k < 3; k++)
        camera->center[k] = at[k] - origin[k];
    return GBT_OK;
}

enum { TYPE_PERSPECTIVE, TYPE_FISHEYE, TYPE_EQUIRECTANGULAR };

static gbt_status take_lens(const json_fields *r, int type, gbt_camera *camera)
{
    double fov_deg = 0;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_FISHEYE,
                                              GBT_CAMERA_EQUIRECTANGULAR};
    camera->model = models[type];
    if (type == TYPE_EQUIRECTANGULAR) {
        camera->params[0] = camera->width;
        camera->params[1] = camera->height;
        return GBT_OK;
    }
    GBT_TRY(json_field_needed(r, "fov", "degrees from the top of the picture to the bottom"));
    GBT_TRY(json_field_number(r, "fov", 0, false, 179.9, &fov_deg));
    /* for fisheyes too, as nerfstudio's renderer does */
    camera->params[0] = camera->params[1] = 0.5 * camera->height / tan(fov_deg * PI / 360);
    camera->params[2] = 0.5 * camera->width;
    camera->params[3] = 0.5 * camera->height;
    return GBT_OK;
}

static gbt_status take_nerfstudio(const json_fields *root, const double origin[3], camera_path *out)
{
    static const char *const types[] = {"perspective", "fisheye", "equirectangular"};
    int type, width = 0, height = 0;
    size_t count;
    double seconds = 0;
    similarity world;
    GBT_TRY(count_of(root, "camera_path", &count));
    GBT_TRY(camera_path_alloc(out, count, root->err));
    GBT_TRY(json_field_choice(root, "camera_type", types, 3, &type));
    GBT_TRY(json_field_needed(root, "render_width", "pixels"));
    GBT_TRY(json_field_needed(root, "render_height", "pixels"));
    GBT_TRY(json_field_whole(root, "render_width", 1, CAMERA_FILE_SIZE_MAX, &width));
    GBT_TRY(json_field_whole(root, "render_height", 1, CAMERA_FILE_SIZE_MAX, &height));
    GBT_TRY(json_field_number(root, "fps", 0, false, fps_most, &out->fps));
    GBT_TRY(json_field_number(root, "seconds", 0, false, JSON_VALUE_MAX, &seconds));
    if (!(out->fps > 0) && seconds > 0)
        out->fps = fmin((double)count / seconds, fps_most);
    GBT_TRY(find_similarity(root, &world));
    for (size_t i = 0; i < count; i++) {
        char prefix[64];
        json_fields own;
        gbt_camera camera = {.width = width, .height = height};
        GBT_TRY(element_of(root, "camera_path", i, prefix, &own));
        GBT_TRY(take_lens(&own, type, &camera));
        GBT_TRY(take_pose(&own, &world, origin, &camera));
        out->shots[i] = ray_shot_of(&camera);
    }
    return GBT_OK;
}

/* ---- entry ---- */

/** Replace the cameras of the file by `frames` cameras of a smooth path through them. */
static gbt_status smooth(const json_fields *root, size_t frames, camera_path *path)
{
    GBT_TRY(check_alike(root, path, frames > 0));
    if (frames == 0)
        return GBT_OK;
    camera_path way = {0};
    camera_group group;
    gbt_camera *keys = mem_alloc(path->count, sizeof *keys, "path", root->err);
    if (keys == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < path->count; i++)
        keys[i] = path->shots[i].camera;
    gbt_status status = camera_group_make(keys, path->count, NULL, 0, &group, root->err);
    if (status == GBT_OK)
        status = camera_path_through(keys, path->count, group.distance, frames, &way, root->err);
    mem_free(keys);
    way.fps = path->fps;
    camera_path_free(path);
    *path = way;
    return status;
}

gbt_status camera_path_file_read(const char *path, const double origin[3], size_t frames, camera_path *out,
                                 gbt_error *err)
{
    json_t *root;
    int wanted = (int)frames;
    *out = (camera_path){0};
    GBT_TRY(json_read(path, &root, err));
    const json_fields r = {path, "", root, err};
    gbt_status status;
    if (json_field_given(&r, "camera_path"))
        status = take_nerfstudio(&r, origin, out);
    else if (json_field_given(&r, "cameras"))
        status = take_cameras(&r, origin, &wanted, out);
    else
        status =
            base_fail(err, GBT_ERR_FORMAT,
                      "%s: not a camera path (wanted \"cameras\", or nerfstudio's \"camera_path\")", path);
    if (status == GBT_OK)
        status = smooth(&r, frames > 0 ? frames : (size_t)wanted, out);
    json_decref(root);
    return status;
}
