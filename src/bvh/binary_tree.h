/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/binary_tree.h -- a binary BVH over boxes, made by Embree's builder, and its collapse into nodes of many
   children.

   Embree is asked for a binary tree, because its wider builders make as many children as they can and leave
   leaves almost empty. */
#ifndef GBT_BVH_BINARY_TREE_H
#define GBT_BVH_BINARY_TREE_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "bvh/embree_api.h"
#include "gbtrace/status.h"

typedef struct binary_node {
    struct RTCBounds bounds[2];
    uint64_t child[2]; /* address of a binary_node, or that of a binary_leaf + 1 */
} binary_node;

typedef struct binary_leaf {
    uint32_t count, id[]; /* primIDs */
} binary_leaf;

/** Nodes and leaves stay in `bvh` until its next build or release. */
typedef struct binary_tree {
    uint64_t root; /* as a child */
    size_t node_count, leaf_count;
    atomic_size_t nodes_made, leaves_made; /* while Embree builds */
    atomic_bool refused;                   /* an allocation of Embree was refused: the tree is incomplete */
} binary_tree;

/**
 * Build a binary tree over at least one box: the same for any number of threads.
 *
 * @param boxes    [in, out] [capacity], sorted by Embree; those above count are its working space
 * @param leaf_max [in] most boxes of a leaf; to the SAH a leaf with one box costs as much as a full one
 * @param what     [in] what errors begin with
 * @return GBT_OK, GBT_ERR_NO_MEMORY (also beyond bvh_limit_memory()) or GBT_ERR_INTERNAL
 */
gbt_status binary_tree_build(binary_tree *tree, RTCBVH bvh, struct RTCBuildPrimitive *boxes, size_t count,
                             size_t capacity, unsigned leaf_max, const char *what, gbt_error *err);

static inline const binary_leaf *binary_leaf_of(uint64_t child)
{
    return (child & 1) != 0 ? (const binary_leaf *)(uintptr_t)(child - 1) : NULL;
}

/** The children of a wide node in place of the binary one: the largest of them is replaced by its own two
    children, until there are `width` or only leaves. @return how many */
int binary_node_open(const binary_node *root, int width, struct RTCBounds *bounds, uint64_t *child);

#endif
