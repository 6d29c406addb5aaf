/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_model.h -- shared by COLMAP's binary and text readers: looking up cameras and images by id, and
   checking and adding images. */
#ifndef GBT_DATA_COLMAP_MODEL_H
#define GBT_DATA_COLMAP_MODEL_H

#include "data/bytes.h"
#include "data/raw.h"

/** The three files of a model, all binary or all text. */
typedef struct colmap_files {
    source_file cameras, images, points;
} colmap_files;

typedef struct colmap_camera {
    uint32_t id;
    gbt_camera camera; /* without a pose */
} colmap_camera;

typedef struct colmap_cameras {
    size_t count, capacity;
    colmap_camera *items; /* sorted by id after colmap_cameras_sort(); owned */
} colmap_cameras;

gbt_status colmap_cameras_add(colmap_cameras *cameras, uint32_t id, const gbt_camera *camera, raw_place place,
                              gbt_error *err);

/** Sort by id. A duplicate camera id is an error. */
gbt_status colmap_cameras_sort(colmap_cameras *cameras, const char *file, gbt_error *err);
void colmap_cameras_free(colmap_cameras *cameras);

/**
 * Check one image and append it as a view.
 *
 * `quaternion` (w, x, y, z) and `translation` take world to camera: x_cam = R x + t, so the centre is -R^T t.
 */
gbt_status colmap_add_image(raw_scene *raw, const colmap_cameras *cameras, uint32_t id,
                            const double quaternion[4], const double translation[3], uint32_t camera_id,
                            const char *name, size_t name_length, raw_place place, gbt_error *err);

typedef struct colmap_image_id {
    uint32_t id;
    uint32_t view; /* index into raw_scene.views */
} colmap_image_id;

/** Pairs of image id and view, sorted by id, to look up the images of tracks. Owned by the caller
    (mem_free()). A duplicate id is an error. */
gbt_status colmap_images_sorted(const raw_scene *raw, const char *file, colmap_image_id **images,
                                gbt_error *err);

/** raw_add_sighting_of_next() for an entry of a track: the view is looked up by image id in the result of
    colmap_images_sorted(). */
gbt_status colmap_add_sighting(raw_scene *raw, const colmap_image_id *images, uint32_t id,
                               const double position[3], gbt_error *err);

#endif
