/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/init.c -- initial anchors from balls, voxels or points, and their initial scales (Yang 2026).

   points --> balls (GBAI, eq 28), voxels (eq 12) or some points --> centres
        --> spacing (+ ball radius: GBSP, eqs 29-34) --> log-scales */
#include "anchor/init.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "bvh/points.h"
#include "gb/adaptive.h"
#include "gb/cloud.h"

anchor_init_def anchor_init_def_default(void)
{
    return (anchor_init_def){.kind = GBT_INIT_GB,
                             .scale = GBT_SCALE_PRIOR_GB,
                             .fraction = 0,
                             .balls = balls_def_default(),
                             .offset_count = 10,
                             .fusion = 0.5f,
                             .clip_min = 0.25f,
                             .clip_max = 4.0f,
                             .scale_factor = 1.0f,
                             .scale_max = INFINITY};
}

static gbt_status check_def(const anchor_init_def *def, gbt_error *err)
{
    if (def->offset_count < 1 || def->offset_count > ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: offset_count %d (wanted 1 to %d)",
                         def->offset_count, ANCHOR_MAX_OFFSETS);
    if (!(def->balls.voxel_size > 0.0f && def->balls.voxel_size < HUGE_VALF))
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: voxel_size %g (wanted > 0)",
                         (double)def->balls.voxel_size);
    if (!(def->fraction >= 0 && def->fraction <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: fraction %g (wanted 0 to 1)", def->fraction);
    if (!(def->fusion >= 0.0f && def->fusion <= 1.0f))
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: fusion %g (wanted 0 to 1)", (double)def->fusion);
    if (!(def->clip_min >= 0.0f && def->clip_min <= def->clip_max))
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: clip %g to %g (wanted 0 <= min <= max)",
                         (double)def->clip_min, (double)def->clip_max);
    if (!(def->scale_max > 0.0f && def->scale_factor > 0.0f && def->scale_factor < HUGE_VALF))
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: scale_max %g, scale_factor %g (wanted > 0)",
                         (double)def->scale_max, (double)def->scale_factor);
    return GBT_OK;
}

static const double baseline_spacing_min = 3.1622776601683794e-4; /* sqrt(1e-7) */

/* The cap takes precedence over floor and factor. */
static double first_scale(double scale, double floor_scale, double factor, double most)
{
    return fmin(factor * fmax(scale, floor_scale), most);
}

static void set_scale(anchors *a, size_t i, double scale)
{
    for (size_t c = 0; c < 6; c++)
        a->scale_log[i * 6 + c] = (float)log(scale);
}

gbt_status anchor_scales_from_spacing(const float *position, size_t count, double least, double factor,
                                      double most, float *out, gbt_error *err)
{
    point_tree *tree = NULL;
    GBT_TRY(point_tree_build(number_floats(position), (number_array){0}, count, &tree, err));
    const gbt_status status = point_tree_spacing(tree, number_floats(position), 3, out, err);
    for (size_t i = 0; i < count && status == GBT_OK; i++)
        out[i] = (float)first_scale((double)out[i], least, factor, most);
    point_tree_free(tree);
    return status;
}

/* The baseline rule. A single anchor has no spacing and uses the voxel size. */
static gbt_status scale_from_spacing(anchors *a, const anchor_init_def *def, gbt_error *err)
{
    const double factor = (double)def->scale_factor, most = (double)def->scale_max,
                 least = def->kind == GBT_INIT_VOXEL && def->balls.min_radius > 0
                             ? baseline_spacing_min
                             : ANCHOR_SPACING_LEAST(def->balls.voxel_size);
    if (a->count == 1) {
        set_scale(a, 0, first_scale((double)def->balls.voxel_size, least, factor, most));
        return GBT_OK;
    }
    float *scale = mem_alloc(a->count, sizeof *scale, "anchors", err);
    if (scale == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status =
        anchor_scales_from_spacing(a->position, a->count, least, factor, most, scale, err);
    for (size_t i = 0; i < a->count && status == GBT_OK; i++)
        set_scale(a, i, (double)scale[i]);
    mem_free(scale);
    return status;
}

/* ---- GBSP ---- */

typedef struct prior_job {
    anchors *a;
    const anchor_init_def *def;
    const float *radius;
    const double *squared; /* [count], squared distance to the nearest other centre; infinite for a single
                              one */
    double floor_scale;
} prior_job;

static void prior_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const prior_job *job = context;
    const anchor_init_def *def = job->def;
    for (size_t i = begin; i < end; i++) {
        const double radius = (double)job->radius[i];
        const double square = job->squared[i];
        const bool spaced = square > 0 && square < HUGE_VAL;
        const double near =
            spaced ? sqrt(square) : radius; /* single or coincident anchors have no spacing: use the radius */
        const double clipped = fmin(fmax(radius, (double)def->clip_min * near), (double)def->clip_max * near);
        const double fused = (double)def->fusion * near + (1.0 - (double)def->fusion) * clipped;
        set_scale(job->a, i,
                  first_scale(fused, job->floor_scale, (double)def->scale_factor, (double)def->scale_max));
    }
}

static gbt_status scale_from_balls(anchors *a, const float *radius, const anchor_init_def *def,
                                   gbt_error *err)
{
    uint32_t *index = mem_alloc(a->count, sizeof *index, "anchors", err);
    double *squared = mem_alloc(a->count, sizeof *squared, "anchors", err);
    const gbt_status status =
        index == NULL || squared == NULL
            ? GBT_ERR_NO_MEMORY
            : points_find_nearest(a->position, a->count, NULL, a->count, index, squared, err);
    if (status == GBT_OK) {
        /* eps of eq 34 is s_min of eq 21, so that no scale is below the radius of the smallest ball. */
        prior_job job = {.a = a,
                         .def = def,
                         .radius = radius,
                         .squared = squared,
                         .floor_scale = balls_least_radius(&def->balls)};
        parallel_blocks(a->count, 1024, prior_block, &job);
    }
    mem_free(index);
    mem_free(squared);
    return status;
}

/* ---- entry ---- */

static gbt_status place(anchors *a, const float *center, size_t count, gbt_error *err)
{
    GBT_TRY(anchors_resize(a, count, err));
    memcpy(a->position, center, count * 3 * sizeof *center);
    return GBT_OK;
}

/* A uniformly random subset of `wanted` points, in input order. */
static gbt_status choose_points(const float *position, size_t count, size_t wanted, uint64_t seed,
                                float **out, gbt_error *err)
{
    GBT_TRY(cloud_check("random anchors", position, NULL, count, err));
    *out = mem_alloc(wanted, 3 * sizeof **out, "anchors", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t chosen = 0;
    for (size_t i = 0; i < count && chosen < wanted; i++)
        if ((double)rng_uniform(seed, RNG_STREAM_RANDOM_ANCHORS, i) * (double)(count - i) <
            (double)(wanted - chosen))
            memcpy(*out + 3 * chosen++, position + 3 * i, 3 * sizeof **out);
    return GBT_OK;
}

/* Number of anchors for the kinds that can make any number of them. */
static gbt_status count_wanted(const float *position, const float *color, size_t count,
                               const anchor_init_def *def, size_t *out, gbt_error *err)
{
    *out = (size_t)ceil(def->fraction * (double)count);
    if (def->fraction > 0 || count == 0)
        return GBT_OK;
    balls paper;
    GBT_TRY(balls_build(position, color, count, &def->balls, &paper, err));
    *out = paper.count > 1 ? paper.count / 2 : 1;
    balls_free(&paper);
    return GBT_OK;
}

/* Positions of the anchors, and the balls that they represent, if any. */
static gbt_status find_centers(const float *position, const float *color, size_t count,
                               const anchor_init_def *def, balls *found, float **centers,
                               size_t *center_count, gbt_error *err)
{
    if (def->kind == GBT_INIT_VOXEL)
        return voxel_centers(position, count, def->balls.voxel_size, centers, center_count, err);
    if (def->kind == GBT_INIT_GB)
        return balls_build(position, color, count, &def->balls, found, err);
    size_t wanted;
    GBT_TRY(count_wanted(position, color, count, def, &wanted, err));
    if (def->kind == GBT_INIT_RANDOM) {
        *center_count = wanted;
        return choose_points(position, count, wanted, def->seed, centers, err);
    }
    adaptive_def adaptive = adaptive_def_default();
    adaptive.voxel_size = def->balls.voxel_size;
    adaptive.min_scale = def->balls.min_scale;
    adaptive.balls_max = wanted > 0 ? wanted : 1;
    return balls_adapt(position, color, count, &adaptive, found, err);
}

gbt_status anchors_init(const float *position, const float *color, size_t count, const anchor_init_def *def,
                        anchors *out, balls *out_balls, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (out_balls != NULL)
        memset(out_balls, 0, sizeof *out_balls);
    GBT_TRY(check_def(def, err));
    anchors a = {.offset_count = def->offset_count};
    balls found = {0};
    float *centers = NULL;
    size_t center_count = 0;
    gbt_status status = find_centers(position, color, count, def, &found, &centers, &center_count, err);
    if (status == GBT_OK)
        status = centers != NULL ? place(&a, centers, center_count, err)
                                 : place(&a, found.center, found.count, err);
    if (status == GBT_OK && a.count > 0)
        status = def->kind == GBT_INIT_GB && def->scale == GBT_SCALE_PRIOR_GB
                     ? scale_from_balls(&a, found.radius, def, err)
                     : scale_from_spacing(&a, def, err);
    mem_free(centers);
    if (status != GBT_OK) {
        anchors_free(&a);
        balls_free(&found);
        return status;
    }
    *out = a;
    if (out_balls != NULL)
        *out_balls = found;
    else
        balls_free(&found);
    return GBT_OK;
}
