/* SPDX-License-Identifier: Apache-2.0 */
/* train/memory_need.c -- memory of a training run from the sizes of its data. */
#include "train/memory_need.h"

#include <math.h>

#include "train/photos.h"
#include "train/rules.h"

/* Measured on fox, plush, castle and a district of 3 million points (docs/memory.md). */
static const double program_bytes = 150e6, least_bytes = 168e6, raw_point_bytes = 36 + 24, point_bytes = 24,
                    tree_bytes = 100, tree_fixed_bytes = 95, learning_point_bytes = 3000,
                    model_point_bytes = 600, step_pixel_bytes = 300, score_pixel_bytes = 120,
                    kept_pixel_bytes = 3;
static const double found_points = 20000, /* by photo consistency, where the data set has none */
    most_points = 131072;                 /* the tree of balls is 18 deep: more points make no more anchors */

memory_need memory_need_of(const scene *s, double downscale)
{
    double train_pixels = 0, largest = 0;
    for (size_t i = 0; i < s->view_count; i++) {
        const gbt_camera *c = &s->views[i].camera;
        const double pixels = (double)c->width * (double)c->height / (downscale * downscale);
        largest = fmax(largest, pixels);
        train_pixels += s->views[i].is_test ? 0 : pixels;
    }
    const double points = s->points.count > 0 ? (double)s->points.count : found_points,
                 learning = fmin(points, most_points);
    memory_need need = {
        .program = program_bytes,
        .reading = (double)s->file_bytes + raw_point_bytes * points,
        .points = point_bytes * points,
        .trees = tree_bytes * points,
        .photos = fmin(kept_pixel_bytes * train_pixels, (double)PHOTOS_KEPT_BYTES),
        .anchors = learning_point_bytes * learning,
        .view = fmax(step_pixel_bytes * fmin(largest, TRAIN_STEP_PIXELS), score_pixel_bytes * largest),
    };
    const double scoring = need.reading + model_point_bytes * learning, /* the data is read again */
        starting = need.points + need.photos + need.trees,
                 stepping = need.points + need.photos + need.anchors + need.view;
    need.whole = fmax(need.program + fmax(scoring, fmax(starting, stepping)), least_bytes);
    need.least = fmin(need.whole, 16.0 / 15 * (need.program + fmax(tree_fixed_bytes * points, need.view)));
    need.least = fmax(need.least, least_bytes);
    return need;
}
