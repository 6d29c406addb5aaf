/* SPDX-License-Identifier: Apache-2.0 */
/* render/ellipsoids.h -- render solid ellipsoids, shaded: points, balls, anchors and Gaussians for people to
   look at. */
#ifndef GBT_RENDER_ELLIPSOIDS_H
#define GBT_RENDER_ELLIPSOIDS_H

#include <stddef.h>

#include "base/image.h"
#include "gbtrace/camera.h"

/** Borrowed arrays. */
typedef struct ellipsoids {
    size_t count;
    const float *center; /* [count][3] */
    const float *axes;   /* [count][3] half lengths along the local axes, >= 0 */
    const float *quat;   /* [count][4] w x y z, local to world, unit; NULL: world axes */
    const float *color;  /* [count][3] */
    float least_pixels;  /* axes shorter than this are drawn this long: half-width in pixels */
    float most_pixels;   /* larger ellipsoids are left out: half-width in pixels; 0: no limit */
} ellipsoids;

/**
 * Draw them over what `out` holds: four rays per pixel, each showing its nearest ellipsoid, brighter where
 * the surface faces the camera.
 *
 * Ellipsoids that reach the camera's plane are left out too: they would hide everything.
 *
 * @param camera [in]     GBT_CAMERA_PINHOLE or GBT_CAMERA_ORTHOGRAPHIC; others give GBT_ERR_ARGUMENT
 * @param out    [in,out] 4 channels, size of the camera: colour and coverage of the pixel; start from zeros.
 *                        With several calls, later ones are drawn in front
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 * Threads: same bits for every thread count. Cost: the pixels of each ellipsoid, four rays each.
 */
gbt_status ellipsoids_draw(const ellipsoids *set, const gbt_camera *camera, image *out, gbt_error *err);

#endif
