/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_model.c -- what COLMAP's binary and text readers share. */
#include "data/colmap_model.h"

#include <math.h>
#include <stdlib.h>

#include "base/vec.h"

gbt_status colmap_cameras_add(colmap_cameras *cameras, uint32_t id, const gbt_camera *camera, raw_place place,
                              gbt_error *err)
{
    GBT_TRY(raw_check_camera(camera, place, err));
    void *items = cameras->items;
    const gbt_status status = mem_reserve(&items, &cameras->capacity, cameras->count, cameras->count + 1,
                                          sizeof *cameras->items, "cameras", err);
    cameras->items = items;
    GBT_TRY(status);
    cameras->items[cameras->count++] = (colmap_camera){.id = id, .camera = *camera};
    return GBT_OK;
}

static int by_camera_id(const void *a, const void *b)
{
    const uint32_t x = ((const colmap_camera *)a)->id, y = ((const colmap_camera *)b)->id;
    return (x > y) - (x < y);
}

gbt_status colmap_cameras_sort(colmap_cameras *cameras, const char *file, gbt_error *err)
{
    if (cameras->count > 1)
        qsort(cameras->items, cameras->count, sizeof *cameras->items, by_camera_id);
    for (size_t i = 1; i < cameras->count; i++)
        if (cameras->items[i - 1].id == cameras->items[i].id)
            return base_fail(err, GBT_ERR_FORMAT, "%s: duplicate camera id %u", file, cameras->items[i].id);
    return GBT_OK;
}

void colmap_cameras_free(colmap_cameras *cameras)
{
    mem_free(cameras->items);
    *cameras = (colmap_cameras){0};
}

gbt_status colmap_add_image(raw_scene *raw, const colmap_cameras *cameras, uint32_t id,
                            const double quaternion[4], const double translation[3], uint32_t camera_id,
                            const char *name, size_t name_length, raw_place place, gbt_error *err)
{
    GBT_TRY(raw_check_name("image name", name, name_length, place, err));
    const double *q = quaternion;
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(fabs(norm - 1) <= 1e-3))
        return raw_fail(err, place, "quaternion is not of unit length (wanted 1 within 1e-3, got %g)", norm);
    for (int k = 0; k < 3; k++)
        if (!(fabs(translation[k]) <= RAW_COORDINATE_LIMIT))
            return raw_fail(err, place, "translation is not usable (wanted at most %g, got %g)",
                            RAW_COORDINATE_LIMIT, translation[k]);
    const colmap_camera key = {.id = camera_id};
    const colmap_camera *found =
        cameras->count > 0 ? bsearch(&key, cameras->items, cameras->count, sizeof key, by_camera_id) : NULL;
    if (found == NULL)
        return raw_fail(err, place, "image refers to camera %u, which does not exist", camera_id);
    raw_view *view = raw_next_view(raw, err);
    if (view == NULL)
        return GBT_ERR_NO_MEMORY;
    view->name = raw_copy_text(name, name_length, err);
    if (view->name == NULL)
        return GBT_ERR_NO_MEMORY;
    view->id = id;
    view->camera = found->camera;
    const double unit[4] = {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
    dquat_to_matrix(unit, view->camera.rotation);
    dmat_apply_transposed(view->camera.rotation, translation, view->camera.center);
    for (int k = 0; k < 3; k++)
        view->camera.center[k] =
            0 - view->camera.center[k]; /* 0 - 0 is +0, so that no pose carries a negative zero */
    raw->view_count++;
    return GBT_OK;
}

static int by_image_id(const void *a, const void *b)
{
    const uint32_t x = ((const colmap_image_id *)a)->id, y = ((const colmap_image_id *)b)->id;
    return (x > y) - (x < y);
}

gbt_status colmap_images_sorted(const raw_scene *raw, const char *file, colmap_image_id **images,
                                gbt_error *err)
{
    *images = NULL;
    colmap_image_id *sorted = mem_alloc(raw->view_count, sizeof *sorted, "image ids", err);
    if (sorted == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < raw->view_count; i++)
        sorted[i] = (colmap_image_id){.id = raw->views[i].id, .view = (uint32_t)i};
    if (raw->view_count > 1)
        qsort(sorted, raw->view_count, sizeof *sorted, by_image_id);
    for (size_t i = 1; i < raw->view_count; i++)
        if (sorted[i - 1].id == sorted[i].id) {
            const uint32_t id = sorted[i].id;
            mem_free(sorted);
            return base_fail(err, GBT_ERR_FORMAT, "%s: duplicate image id %u", file, id);
        }
    *images = sorted;
    return GBT_OK;
}

gbt_status colmap_add_sighting(raw_scene *raw, const colmap_image_id *images, uint32_t id,
                               const double position[3], gbt_error *err)
{
    const colmap_image_id key = {.id = id};
    const colmap_image_id *found =
        raw->view_count > 0 ? bsearch(&key, images, raw->view_count, sizeof key, by_image_id) : NULL;
    if (found != NULL)
        return raw_add_sighting_of_next(raw, found->view, position, err);
    raw->tracks_missing++;
    return GBT_OK;
}
