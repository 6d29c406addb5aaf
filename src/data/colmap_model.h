/* data/colmap_model.h -- what COLMAP's binary and text readers share: cameras by id, poses, and the finish that ties images to cameras. */
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

gbt_status colmap_cameras_add(colmap_cameras *cameras, uint32_t id, const gbt_camera *camera, raw_place place, gbt_error *err);

/** Sort by id; a camera id that is there twice is an error. */
gbt_status colmap_cameras_sort(colmap_cameras *cameras, const char *file, gbt_error *err);
void colmap_cameras_free(colmap_cameras *cameras);

/**
 * Check one image and append it as a view.
 *
 * `quaternion` (w, x, y, z) and `translation` take world to camera: x_cam = R x + t, so the centre is -R^T t.
 */
gbt_status colmap_add_image(raw_scene *raw, const colmap_cameras *cameras, uint32_t id, const double quaternion[4],
                            const double translation[3], uint32_t camera_id, const char *name, size_t name_length, raw_place place,
                            gbt_error *err);

/** Image ids sorted, for looking up tracks. Owned by the caller (mem_free()); an id that is there twice is an error. */
gbt_status colmap_image_ids(const raw_scene *raw, const char *file, uint32_t **ids, gbt_error *err);
bool colmap_has_id(const uint32_t *ids, size_t count, uint32_t id);

#endif
