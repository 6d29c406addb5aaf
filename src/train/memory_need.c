/* SPDX-License-Identifier: Apache-2.0 */
/* train/memory_need.c -- memory of a training run from the sizes of its data. */
#include "train/memory_need.h"

#include <math.h>

#include "train/photos.h"
#include "train/seed_points.h"
#include "train/seen_points.h"
#include "train/step_pixels.h"

/* Measured on fox, plush, castle and a district of 3 million points (docs/memory.md). */
static const double program_bytes = 150e6, least_bytes = 168e6, raw_point_bytes = 36 + 24, point_bytes = 24,
                    tree_bytes = 100, tree_fixed_bytes = 95, learning_point_bytes = 3000,
                    model_point_bytes = 600, step_pixel_bytes = 300, score_pixel_bytes = 120;
static const double saved_point_bytes = 952; /* of the copy that a background save writes from */
static const double found_points = 20000,    /* by photo consistency, when the data set has none */
    most_points = 131072; /* the tree of balls is 18 deep: more points make no more anchors */

memory_need memory_need_of(const scene *s, double downscale, const train_rules *rules)
{
    double train_bytes = 0, largest = 0, picked = 0, train_count = 0;
    const double decoded = photos_decoded_bytes(s);
    for (size_t i = 0; i < s->view_count; i++) {
        const scene_view *v = &s->views[i];
        const double pixels = (double)v->camera.width * (double)v->camera.height / (downscale * downscale);
        const gbt_camera camera = photo_camera_divided(&v->camera, downscale);
        largest = fmax(largest, pixels);
        picked = fmax(picked, step_pixel_count(&camera, rules));
        train_count += !v->is_test;
        train_bytes += v->is_test ? 0 : (3 + (v->mask_path != NULL) + v->has_alpha) * pixels;
    }
    const bool seeds = s->points.count < SEED_FEW_PLACES || !seen_points_match_cameras(s);
    const double seeding = !seeds ? 0
                                  : fmin(train_count, SEED_VIEWS_MOST) * SEED_PIXEL_BYTES *
                                        fmin(largest, (double)SEED_LONG_SIDE * SEED_LONG_SIDE);
    const double points = seeds ? fmax((double)s->points.count, found_points) : (double)s->points.count,
                 learning = fmin(points, most_points);
    memory_need need = {
        .program = program_bytes,
        .reading = (double)s->file_bytes + raw_point_bytes * points,
        .points = point_bytes * points,
        .trees = tree_bytes * points,
        .decoding = fmax(decoded * (double)photos_at_once(s, 0), decoded + seeding),
        .photos = fmin(train_bytes, (double)PHOTOS_KEPT_BYTES),
        .anchors = (learning_point_bytes + saved_point_bytes) * learning,
        .view = fmax(score_pixel_bytes * largest, step_pixel_bytes * picked),
    };
    const double scoring = need.reading + model_point_bytes * learning, /* the data is read again */
        starting = need.points + need.photos + fmax(need.decoding, need.trees),
                 stepping = need.points + need.photos + need.anchors + fmax(need.view, decoded);
    need.whole = fmax(need.program + fmax(scoring, fmax(starting, stepping)), least_bytes);
    need.least = fmin(need.whole, 16.0 / 15 * (need.program + fmax(tree_fixed_bytes * points, need.view)));
    /* Memory is paged out down to 5/8 of the limit (base/paged.h), but not while a photo is decoded. */
    need.least = fmax(need.least, fmax(8.0 / 3 * decoded, least_bytes));
    need.whole = fmax(need.whole, need.least);
    return need;
}
