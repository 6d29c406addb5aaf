/* SPDX-License-Identifier: Apache-2.0 */
/* render/ellipsoids.h -- solid ellipsoids as a shaded picture: points, balls, anchors and Gaussians for
   people to look at. */
#ifndef GBT_RENDER_ELLIPSOIDS_H
#define GBT_RENDER_ELLIPSOIDS_H

#include <stdbool.h>
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
    float least_pixels;  /* smaller ones are drawn as large as this: half their width, pixels */
    float most_pixels;   /* what is larger than this at its distance is left out; 0: no limit */
} ellipsoids;

/**
 * Draw them over what `out` holds: for each quarter of a pixel the nearest along its ray, brighter where it
 * faces the camera.
 *
 * What lies around the camera's plane is left out too: it would hide everything.
 *
 * @param camera [in]     GBT_CAMERA_PINHOLE or GBT_CAMERA_ORTHOGRAPHIC; others give GBT_ERR_ARGUMENT
 * @param out    [in,out] 4 channels of the camera's size: colour and how much of the pixel is covered; start
 *                        from zeros. Several calls: the later in front
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 * Threads: same bits for every thread count. Cost: each ellipsoid's pixels, four rays each.
 */
gbt_status ellipsoids_draw(const ellipsoids *set, const gbt_camera *camera, image *out, gbt_error *err);

#endif
