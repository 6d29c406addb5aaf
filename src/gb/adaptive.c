/* SPDX-License-Identifier: Apache-2.0 */
/* gb/adaptive.c -- adaptive granular balls: a best-first partition of a cloud into a given number of balls.

   points --> [joint moments: nats, axis] --> [2-means along the axis] --> saving of the cut --> heap
   heap --best--> the two parts, the same way
        \--enough--> balls

   Every set in the heap has already been cut (in place, so the array stays in tree order); opening it only
   divides its range into the two parts. Statistics are computed in joint.c, balls are written by fill.c. */
#include "gb/adaptive.h"

#include <math.h>
#include <stdbool.h>

#include "base/fail.h"
#include "base/memory.h"
#include "gb/cloud.h"
#include "gb/fill.h"
#include "gb/joint.h"

enum {
    MEANS_ROUNDS = 16, /* of 2-means, which converges in about five */
    DEPTH_MAX = 254    /* a byte stores 1 + depth */
};

adaptive_def adaptive_def_default(void) { return (adaptive_def){.color_unit = 0.1f, .min_scale = 0.25f}; }

static gbt_status check_def(const adaptive_def *def, gbt_error *err)
{
    if (!(def->voxel_size > 0.0f) || !isfinite(def->voxel_size))
        return base_fail(err, GBT_ERR_ARGUMENT, "adaptive balls: bad voxel_size (wanted > 0, got %g)",
                         (double)def->voxel_size);
    if (!(def->color_unit > 0.0f) || !isfinite(def->color_unit))
        return base_fail(err, GBT_ERR_ARGUMENT, "adaptive balls: bad color_unit (wanted > 0, got %g)",
                         (double)def->color_unit);
    if (def->balls_max < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "adaptive balls: bad balls_max (wanted >= 1, got 0)");
    if (!(def->min_scale >= 0.0f) || !isfinite(def->min_scale))
        return base_fail(err, GBT_ERR_ARGUMENT, "adaptive balls: bad min_scale (wanted >= 0, got %g)",
                         (double)def->min_scale);
    return GBT_OK;
}

/* A set in the heap, with its prepared cut. */
typedef struct waiting {
    double saving;  /* nats saved by the cut; 0 when the set cannot be cut */
    uint32_t begin; /* index of its first point; it gives the set's position in the tree, independent of input
                       order */
    uint32_t count;
    uint32_t left; /* size of the left part, 0 when it cannot be cut */
    uint8_t depth;
} waiting;

typedef struct cutter {
    joint_space space;
    cloud_point *points; /* [n], reordered in place */
    double *keys;        /* [n], coordinates along the axis of the set being cut */
} cutter;

/* ---- a cut ---- */

/* The threshold of 2-means on `keys`, which have mean 0: keys up to it go left. */
static double two_means(const double *keys, size_t count)
{
    double bound = 0;
    for (int round = 0; round < MEANS_ROUNDS; round++) {
        double sum[2] = {0, 0};
        size_t in[2] = {0, 0};
        for (size_t i = 0; i < count; i++) {
            const int side = keys[i] > bound;
            sum[side] += keys[i];
            in[side]++;
        }
        if (in[0] == 0 || in[1] == 0)
            break; /* the points differ only by rounding */
        const double next = 0.5 * (sum[0] / (double)in[0] + sum[1] / (double)in[1]);
        if (next == bound)
            break;
        bound = next;
    }
    return bound;
}

/* Move points with keys up to `bound` to the front; returns their number. */
static size_t move_left(cloud_point *points, double *keys, size_t count, double bound)
{
    size_t left = 0;
    for (size_t i = 0; i < count; i++)
        if (keys[i] <= bound) {
            const cloud_point point = points[i];
            const double key = keys[i];
            points[i] = points[left];
            keys[i] = keys[left];
            points[left] = point;
            keys[left++] = key;
        }
    return left;
}

static double nats_of(const cutter *c, const cloud_point *points, size_t count)
{
    joint_moments m;
    joint_compute(&c->space, points, count, &m);
    return joint_nats(&m, count);
}

/* Cut a set and compute the saving. */
static waiting prepare(const cutter *c, size_t begin, size_t count, int depth)
{
    waiting w = {.begin = (uint32_t)begin, .count = (uint32_t)count, .depth = (uint8_t)depth};
    if (count < 2 || depth >= DEPTH_MAX)
        return w;
    cloud_point *points = c->points + begin;
    joint_moments m;
    joint_compute(&c->space, points, count, &m);
    /* Do not cut a set at a single position: two anchors in one place are useless, even if colours differ. */
    if (!(m.covariance[0][0] + m.covariance[1][1] + m.covariance[2][2] > 0))
        return w;
    double axis[JOINT_DIM], y[JOINT_DIM];
    joint_axis(&m, axis);
    for (size_t i = 0; i < count; i++) {
        joint_of(&c->space, &points[i], y);
        c->keys[i] = 0;
        for (int k = 0; k < JOINT_DIM; k++)
            c->keys[i] += (y[k] - m.mean[k]) * axis[k];
    }
    const size_t left = move_left(points, c->keys, count, two_means(c->keys, count));
    if (left == 0 || left == count)
        return w;
    w.left = (uint32_t)left;
    w.saving =
        fmax(0.0, joint_nats(&m, count) - nats_of(c, points, left) - nats_of(c, points + left, count - left));
    return w;
}

/* ---- best-first search ---- */

static bool goes_before(const waiting *a, const waiting *b)
{
    if ((a->left > 0) != (b->left > 0))
        return a->left > 0;
    return a->saving != b->saving ? a->saving > b->saving : a->begin < b->begin;
}

static void heap_push(waiting *heap, size_t count, waiting added)
{
    size_t i = count;
    for (; i > 0 && goes_before(&added, &heap[(i - 1) / 2]); i = (i - 1) / 2)
        heap[i] = heap[(i - 1) / 2];
    heap[i] = added;
}

/* Replace the first entry by `next`. */
static void heap_replace_first(waiting *heap, size_t count, waiting next)
{
    size_t i = 0;
    for (size_t child = 1; child < count; child = 2 * i + 1) {
        if (child + 1 < count && goes_before(&heap[child + 1], &heap[child]))
            child++;
        if (!goes_before(&heap[child], &next))
            break;
        heap[i] = heap[child];
        i = child;
    }
    heap[i] = next;
}

/* Cut until there are `most` sets, or none can be cut; returns the number of sets. */
static size_t cut_best_first(const cutter *c, waiting *heap, size_t point_count, size_t most)
{
    size_t count = 1;
    heap[0] = prepare(c, 0, point_count, 0);
    while (count < most && heap[0].left > 0) {
        const waiting w = heap[0];
        heap_replace_first(heap, count, prepare(c, w.begin, w.left, w.depth + 1));
        heap_push(heap, count++, prepare(c, (size_t)w.begin + w.left, w.count - w.left, w.depth + 1));
    }
    return count;
}

gbt_status balls_adapt(const float *position, const float *color, size_t count, const adaptive_def *def,
                       balls *out, gbt_error *err)
{
    *out = (balls){0};
    GBT_TRY(check_def(def, err));
    GBT_TRY(cloud_check("adaptive balls", position, color, count, err));
    gbt_status status = GBT_ERR_NO_MEMORY;
    const size_t most = def->balls_max < count ? def->balls_max : count;
    cutter c = {.space = {color, (double)def->voxel_size, (double)def->color_unit}};
    waiting *heap = mem_alloc(most, sizeof *heap, "adaptive balls", err);
    uint8_t *leaf_depth = mem_calloc(count, sizeof *leaf_depth, "adaptive balls", err);
    c.points = mem_alloc(count, sizeof *c.points, "adaptive balls", err);
    c.keys = mem_alloc(count, sizeof *c.keys, "adaptive balls", err);
    if (heap == NULL || leaf_depth == NULL || c.points == NULL || c.keys == NULL)
        goto done;
    for (size_t i = 0; i < count; i++)
        c.points[i] = (cloud_point){{position[3 * i], position[3 * i + 1], position[3 * i + 2]}, (uint32_t)i};
    const size_t found = count > 0 ? cut_best_first(&c, heap, count, most) : 0;
    for (size_t i = 0; i < found; i++)
        leaf_depth[heap[i].begin] = (uint8_t)(heap[i].depth + 1);
    const double radius_floor = fmax((double)def->min_scale, 1e-6) * (double)def->voxel_size;
    status = balls_fill(c.points, leaf_depth, count, color, radius_floor, out, err);
done:
    mem_free(heap);
    mem_free(leaf_depth);
    mem_free(c.points);
    mem_free(c.keys);
    if (status != GBT_OK)
        balls_free(out);
    return status;
}
