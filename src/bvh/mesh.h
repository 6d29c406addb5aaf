/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/mesh.h -- rays against a triangle mesh, on Embree's watertight kernels. */
#ifndef GBT_BVH_MESH_H
#define GBT_BVH_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef struct mesh_tree mesh_tree; /* immutable once built; rays may be traced from any thread */

/** Vertices and ray origins lie in [-1e12, 1e12]: products of three coordinates must stay finite in
    float32. */
#define MESH_COORDINATE_LIMIT 1e12f

/**
 * Build the tree of a mesh.
 *
 * Triangles without area (in double, from the float32 vertices) are kept in the numbering and never hit.
 *
 * @param vertices  [in] [vertex_count][3], |x| <= MESH_COORDINATE_LIMIT, copied
 * @param triangles [in] [triangle_count][3] vertex numbers, copied
 * @param out       [out] free with mesh_tree_free(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (bad vertex or triangle: says which), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 *
 * Either count may be 0: no ray then hits anything.
 * Threads: any; builds on all threads inside. Cost: O(n log n); about 100 bytes per triangle.
 */
gbt_status mesh_tree_build(const float *vertices, size_t vertex_count, const uint32_t *triangles,
                           size_t triangle_count, mesh_tree **out, gbt_error *err);

/** GBT_ERR_ARGUMENT when a vertex number is not below `vertex_count`; part of mesh_tree_build(). */
gbt_status mesh_check_triangles(const uint32_t *triangles, size_t triangle_count, size_t vertex_count,
                                gbt_error *err);

typedef struct mesh_hit {
    double u, v; /* the point is (1 - u - v) a + u b + v c for the triangle (a, b, c); at an edge it may be
                    outside by Embree's rounding */
    float t;     /* in lengths of dir: the point is origin + t dir */
    float normal[3]; /* geometric, unit: along (b - a) x (c - a), whichever side the ray came from */
    uint32_t triangle;
} mesh_hit;

/**
 * The nearest hit with 0 < t <= t_max, from either side; among hits of equal float32 t the lowest
 * triangle number.
 *
 * t, u, v and the normal are computed in double (t and the normal are rounded), so they have the same bits
 * for every instruction set; only where two different triangles are hit within float32 rounding of each other
 * (a shared edge) may the set decide which of them is reported.
 *
 * @param dir [in] any length but 0; need not be unit
 * @param hit [out] untouched when there is none
 * @return false for no hit, and for a ray that cannot be traced: not finite, origin out of range, zero dir,
 *         t_max < 0. t_max may be infinite.
 */
bool mesh_tree_trace(const mesh_tree *tree, const float origin[3], const float dir[3], float t_max,
                     mesh_hit *hit);

/** Whether there is any hit with 0 < t <= t_max: what a shadow ray asks. False for a ray that cannot be
    traced. */
bool mesh_tree_blocked(const mesh_tree *tree, const float origin[3], const float dir[3], float t_max);

void mesh_tree_free(mesh_tree *tree); /* NULL is fine */

#endif
