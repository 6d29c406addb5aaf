/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/sparse.h -- the sparse cloud that structure from motion would have found, from known surfaces. */
#ifndef GBT_SCENES_SPARSE_H
#define GBT_SCENES_SPARSE_H

#include <stddef.h>
#include <stdint.h>

#include "base/image.h"
#include "gbtrace/camera.h"
#include "scenes/world.h"

/** A place of a photo where a detector could have found something. */
typedef struct sparse_seed {
    float px, py;
} sparse_seed;

/**
 * Choose image points of one photo, more where the picture changes.
 *
 * @param wanted how many to choose
 * @param out    [out] [wanted]
 */
void sparse_choose(const image *photo, uint64_t seed, uint64_t view, size_t wanted, sparse_seed *out);

/**
 * Follow the chosen points to the surfaces, find the views that see them, and write folder/sparse/0; for
 * cameras that move while they are read out folder/transforms.json and points.ply.
 *
 * @param seeds [view_count][per_view]
 * @param names [view_count]
 * @param sight a view finds no point that is farther; 0: no limit
 *
 * Memory: the points and their observations, some 100 bytes and 32 for each view of a point.
 */
gbt_status sparse_write(const world *w, const gbt_camera *cameras, const char *const *names,
                        size_t view_count, const sparse_seed *seeds, size_t per_view, size_t wanted,
                        double point_noise, float sight, uint64_t seed, const char *folder, gbt_error *err);

#endif
