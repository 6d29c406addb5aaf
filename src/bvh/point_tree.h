/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/point_tree.h -- the inside of a point_tree (bvh/points.h), for the files that build it and those that
   query it.

     position --> [boxes in float32] --> Embree's builder --> binary tree     point_tree.c
                                                                 |  opened to 8 children, boxes in double
                                                                 v
         answers <-- [walk, nearest first or all that touch] <-- nodes, and points in the order of the leaves
                      points_nearest.c, points_list.c; many queries: points_batch.c

   Box and point are compared with the query by the same expression in double. Subtraction, squares and sums
   are monotone under rounding, so the squared distance of a box is never above that of a point in it: walks
   need no margins, and miss nothing. Only rays need a margin (points_list.c). */
#ifndef GBT_BVH_POINT_TREE_H
#define GBT_BVH_POINT_TREE_H

#include <math.h>

#include "bvh/points.h"

enum { POINT_WIDTH = 8, POINT_DEPTH_MAX = 512, POINT_STACK = POINT_DEPTH_MAX * (POINT_WIDTH - 1) + 1 };

/* Eight cache lines. Lanes from child_count on repeat the first. */
typedef struct point_node {
    _Alignas(64) double lower[3][POINT_WIDTH], upper[3][POINT_WIDTH]; /* of the centres */
    float radius[POINT_WIDTH];         /* the largest of the child's balls, rounded up */
    uint32_t child[POINT_WIDTH];       /* a node, or the first place of a leaf */
    uint32_t least_index[POINT_WIDTH]; /* of the points in the child: among equal distances the least wins */
    uint8_t size[POINT_WIDTH];         /* points of a leaf; 0: a node */
    uint8_t child_count;
} point_node;

struct point_tree {
    size_t count, node_count;
    point_node *nodes; /* the root first, children behind their parents */
    /* By place, the order of the leaves. A leaf of m points from place p on has its x, its y and its z, m of
       each, from coordinate[3 p] on. Eight more may be read behind the end. */
    double *coordinate;
    double *radius;                   /* NULL for points */
    uint32_t *index;                  /* of the point as it was given */
    double lower[3], upper[3], reach; /* of the centres; the largest |coordinate| of any ball */
};

/** Squared distances to the eight boxes of a node, from the nearest point of each. (A comparison with 0 would
    be a branch without AVX-512, and the loop no vectors.) */
static inline __attribute__((always_inline)) void boxes_distance(const point_node *node, const double q[3],
                                                                 double out[POINT_WIDTH])
{
    for (int i = 0; i < POINT_WIDTH; i++) {
        double sum = 0;
        for (int j = 0; j < 3; j++) {
            const double lower = node->lower[j][i], upper = node->upper[j][i];
            const double raised = q[j] > lower ? q[j] : lower, held = raised < upper ? raised : upper;
            const double d = held - q[j];
            sum += d * d;
        }
        out[i] = sum;
    }
}

/** Squared distances to the points of a leaf; lanes from `size` on hold anything. */
static inline __attribute__((always_inline)) void points_distance(const point_tree *tree, uint32_t place,
                                                                  size_t size, const double q[3],
                                                                  double out[POINT_WIDTH])
{
    const double *x = tree->coordinate + 3 * (size_t)place, *y = x + size, *z = y + size;
    for (int i = 0; i < POINT_WIDTH; i++) {
        const double dx = x[i] - q[0], dy = y[i] - q[1], dz = z[i] - q[2];
        out[i] = dx * dx + dy * dy + dz * dz;
    }
}

static inline bool usable3(const double v[3])
{
    return fabs(v[0]) <= POINT_LIMIT && fabs(v[1]) <= POINT_LIMIT && fabs(v[2]) <= POINT_LIMIT;
}

/** GBT_OK, or what is wrong with a query. */
gbt_status point_query_check(const point_query *query, gbt_error *err);

/** Sorts by the upper 32 bits, of which the lowest `bits` are used; stable. `spare` [count]. */
void point_sort(uint64_t *item, uint64_t *spare, size_t count, int bits);

#endif
