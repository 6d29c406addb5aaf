/* SPDX-License-Identifier: Apache-2.0 */
/* gb/balls.c -- the recursive granular-ball partition (Yang 2026, eqs 16-27).

   points --> [moments: mean, r; sigma_a] --stop?--> mark a ball where the set begins
                   |
                   +--> [principal axis, median] --> left, right (in place, in depth-first order)

   The top of the tree is grown level by level; then each sub-tree is one block of parallel work. Marks and
   positions depend only on the points, so results do not depend on the number of threads. Statistics are
   computed in moments.c, cuts in split.c, and balls are written by fill.c. */
#include "gb/balls.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "gb/cloud.h"
#include "gb/fill.h"
#include "gb/moments.h"
#include "gb/split.h"

enum {
    BALL_DEPTH_MAX = 64,
    SUBTREES = 64,         /* the top is grown until there are this many sets for parallel work ... */
    SUBTREE_POINTS = 4096, /* ... or no set is larger than this */
    KEPT_SPACINGS = 4 /* limit, in v, for leaving a tied set whole: the scale prior clips radii at 4 spacings
                         anyway */
};

balls_def balls_def_default(void)
{
    return (balls_def){.voxel_size = 0.0f,
                       .radius_factor = 1.25f,
                       .color_std_max = 0.02f,
                       .min_points = 2,
                       .max_depth = 18,
                       .min_scale = 0.25f};
}

double balls_least_radius(const balls_def *def)
{
    return fmax(fmax((double)def->min_scale, 1e-6) * (double)def->voxel_size, (double)def->min_radius);
}

static gbt_status check_def(const balls_def *def, gbt_error *err)
{
    if (!(def->voxel_size > 0.0f) || !isfinite(def->voxel_size))
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad voxel_size (wanted > 0, got %g)",
                         (double)def->voxel_size);
    if (!(def->radius_factor > 0.0f) || !isfinite(def->radius_factor))
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad radius_factor (wanted > 0, got %g)",
                         (double)def->radius_factor);
    if (!(def->color_std_max >= 0.0f && def->color_std_max <= 1.0f))
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad color_std_max (wanted 0 to 1, got %g)",
                         (double)def->color_std_max);
    if (def->min_points < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad min_points (wanted >= 1, got %d)",
                         def->min_points);
    if (def->max_depth < 0 || def->max_depth > BALL_DEPTH_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad max_depth (wanted 0 to %d, got %d)",
                         BALL_DEPTH_MAX, def->max_depth);
    if (!(def->min_scale >= 0.0f) || !isfinite(def->min_scale))
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad min_scale (wanted >= 0, got %g)",
                         (double)def->min_scale);
    if (!(def->min_radius >= 0.0f) || !isfinite(def->min_radius))
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: bad min_radius (wanted >= 0, got %g)",
                         (double)def->min_radius);
    return GBT_OK;
}

typedef struct partition {
    cloud_point *points;   /* [n], reordered in place */
    double *keys;          /* [n], scratch for the cut */
    uint8_t *leaf_depth;   /* [n]: 1 + depth where a ball begins, else 0 */
    const float *color;    /* or NULL */
    double radius_compact; /* eta v */
    double radius_tied;    /* KEPT_SPACINGS v */
    double radius_floor;   /* s_min, eq 21 */
    double color_std_max;
    size_t min_points;
    int max_depth;
} partition;

typedef struct span {
    size_t begin, count;
    int depth;
} span;

/* Apply the stopping rule (eq 23) or cut; returns the size of the left part, 0 when the set is a ball. */
static size_t try_split(const partition *p, const span *s)
{
    if (s->count <= p->min_points || s->depth >= p->max_depth)
        return 0;
    cloud_point *points = p->points + s->begin;
    moments m;
    moments_compute(points, s->count, &m);
    const double radius = fmax(moments_radius(&m), p->radius_floor);
    if (radius <= p->radius_compact) {
        double mean[3];
        /* Colours are random memory accesses, so they are tested last, for the few sets that are compact
           enough to stop. */
        if (p->color == NULL || moments_color_std(points, s->count, p->color, mean) <= p->color_std_max)
            return 0;
    }
    /* Ties such as {a, b, b}: the paper keeps a set whole when its cut leaves all points on one side.
       Followed only where that is harmless: the set has one point too many and is not wide. */
    const bool keep_tied = s->count == p->min_points + 1 && radius <= p->radius_tied;
    return split_at_median(points, p->keys + s->begin, s->count, &m, keep_tied);
}

static void mark_ball(const partition *p, const span *s)
{
    p->leaf_depth[s->begin] = (uint8_t)(s->depth + 1);
}

static void children(const span *s, size_t left, span out[2])
{
    out[0] = (span){s->begin, left, s->depth + 1};
    out[1] = (span){s->begin + left, s->count - left, s->depth + 1};
}

static void grow_subtree(const partition *p, span root)
{
    span stack[BALL_DEPTH_MAX + 2]; /* one pending right part per level, and the current set */
    int waiting = 0;
    stack[waiting++] = root;
    while (waiting > 0) {
        const span s = stack[--waiting];
        const size_t left = try_split(p, &s);
        if (left == 0) {
            mark_ball(p, &s);
            continue;
        }
        span parts[2];
        children(&s, left, parts);
        stack[waiting++] = parts[1];
        stack[waiting++] = parts[0];
    }
}

typedef struct frontier {
    const partition *partition;
    size_t split_above; /* larger sets are cut while the top is grown, smaller ones later in their block */
    span open[2 * SUBTREES];
    size_t left[2 * SUBTREES];
    size_t count;
} frontier;

static void split_open(size_t block, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    frontier *f = context;
    f->left[block] = f->open[block].count > f->split_above ? try_split(f->partition, &f->open[block]) : 0;
}

static void grow_open(size_t block, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    const frontier *f = context;
    grow_subtree(f->partition, f->open[block]);
}

static void grow(const partition *p, size_t count)
{
    frontier f = {.partition = p, .open = {{0, count, 0}}, .count = 1};
    f.split_above = count / SUBTREES > SUBTREE_POINTS ? count / SUBTREES : SUBTREE_POINTS;
    bool grew = true;
    while (grew && f.count < SUBTREES) {
        parallel_blocks(f.count, 1, split_open, &f);
        span next[2 * SUBTREES];
        size_t next_count = 0;
        grew = false;
        for (size_t i = 0; i < f.count; i++) {
            if (f.left[i] > 0) {
                children(&f.open[i], f.left[i], next + next_count);
                next_count += 2;
                grew = true;
            } else if (f.open[i].count > f.split_above) {
                mark_ball(p, &f.open[i]);
            } else {
                next[next_count++] = f.open[i];
            }
        }
        memcpy(f.open, next, next_count * sizeof *next);
        f.count = next_count;
    }
    parallel_blocks(f.count, 1, grow_open, &f);
}

gbt_status balls_build(const float *position, const float *color, size_t count, const balls_def *def,
                       balls *out, gbt_error *err)
{
    *out = (balls){0};
    GBT_TRY(check_def(def, err));
    GBT_TRY(cloud_check("balls", position, color, count, err));

    gbt_status status = GBT_ERR_NO_MEMORY;
    const double voxel_size = (double)def->voxel_size;
    partition p = {.color = color,
                   .radius_compact = (double)def->radius_factor * voxel_size,
                   .radius_tied = KEPT_SPACINGS * voxel_size,
                   .radius_floor = balls_least_radius(def),
                   .color_std_max = (double)def->color_std_max,
                   .min_points = (size_t)def->min_points,
                   .max_depth = def->max_depth};
    if ((p.points = mem_alloc(count, sizeof *p.points, "balls.points", err)) == NULL ||
        (p.keys = mem_alloc(count, sizeof *p.keys, "balls.keys", err)) == NULL ||
        (p.leaf_depth = mem_calloc(count, sizeof *p.leaf_depth, "balls.leaf_depth", err)) == NULL)
        goto done;
    for (size_t i = 0; i < count; i++)
        p.points[i] = (cloud_point){{position[3 * i], position[3 * i + 1], position[3 * i + 2]}, (uint32_t)i};
    if (count > 0)
        grow(&p, count);
    mem_free(p.keys); /* freed before the balls are allocated, to limit the peak */
    p.keys = NULL;

    status = balls_fill(p.points, p.leaf_depth, count, color, p.radius_floor, out, err);
done:
    mem_free(p.points);
    mem_free(p.keys);
    mem_free(p.leaf_depth);
    if (status != GBT_OK)
        balls_free(out);
    return status;
}
