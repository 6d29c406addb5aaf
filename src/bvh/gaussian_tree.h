/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/gaussian_tree.h -- a 16-wide tree over the ellipsoid proxies of Gaussians, made by Embree's builder
   (Wald 2014).

   The proxy of Gaussian i is the ellipsoid at k = sqrt(2 ln(opacity / alpha_min)) std-devs: the set where its
   response reaches alpha_min. Inner nodes hold the padded tight boxes of these ellipsoids (proxy.h); leaves
   hold up to 16 of the ellipsoids themselves, with k^2 enlarged by 1e-4 for rounding.

   Both are laid out for kernels that test 16 children at once, so their layout is part of the interface. */
#ifndef GBT_BVH_GAUSSIAN_TREE_H
#define GBT_BVH_GAUSSIAN_TREE_H

#include <stdint.h>

#include "base/gaussians.h"

enum { TREE_WIDTH = 16 };

/** Boxes of up to 16 children. Unused slots hold an inverted box (lower +1e30, upper -1e30) and child 0: no
    query touches them. */
typedef struct tree_node {
    _Alignas(64) float lower_x[TREE_WIDTH], upper_x[TREE_WIDTH];
    float lower_y[TREE_WIDTH], upper_y[TREE_WIDTH];
    float lower_z[TREE_WIDTH], upper_z[TREE_WIDTH];
    uint64_t child[TREE_WIDTH]; /* address of a tree_node, or that of a tree_leaf + 1 */
} tree_node;

/** Ellipsoids { x : (x - mean)^T covariance^-1 (x - mean) <= 1 }: covariance = k^2 R S S R^T, S the scales.
   Unused slots repeat the first. */
typedef struct tree_leaf {
    _Alignas(64) float mean[3][TREE_WIDTH];
    float covariance[6][TREE_WIDTH]; /* xx yy zz yz zx xy */
    uint32_t id[TREE_WIDTH];
    uint32_t count;
} tree_leaf;

static inline const tree_leaf *tree_child_leaf(uint64_t child) /* NULL for a tree_node */
{
    return (child & 1) != 0 ? (const tree_leaf *)(uintptr_t)(child - 1) : NULL;
}

typedef struct gaussian_tree {
    const tree_node *root;   /* NULL when no Gaussian is visible at all */
    const tree_leaf *leaves; /* [leaf_count], in the order of the tree */
    size_t box_count; /* Gaussians in the tree; those with opacity <= alpha_min or non-finite fields are left
                         out */
    size_t rejected_count; /* of these, the non-finite or out-of-range ones */
    size_t node_count, leaf_count, bytes;
    float coordinate_max; /* largest |coordinate| of any box */
    void *internal;       /* Embree's builder memory */
} gaussian_tree;

/**
 * Build (or rebuild) the tree.
 *
 * @param alpha_min  [in] smallest response that counts, (0, 1)
 * @param reach      [in] largest |coordinate| of any ray origin that will be traced: boxes are padded for it
 * @param tree       [in,out] start from {0}; memory is reused from build to build; free with
 *         gaussian_tree_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY or GBT_ERR_INTERNAL (Embree's own words)
 *
 * Threads: one build at a time per tree; uses all threads inside; the same tree for every thread count.
 * Cost: O(n log n); about 70 bytes per Gaussian.
 */
gbt_status gaussian_tree_build(const gaussians *g, float alpha_min, float reach, gaussian_tree *tree,
                               gbt_error *err);
void gaussian_tree_free(gaussian_tree *tree);

#endif
