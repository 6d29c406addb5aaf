/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/sparse.h -- makes, from known surfaces, the sparse cloud that structure from motion would have
   found. */
#ifndef GBT_SCENES_SPARSE_H
#define GBT_SCENES_SPARSE_H

#include <stddef.h>
#include <stdint.h>

#include "base/image.h"
#include "gbtrace/camera.h"
#include "scenes/world.h"

/** An image point at which a feature detector could have found something. */
typedef struct sparse_seed {
    float px, py;
} sparse_seed;

/**
 * Choose image points of one photo, with more of them where the picture changes.
 *
 * @param wanted how many to choose
 * @param out    [out] [wanted]
 */
void sparse_choose(const image *photo, uint64_t seed, uint64_t view, size_t wanted, sparse_seed *out);

typedef struct sparse_def {
    const world *w;
    const gbt_camera *cameras; /* [view_count] */
    const char *const *names;  /* [view_count]: names of the photo files */
    size_t view_count;
    const sparse_seed *seeds; /* [view_count][per_view] */
    size_t per_view;
    size_t wanted;       /* points, at most */
    double point_noise;  /* standard deviation of positions per axis, as a fraction of the distance to the
                            nearest view */
    float view_distance; /* a view sees no points beyond this distance; 0: no limit */
    uint64_t seed;
} sparse_def;

/**
 * Trace the chosen points to the surfaces, find the views that see them, and write folder/sparse/0; for
 * cameras with a rolling shutter folder/transforms.json and points.ply instead.
 *
 * Memory: the points and their observations, about 100 bytes per point and 32 per view of a point.
 */
gbt_status sparse_write(const sparse_def *def, const char *folder, gbt_error *err);

#endif
