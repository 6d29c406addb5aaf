/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_write.h -- writes binary COLMAP models. */
#ifndef GBT_DATA_COLMAP_WRITE_H
#define GBT_DATA_COLMAP_WRITE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct colmap_point {
    double position[3]; /* world */
    unsigned char color[3];
    double error; /* reprojection error, pixels; -1 when unknown */
    uint32_t track_count;
    const uint32_t *track; /* [track_count][2]: image index (from 0), observation index within that image */
} colmap_point;

/** Value of `point` for an observation without a 3D point. */
#define COLMAP_NO_POINT UINT64_MAX

typedef struct colmap_observation {
    double x, y;    /* pixels; the centre of the top-left pixel is (0.5, 0.5) */
    uint64_t point; /* index into the points, or COLMAP_NO_POINT */
} colmap_observation;

typedef struct colmap_image {
    const char *name;
    gbt_camera camera; /* pose in world coordinates */
    size_t observation_count;
    const colmap_observation *observations;
} colmap_image;

/**
 * Write folder/cameras.bin, images.bin and points3D.bin; the folder is created if missing. All arguments are
 * borrowed.
 *
 * Ids are indices plus one. Images with the same model, size and parameters share one camera id.
 *
 * @return GBT_OK; GBT_ERR_ARGUMENT for a bad name, camera or index; else as file_write_atomic()
 */
gbt_status colmap_write(const char *folder, const colmap_image *images, size_t image_count,
                        const colmap_point *points, size_t point_count, gbt_error *err);

#endif
