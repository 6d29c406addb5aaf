/* SPDX-License-Identifier: Apache-2.0 */
/* data/raw.c -- fills and checks the views and points that readers produce. */
#include "data/raw.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/camera_lens.h"
#include "base/camera_model.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/vec.h"

enum { CHECK_POINTS = 1 << 14 };

gbt_status raw_fail(gbt_error *err, raw_place place, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (place.mark == RAW_MARK_FRAME)
        return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s", place.file, place.at, text);
    if (place.mark == RAW_MARK_FILE)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %s", place.file, text);
    return base_fail(err, GBT_ERR_FORMAT, "%s%c%zu: %s", place.file, place.mark, place.at, text);
}

void raw_view_free(raw_view *view)
{
    mem_free(view->name);
    mem_free(view->path);
    mem_free(view->mask_path);
    mem_free(view->seen);
    memset(view, 0, sizeof *view);
}

void raw_free(raw_scene *raw)
{
    for (size_t i = 0; i < raw->view_count; i++)
        raw_view_free(&raw->views[i]);
    mem_free(raw->views);
    mem_free(raw->position);
    mem_free(raw->color);
    mem_free(raw->missing_lines);
    memset(raw, 0, sizeof *raw);
}

char *raw_copy_text(const char *text, size_t length, gbt_error *err)
{
    char *copy = mem_alloc(length + 1, 1, "name", err);
    if (copy != NULL) {
        memcpy(copy, text, length);
        copy[length] = '\0';
    }
    return copy;
}

raw_view *raw_next_view(raw_scene *raw, gbt_error *err)
{
    void *views = raw->views;
    const gbt_status status = mem_reserve(&views, &raw->view_capacity, raw->view_count, raw->view_count + 1,
                                          sizeof *raw->views, "views", err);
    raw->views = views;
    if (status != GBT_OK)
        return NULL;
    raw_view *view = &raw->views[raw->view_count];
    memset(view, 0, sizeof *view);
    return view;
}

gbt_status raw_reserve_points(raw_scene *raw, size_t count, gbt_error *err)
{
    raw->position = mem_alloc(count, 3 * sizeof *raw->position, "points", err);
    raw->color = mem_alloc(count, 3 * sizeof *raw->color, "point colours", err);
    return raw->position != NULL && raw->color != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static bool is_usable(const double position[3])
{
    for (int k = 0; k < 3; k++)
        if (!(fabs(position[k]) <= RAW_COORDINATE_LIMIT))
            return false;
    return true;
}

void raw_add_point(raw_scene *raw, const double position[3], const float color[3])
{
    if ((raw->point_count + raw->points_dropped) % CHECK_POINTS == 0)
        paged_check();
    if (!is_usable(position)) {
        raw->points_dropped++;
        return;
    }
    memcpy(raw->position + 3 * raw->point_count, position, 3 * sizeof *position);
    for (int k = 0; k < 3; k++)
        raw->color[3 * raw->point_count + k] = color[k] >= 0 ? fminf(color[k], 1) : 0; /* NaN becomes 0 */
    raw->point_count++;
}

gbt_status raw_add_sighting_of_next(raw_scene *raw, size_t view, const double position[3], gbt_error *err)
{
    raw_view *v = &raw->views[view];
    if (!is_usable(position) || raw->point_count > UINT32_MAX)
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&v->seen, &v->seen_capacity, v->seen_count, v->seen_count + 1,
                        sizeof *v->seen, "tracks", err));
    v->seen[v->seen_count++] = (uint32_t)raw->point_count;
    return GBT_OK;
}

/* One of this many points may be nearer than what counts as the nearest depth, because some points are wrong.
   Lenses that look in all directions see about five times as much of the scene, so an object next to the
   camera has a smaller share of the points. */
enum { NEARER_POINTS = 100, NEARER_POINTS_ALL_AROUND = 500 };

gbt_status raw_nearest_depth(const raw_scene *raw, const raw_view *view, double *depth, gbt_error *err)
{
    float *depths = mem_alloc(view->seen_count, sizeof *depths, "depths", err);
    if (depths == NULL)
        return GBT_ERR_NO_MEMORY;
    camera_lens lens;
    const bool all_around = camera_lens_prepare(&view->camera, &lens) && !camera_lens_looks_forward(&lens);
    size_t count = 0;
    for (size_t i = 0; i < view->seen_count; i++) {
        double z = 0, d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = raw->position[3 * (size_t)view->seen[i] + (size_t)k] - view->camera.center[k];
            z += view->camera.rotation[6 + k] * d[k];
        }
        if (all_around)
            z = dvec_length(d);
        if (z > 0 && z <= RAW_COORDINATE_LIMIT)
            depths[count++] = (float)z;
    }
    qsort(depths, count, sizeof *depths, compare_floats);
    const size_t nearer = all_around ? NEARER_POINTS_ALL_AROUND : NEARER_POINTS;
    *depth = count > 0 ? (double)depths[(count - 1) / nearer] : 0;
    mem_free(depths);
    return GBT_OK;
}

gbt_status raw_check_name(const char *what, const char *name, size_t length, raw_place place, gbt_error *err)
{
    if (length == 0)
        return raw_fail(err, place, "%s is empty", what);
    if (length > RAW_NAME_LIMIT)
        return raw_fail(err, place, "%s is too long (wanted at most %d bytes, got %zu)", what, RAW_NAME_LIMIT,
                        length);
    const int shown = length < 100 ? (int)length : 100;
    if (name[0] == '/')
        return raw_fail(err, place, "%s is absolute (wanted a path inside the data set, got %.*s)", what,
                        shown, name);
    size_t part = 0;
    for (size_t i = 0; i <= length; i++) {
        if (i < length && ((unsigned char)name[i] < 0x20 || name[i] == 0x7f))
            return raw_fail(err, place, "%s has a control character: %.*s", what, shown, name);
        if (i < length && name[i] != '/')
            continue;
        if (i - part == 2 && memcmp(name + part, "..", 2) == 0)
            return raw_fail(err, place, "%s leaves the data set by '..': %.*s", what, shown, name);
        part = i + 1;
    }
    return GBT_OK;
}

gbt_status raw_check_camera(const gbt_camera *camera, raw_place place, gbt_error *err)
{
    const int sizes[2] = {camera->width, camera->height};
    for (int k = 0; k < 2; k++)
        if (sizes[k] < 1 || sizes[k] > RAW_IMAGE_LIMIT)
            return raw_fail(err, place, "image %s is out of range (wanted 1..%d, got %d)",
                            k == 0 ? "width" : "height", RAW_IMAGE_LIMIT, sizes[k]);
    const int param_count = gbt_camera_param_count(camera->model),
              focal_count = camera_focal_count(camera->model);
    for (int k = 0; k < param_count; k++)
        if (!(fabs(camera->params[k]) <= RAW_COORDINATE_LIMIT))
            return raw_fail(err, place, "parameter %d of camera model %s is not usable (got %g)", k,
                            gbt_camera_model_name(camera->model), camera->params[k]);
    for (int k = 0; k < focal_count; k++)
        if (camera->params[k] <= 0)
            return raw_fail(err, place, "focal length of camera model %s is not positive (got %g)",
                            gbt_camera_model_name(camera->model), camera->params[k]);
    camera_lens lens;
    if (!camera_lens_prepare(camera, &lens))
        return raw_fail(err, place, "no lens of camera model %s has these parameters",
                        gbt_camera_model_name(camera->model));
    return GBT_OK;
}

gbt_status raw_count_missing(raw_scene *raw, const char *name, gbt_error *err)
{
    enum { SHOWN = 3 };
    const size_t length = strlen(name);
    GBT_TRY(mem_reserve((void **)&raw->missing_lines, &raw->missing_capacity, raw->missing_bytes,
                        raw->missing_bytes + length + 1, 1, "names", err));
    memcpy(raw->missing_lines + raw->missing_bytes, name, length);
    raw->missing_lines[raw->missing_bytes + length] = '\n';
    raw->missing_bytes += length + 1;
    const size_t used = strlen(raw->missing_names);
    if (raw->photos_missing < SHOWN)
        snprintf(raw->missing_names + used, sizeof raw->missing_names - used, "%s%.60s", used > 0 ? ", " : "",
                 name);
    else if (raw->photos_missing == SHOWN)
        snprintf(raw->missing_names + used, sizeof raw->missing_names - used, ", ...");
    raw->photos_missing++;
    return GBT_OK;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const raw_view *)a)->name, ((const raw_view *)b)->name);
}

gbt_status raw_sort_views(raw_scene *raw, const char *file, gbt_error *err)
{
    if (raw->view_count > 1)
        qsort(raw->views, raw->view_count, sizeof *raw->views, by_name);
    for (size_t i = 0; i < raw->view_count; i++)
        raw->views[i].rank = i;
    for (size_t i = 1; i < raw->view_count; i++)
        if (strcmp(raw->views[i - 1].name, raw->views[i].name) == 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s: duplicate image name: %.200s", file,
                             raw->views[i].name);
    return GBT_OK;
}
