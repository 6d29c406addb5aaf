/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_file.c -- read a camera file: JSON that describes one camera to render from.

   Pose, lens, aperture, rolling shutter, or an image of rays in their place; docs/cameras.md lists the
   fields. What comes out is a ray_shot in scene-local coordinates. */
#include "render/camera_file.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "base/camera_model.h"
#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/vec.h"
#include "trace/ray_file.h"

enum { SAMPLES_MAX = 65536 };

/* The camera models that a file may name, in lower case: those that a field of view or a view width describes
   completely, because they have no more parameters than two focal lengths and a principal point. */
enum { FILE_MODELS_MAX = 8, FILE_NAME_SIZE = 32 };

typedef struct file_models {
    gbt_camera_model models[FILE_MODELS_MAX];
    char texts[FILE_MODELS_MAX][FILE_NAME_SIZE];
    const char *names[FILE_MODELS_MAX];
    int count;
} file_models;

static void find_models(file_models *out)
{
    out->count = 0;
    for (int i = 0; i < gbt_camera_model_count() && out->count < FILE_MODELS_MAX; i++) {
        const gbt_camera_model model = gbt_camera_model_at(i);
        if (camera_focal_count(model) != 2 || gbt_camera_param_count(model) > 4)
            continue;
        char *text = out->texts[out->count];
        const char *name = gbt_camera_model_name(model);
        for (int k = 0; k < FILE_NAME_SIZE && (k == 0 || name[k - 1] != '\0'); k++)
            text[k] = (char)tolower((unsigned char)name[k]);
        out->models[out->count] = model;
        out->names[out->count] = text;
        out->count++;
    }
}

static gbt_status take_lens(const json_fields *r, gbt_camera *camera)
{
    file_models known;
    int model;
    double fov_deg = 0, view_width = 0;
    find_models(&known);
    GBT_TRY(json_field_choice(r, "model", known.names, known.count, &model));
    const lens_kind kind = camera_model_of(known.models[model])->kind;
    GBT_TRY(json_field_needed(r, "width", "pixels"));
    GBT_TRY(json_field_needed(r, "height", "pixels"));
    GBT_TRY(json_field_whole(r, "width", 1, CAMERA_FILE_SIZE_MAX, &camera->width));
    GBT_TRY(json_field_whole(r, "height", 1, CAMERA_FILE_SIZE_MAX, &camera->height));
    const bool has_fov = kind == LENS_PERSPECTIVE || kind == LENS_FISHEYE;
    if (has_fov)
        GBT_TRY(json_field_needed(r, "fov_x_deg", "degrees from the left edge of the picture to the right"));
    else if (json_field_given(r, "fov_x_deg"))
        return json_field_fail(r, "fov_x_deg", "only with the model pinhole or fisheye");
    if (kind == LENS_ORTHOGRAPHIC)
        GBT_TRY(json_field_needed(r, "view_width",
                                  "units of the data set from the left edge of the picture to the right"));
    else if (json_field_given(r, "view_width"))
        return json_field_fail(r, "view_width", "only with the model orthographic");
    GBT_TRY(json_field_number(r, "fov_x_deg", 0, false, kind == LENS_FISHEYE ? 360 : 179.9, &fov_deg));
    GBT_TRY(json_field_number(r, "view_width", 0, false, JSON_VALUE_MAX, &view_width));
    const double half_width = 0.5 * camera->width, half_height = 0.5 * camera->height,
                 half_fov = fov_deg * PI / 360;
    const double scale = kind == LENS_PERSPECTIVE ? half_width / tan(half_fov)
                         : kind == LENS_FISHEYE   ? half_width / half_fov
                                                  : camera->width / view_width;
    camera->model = known.models[model];
    if (kind == LENS_EQUIRECTANGULAR) {
        camera->params[0] = camera->width;
        camera->params[1] = camera->height;
    } else {
        camera->params[0] = camera->params[1] = scale;
        camera->params[2] = half_width;
        camera->params[3] = half_height;
    }
    return GBT_OK;
}

/* The pose as the file gives it, in world coordinates. Missing fields keep the values set before. */
typedef struct file_pose {
    double origin[3], target[3], up[3];
} file_pose;

static gbt_status take_pose(const json_fields *r, bool needed, const double origin[3], file_pose *at,
                            gbt_camera *camera)
{
    GBT_TRY(json_field_vector(r, "origin", needed, at->origin));
    GBT_TRY(json_field_vector(r, "target", needed, at->target));
    GBT_TRY(json_field_vector(r, "up", needed, at->up));
    double local[3], target[3];
    for (int i = 0; i < 3; i++) {
        local[i] = at->origin[i] - origin[i];
        target[i] = at->target[i] - origin[i];
    }
    if (gbt_camera_look_at(local, target, at->up, camera))
        return GBT_OK;
    const bool same = memcmp(at->origin, at->target, sizeof at->origin) == 0;
    return same ? json_field_fail(r, "target", "is the origin (wanted another point)")
                : json_field_fail(r, "up", "is 0, or along the view");
}

static gbt_status take_shutter(const json_fields *r, const double origin[3], const file_pose *start,
                               ray_shot *shot)
{
    static const char *const directions[] = {"rows", "columns"};
    int direction;
    GBT_TRY(json_field_choice(r, "shutter", directions, 2, &direction));
    const json_t *end = json_object_get(r->object, "end");
    if (end == NULL)
        return json_field_given(r, "shutter")
                   ? json_field_fail(r, "end", "missing (a rolling shutter needs the pose at its end)")
                   : GBT_OK;
    if (!json_is_object(end))
        return json_field_fail(r, "end", "wanted an object with origin, target or up");
    const json_fields inner = {r->path, "end.", end, r->err};
    file_pose at = *start;
    GBT_TRY(json_field_names(&inner, " origin target up "));
    gbt_camera last = shot->camera;
    GBT_TRY(take_pose(&inner, false, origin, &at, &last));
    /* The file gives the poses at the middle of the first line and at the middle of the last. */
    const int lines = direction == 0 ? last.height : last.width;
    const double edge = lines > 1 ? 0.5 / (lines - 1) : 0;
    camera_set_readout(&shot->camera, &last,
                       direction == 0 ? GBT_CAMERA_SHUTTER_ROWS : GBT_CAMERA_SHUTTER_COLUMNS, -edge, 1 + edge,
                       &shot->camera);
    return GBT_OK;
}

static gbt_status take_aperture(const json_fields *r, ray_shot *shot)
{
    static const char *const dependent[] = {"focus", "samples", "seed"};
    int seed = 0;
    for (int i = 0; i < 3 && !json_field_given(r, "aperture"); i++)
        if (json_field_given(r, dependent[i]))
            return json_field_fail(r, "aperture", "missing (needed with focus, samples or seed)");
    GBT_TRY(json_field_number(r, "aperture", 0, true, JSON_VALUE_MAX, &shot->aperture_radius));
    if (shot->aperture_radius > 0)
        GBT_TRY(json_field_needed(r, "focus", "distance that is sharp, units of the data set"));
    GBT_TRY(json_field_number(r, "focus", 0, false, JSON_VALUE_MAX, &shot->focus_distance));
    GBT_TRY(json_field_whole(r, "samples", 1, SAMPLES_MAX, &shot->samples));
    GBT_TRY(json_field_whole(r, "seed", 0, INT32_MAX, &seed));
    shot->seed = (uint64_t)seed;
    return GBT_OK;
}

static gbt_status take_rays(const json_fields *r, const double origin[3], camera_file *out)
{
    char path[JSON_PATH_SIZE];
    GBT_TRY(json_field_file(r, "rays", "an EXR file", path));
    GBT_TRY(json_field_names(r, " rays "));
    out->shot.given = &out->rays;
    return ray_image_read(path, origin, &out->rays, r->err);
}

gbt_status camera_file_take(const json_fields *fields, const double origin[3], camera_file *out)
{
    gbt_camera camera = {0};
    out->shot = ray_shot_of(&camera);
    if (json_field_given(fields, "rays"))
        return take_rays(fields, origin, out);
    GBT_TRY(json_field_names(fields,
                             " origin target up model width height fov_x_deg view_width aperture focus "
                             "samples seed end shutter rays near_clip far_clip "));
    file_pose start = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    GBT_TRY(take_lens(fields, &camera));
    GBT_TRY(take_pose(fields, true, origin, &start, &camera));
    out->shot = ray_shot_of(&camera);
    GBT_TRY(take_aperture(fields, &out->shot));
    GBT_TRY(take_shutter(fields, origin, &start, &out->shot));
    gbt_error why = {0};
    if (ray_shot_check(&out->shot, &why) != GBT_OK)
        return base_fail(fields->err, GBT_ERR_FORMAT, "%s: %s", fields->path, why.text);
    return GBT_OK;
}

gbt_status camera_file_read(const char *path, const double origin[3], camera_file *out, gbt_error *err)
{
    json_t *root;
    memset(out, 0, sizeof *out);
    GBT_TRY(json_read(path, &root, err));
    const json_fields r = {path, "", root, err};
    const gbt_status status = camera_file_take(&r, origin, out);
    json_decref(root);
    return status;
}

gbt_status camera_text_read(const char *text, const char *name, const double origin[3], ray_shot *out,
                            gbt_error *err)
{
    json_t *root;
    camera_file taken = {0};
    GBT_TRY(json_read_text(text, strlen(text), name, &root, err));
    const json_fields r = {name, "", root, err};
    const gbt_status status = json_field_given(&r, "rays")
                                  ? json_field_fail(&r, "rays", "only a camera file can name them")
                                  : camera_file_take(&r, origin, &taken);
    json_decref(root);
    *out = taken.shot;
    return status;
}

void camera_file_free(camera_file *file)
{
    ray_image_free(&file->rays);
    memset(file, 0, sizeof *file);
}
