/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/photo.h -- one camera, one world: its photo and its depth. */
#ifndef GBT_SCENES_PHOTO_H
#define GBT_SCENES_PHOTO_H

#include <stdint.h>

#include "base/image.h"
#include "gbtrace/camera.h"
#include "scenes/world.h"

/** Ray through an image point: unit direction in world axes; false where the lens has no ray. */
bool photo_ray(const gbt_camera *camera, double px, double py, float origin[3], float dir[3]);

/**
 * Render a photo.
 *
 * A pixel takes `side` x `side` stratified samples. When the first quarter of them (spread over the pixel)
 * see one material in nearly one colour, the rest is skipped. Samples are averaged as displayed colours, as
 * blending of Gaussians does.
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
