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

typedef struct sparse_def {
    const world *w;
    const gbt_camera *cameras; /* [view_count] */
    const char *const *names;  /* [view_count]: of the photos' files */
    size_t view_count;
    const sparse_seed *seeds; /* [view_count][per_view] */
    size_t per_view;
    size_t wanted;      /* points, at most */
    double point_noise; /* of positions, a share of the distance to the nearest view, per axis */
    float sight;        /* a view finds no point that is farther; 0: no limit */
    uint64_t seed;
} sparse_def;

/**
 * Follow the chosen points to the surfaces, find the views that see them, and write folder/sparse/0; for
 * cameras that move while they are read out folder/transforms.json and points.ply.
 *
 * Memory: the points and their observations, some 100 bytes and 32 for each view of a point.
 */
gbt_status sparse_write(const sparse_def *def, const char *folder, gbt_error *err);

#endif
