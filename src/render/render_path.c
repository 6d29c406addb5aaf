/* SPDX-License-Identifier: Apache-2.0 */
/* render/render_path.c -- choose the cameras of a film: an orbit, the photos' cameras, or a path file. */
#include "render/render_path.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "data/number.h"
#include "render/camera_path_file.h"

enum { FRAMES_ORBIT = 240, FRAMES_PER_CAMERA = 15, FRAMES_MOST = 900 };
static const double fps_default = 30;

bool render_path_wants_views(const char *path)
{
    return strcmp(path, "orbit") == 0 || strcmp(path, "interpolate") == 0;
}

/** The cameras of the training photos; if every photo is held out, those of all photos. */
static gbt_status take_cameras(const loaded_run *r, gbt_camera **out, size_t *count, gbt_error *err)
{
    *count = 0;
    *out = mem_alloc(r->scene.view_count + 1, sizeof **out, "cameras", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    for (int held_out = 0; held_out < 2 && *count == 0; held_out++)
        for (size_t i = 0; i < r->scene.view_count; i++)
            if (r->scene.views[i].is_test == (held_out > 0))
                (*out)[(*count)++] = photos_camera(&r->photos, i, 0);
    return *count > 0 ? GBT_OK
                      : base_fail(err, GBT_ERR_FORMAT,
                                  "path: %s has no cameras (wanted a data set with photos, or a path file)",
                                  r->scene.folder);
}

/** Size of the pictures: as requested, else that of the first photo, rounded down to even numbers for video.
 */
static gbt_camera choose_lens(const camera_group *group, const gbt_render_def *def)
{
    if (def->width > 0)
        return camera_group_lens(group, def->width, def->height);
    const int width = group->lens.width, height = group->lens.height;
    return camera_group_lens(group, width > 1 ? width & ~1 : width, height > 1 ? height & ~1 : height);
}

/** "X,Y,Z" in the data set's coordinates to a scene-local position. */
static gbt_status read_place(const char *text, const double origin[3], double out[3], gbt_error *err)
{
    const char *at = text;
    for (int k = 0; k < 3; k++) {
        const size_t length = strcspn(at, ",");
        if (number_parse_double(at, length, &out[k]) != NUMBER_OK || !isfinite(out[k]) ||
            (at[length] == ',') != (k < 2))
            return base_fail(err, GBT_ERR_ARGUMENT, "look_at: \"%.80s\" (wanted X,Y,Z, as in 0.5,-1,2)",
                             text);
        out[k] -= origin[k];
        at += length + (k < 2);
    }
    return GBT_OK;
}

/** Whatever def leaves open follows the photos' cameras. If it leaves everything open, the lens is widened
    until what most photos show is in every frame. */
static gbt_status make_orbit(const loaded_run *r, const gbt_render_def *def, const gbt_camera *cameras,
                             size_t count, const shared_points *shared, camera_group *group, camera_path *out,
                             gbt_error *err)
{
    const orbit_shape shape = {.radius = isnan(def->orbit_radius) ? 0 : def->orbit_radius,
                               .height = def->orbit_height,
                               .at_focus = def->look_at != NULL};
    if (shape.at_focus)
        GBT_TRY(read_place(def->look_at, r->model.origin, group->focus, err));
    const gbt_camera lens = choose_lens(group, def);
    GBT_TRY(camera_path_orbit(cameras, count, group, &lens, &shape,
                              def->frames > 0 ? (size_t)def->frames : FRAMES_ORBIT, out, err));
    const bool chosen = shape.at_focus || shape.radius > 0 || !isnan(shape.height);
    return chosen ? GBT_OK : camera_path_show(out, shared, err);
}

static gbt_status make_from_views(const loaded_run *r, const gbt_render_def *def, camera_path *out,
                                  gbt_error *err)
{
    gbt_camera *cameras = NULL;
    camera_group group;
    shared_points shared = {0};
    size_t count;
    gbt_status status = take_cameras(r, &cameras, &count, err);
    if (status == GBT_OK)
        status =
            shared_points_find(cameras, count, r->scene.points.position, r->scene.points.count, &shared, err);
    if (status == GBT_OK)
        status =
            camera_group_make(cameras, count, r->scene.points.position, r->scene.points.count, &group, err);
    if (status != GBT_OK)
        goto done;
    if (strcmp(def->path, "orbit") == 0) {
        status = make_orbit(r, def, cameras, count, &shared, &group, out, err);
        goto done;
    }
    const gbt_camera lens = choose_lens(&group, def);
    status = camera_path_order(cameras, count, group.distance, err);
    for (size_t i = 0; i < count; i++) {
        gbt_camera key = lens;
        memcpy(key.rotation, cameras[i].rotation, sizeof key.rotation);
        memcpy(key.center, cameras[i].center, sizeof key.center);
        cameras[i] = key;
    }
    const size_t most = count < FRAMES_MOST / FRAMES_PER_CAMERA ? count * FRAMES_PER_CAMERA : FRAMES_MOST;
    if (status == GBT_OK)
        status = camera_path_through(cameras, count, group.distance,
                                     def->frames > 0 ? (size_t)def->frames : most, out, err);
done:
    shared_points_free(&shared);
    mem_free(cameras);
    return status;
}

/** Set the size of a path file's cameras; the field of view across the shorter side stays. */
static gbt_status resize(camera_path *path, const gbt_render_def *def, gbt_error *err)
{
    for (size_t i = 0; i < path->count; i++) {
        ray_shot *shot = &path->shots[i];
        camera_group group = {.lens = shot->camera};
        if (shot->camera.model != GBT_CAMERA_PINHOLE)
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "width: cannot be combined with a path of %s cameras (its file gives the size)",
                             gbt_camera_model_name(shot->camera.model));
        const gbt_camera lens = camera_group_lens(&group, def->width, def->height);
        shot->camera.width = lens.width;
        shot->camera.height = lens.height;
        memcpy(shot->camera.params, lens.params, sizeof lens.params);
    }
    return GBT_OK;
}

gbt_status render_path_make(const loaded_run *r, const gbt_render_def *def, camera_path *out, gbt_error *err)
{
    *out = (camera_path){0};
    if (render_path_wants_views(def->path)) {
        GBT_TRY(make_from_views(r, def, out, err));
    } else {
        GBT_TRY(camera_path_file_read(def->path, r->model.origin, (size_t)def->frames, out, err));
        if (def->width > 0)
            GBT_TRY(resize(out, def, err));
    }
    if (def->fps > 0)
        out->fps = def->fps;
    else if (!(out->fps > 0))
        out->fps = fps_default;
    return GBT_OK;
}
