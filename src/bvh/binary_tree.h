/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/binary_tree.h -- what Embree's builder makes for us: a binary tree over boxes, and its opening into
   nodes of many children. Binary, because its wider builders make as many children as they can and leave
   leaves almost empty. */
#ifndef GBT_BVH_BINARY_TREE_H
#define GBT_BVH_BINARY_TREE_H

#include <stdatomic.h>
#include <stdbool.h>
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
    atomic_bool refused;                   /* an allocation of Embree's was refused: the tree has holes */
} binary_tree;

/**
 * Over at least one box. The same tree for any number of threads.
 *
 * @param boxes    [in, out] [capacity], sorted by Embree; those above count are its working space
 * @param leaf_max [in] boxes of a leaf at most; a leaf costs the same, whether it holds 1 or as many
 * @param what     [in] what errors begin with
 * @return GBT_OK, GBT_ERR_NO_MEMORY (also beyond bvh_limit_memory()) or GBT_ERR_INTERNAL
 */
gbt_status binary_tree_build(binary_tree *tree, RTCBVH bvh, struct RTCBuildPrimitive *boxes, size_t count,
                             size_t capacity, unsigned leaf_max, const char *what, gbt_error *err);

static inline const binary_leaf *binary_leaf_of(uint64_t child)
{
    return (child & 1) != 0 ? (const binary_leaf *)(uintptr_t)(child - 1) : NULL;
}

/** The children of a node that holds up to `width`: of the binary ones below it the largest is opened until
    there are so many. @return how many */
int binary_node_open(const binary_node *root, int width, struct RTCBounds *bounds, uint64_t *child);

#endif
