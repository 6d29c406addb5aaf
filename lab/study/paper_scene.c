/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_scene.c -- what a scene's points tell before any training: the depth of the balls, and the mean
   scale factor of GBSP. */
#include <limits.h>
#include <math.h>

#include "anchor/init.h"
#include "base/fail.h"
#include "data/scene.h"
#include "study/paper.h"

/* A ball of a single point gets a GBSP scale of 0.625 of its spacing: half the spacing, plus half of the
   lower end of the clip range. */
static const double constant_of_singletons = 0.625;

double paper_ball_count(double points, int max_depth)
{
    /* At each depth only two sizes of sets occur, n and n + 1 points. */
    double n = points, sets = 1, larger = 0, done = 0;
    for (int depth = 0; depth < max_depth && sets + larger > 0; depth++) {
        if (n <= 2)
            done += sets, sets = 0;
        if (n + 1 <= 2)
            done += larger, larger = 0;
        const double half = floor(n / 2), odd = n - 2 * half;
        /* A set of n points is split into n/2 twice, or n/2 and n/2 + 1; one of n + 1 into the same, or n/2 +
         * 1 twice. */
        const double small = odd == 0 ? 2 * sets + larger : sets,
                     large = odd == 0 ? larger : sets + 2 * larger;
        n = half;
        sets = small;
        larger = large;
    }
    return points < 1 ? 0 : done + sets + larger;
}

/* Make anchors as training with `compat` does. */
static gbt_status make_anchors(const scene_points *points, double voxel_size, gbt_scale_prior scale,
                               anchors *out, balls *out_balls, gbt_error *err)
{
    anchor_init_def def = anchor_init_def_default();
    def.scale = scale;
    def.balls.min_radius = BALLS_PAPER_MIN_RADIUS;
    def.balls.voxel_size = (float)voxel_size;
    if (voxel_size == 0)
        GBT_TRY(balls_voxel_size(points->position, points->count, GBT_VOXEL_RULE_SQUARED,
                                 &def.balls.voxel_size, err));
    return anchors_init(points->position, points->has_color ? points->color : NULL, points->count, &def, out,
                        out_balls, err);
}

static gbt_status look_at_points(const scene_points *points, double voxel_size, paper_scene *out,
                                 gbt_error *err)
{
    anchors prior = {0}, spacing = {0};
    balls found = {0};
    gbt_status status = make_anchors(points, voxel_size, GBT_SCALE_PRIOR_GB, &prior, &found, err);
    if (status == GBT_OK)
        status = make_anchors(points, voxel_size, GBT_SCALE_PRIOR_NN, &spacing, NULL, err);
    if (status == GBT_OK) {
        double sum = 0;
        out->tree_depth = 0;
        for (size_t i = 0; i < found.count; i++) {
            sum += (double)prior.scale_log[6 * i] - (double)spacing.scale_log[6 * i];
            out->tree_depth = found.depth[i] > out->tree_depth ? found.depth[i] : out->tree_depth;
        }
        out->scale_constant = fmin(fmax(exp(sum / (double)found.count), 0.01),
                                   100); /* limited to the range that training accepts */
    }
    balls_free(&found);
    anchors_free(&prior);
    anchors_free(&spacing);
    return status;
}

gbt_status paper_scene_look(const char *data, double voxel_size, paper_scene *out, gbt_error *err)
{
    scene s;
    out->tree_depth = INT_MAX;
    out->scale_constant = constant_of_singletons;
    GBT_TRY(scene_load_in_place(data, NULL, &s, err));
    const gbt_status status = s.points.count > 0 ? look_at_points(&s.points, voxel_size, out, err) : GBT_OK;
    scene_free(&s);
    return status;
}
