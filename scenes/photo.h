/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/photo.h -- renders the photo and the depth of one camera in a world. */
#ifndef GBT_SCENES_PHOTO_H
#define GBT_SCENES_PHOTO_H

#include <stdint.h>

#include "base/image.h"
#include "gbtrace/camera.h"
#include "scenes/world.h"

/** The ray through an image point: unit direction in world axes; false where the lens has no ray. */
bool photo_ray(const gbt_camera *camera, double px, double py, float origin[3], float dir[3]);

/**
 * Render a photo.
 *
 * A pixel takes `side` x `side` stratified samples. If the first quarter of them, spread over the pixel, see
 * one material in nearly one colour, the others are skipped. Samples are averaged as displayed colours,
 * because Gaussians are blended in that space, too.
 *
 * @param out [in, out] 3 channels, allocated, camera's size
 * Threads: any; runs its rows in parallel; the same bits for every thread count.
 */
void photo_render(const world *w, const gbt_camera *camera, int side, uint64_t seed, uint64_t view,
                  image *out);

/** Distance along the ray through the centre of every pixel, 0 where nothing is hit. `out` has 1 channel and
    the camera's size. */
void photo_depth(const world *w, const gbt_camera *camera, image *out);

#endif
