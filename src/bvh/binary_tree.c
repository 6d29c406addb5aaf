/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/binary_tree.c -- a binary BVH by Embree's builder, and its collapse into wider nodes.

   rtcBuildBVH (SAH; deterministic at medium quality) calls back for every node and leaf, which are made in
   its memory. binary_node_open() starts from the two children of a node and replaces the one with the largest
   surface by its own two children until there are as many as a wide node holds. */
#include "bvh/binary_tree.h"

#include <string.h>

#include "base/fail.h"
#include "bvh/device.h"

/* From 8 levels above this depth on Embree halves what is left, without SAH, and it fails where 2^8 leaves do
   not hold that. Outliers over all decades of float32 take up to 60 levels on each side of each axis. */
enum { DEPTH_MAX = 512 };

/* ---- Embree's callbacks; a leaf is its address with the lowest bit set ---- */

static void *take(binary_tree *tree, RTCThreadLocalAllocator allocator, size_t size)
{
    void *memory = rtcThreadLocalAlloc(allocator, size, 16);
    if (memory == NULL) /* the memory limit (bvh_limit_memory) */
        atomic_store_explicit(&tree->refused, true, memory_order_relaxed);
    return memory;
}

static void *create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void *user)
{
    (void)child_count;
    binary_tree *tree = user;
    embree_receive(tree);
    atomic_fetch_add_explicit(&tree->nodes_made, 1, memory_order_relaxed);
    void *node = take(tree, allocator, sizeof(binary_node));
    embree_publish(tree);
    return node;
}

static void set_children(void *pointer, void **children, unsigned child_count, void *user)
{
    binary_node *node = pointer;
    embree_receive(user);
    for (unsigned i = 0; i < child_count && node != NULL; i++)
        node->child[i] = (uint64_t)(uintptr_t)children[i];
    embree_publish(user);
}

static void set_bounds(void *pointer, const struct RTCBounds **bounds, unsigned child_count, void *user)
{
    binary_node *node = pointer;
    embree_receive(user);
    for (unsigned i = 0; i < child_count && node != NULL; i++)
        node->bounds[i] = *bounds[i];
    embree_publish(user);
}

static void *create_leaf(RTCThreadLocalAllocator allocator, const struct RTCBuildPrimitive *primitives,
                         size_t count, void *user)
{
    binary_tree *tree = user;
    embree_receive(tree);
    atomic_fetch_add_explicit(&tree->leaves_made, 1, memory_order_relaxed);
    binary_leaf *leaf = take(tree, allocator, sizeof *leaf + count * sizeof *leaf->id);
    if (leaf != NULL) {
        leaf->count = (uint32_t)count;
        for (size_t i = 0; i < count; i++)
            leaf->id[i] = primitives[i].primID;
    }
    embree_publish(tree);
    return leaf == NULL ? NULL : (char *)leaf + 1;
}

gbt_status binary_tree_build(binary_tree *tree, RTCBVH bvh, struct RTCBuildPrimitive *boxes, size_t count,
                             size_t capacity, unsigned leaf_max, const char *what, gbt_error *err)
{
    struct RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.byteSize = sizeof arguments;
    arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM; /* deterministic, unlike HIGH */
    arguments.maxBranchingFactor = 2;
    arguments.maxDepth = DEPTH_MAX;
    arguments.sahBlockSize = leaf_max;
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = leaf_max;
    arguments.traversalCost = 1;
    arguments.intersectionCost = 1;
    arguments.bvh = bvh;
    arguments.primitives = boxes;
    arguments.primitiveCount = count;
    arguments.primitiveArrayCapacity = capacity;
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.userPtr = tree;
    atomic_store(&tree->nodes_made, 0);
    atomic_store(&tree->leaves_made, 0);
    atomic_store(&tree->refused, false);
    embree_publish(tree);
    tree->root = (uint64_t)(uintptr_t)rtcBuildBVH(&arguments);
    embree_receive(tree);
    GBT_TRY(bvh_check(what, err));
    if (atomic_load(&tree->refused))
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: embree: out of memory", what);
    if (tree->root == 0)
        return base_fail(err, GBT_ERR_INTERNAL, "%s: Embree could not build a tree over %zu boxes", what,
                         count);
    tree->node_count = atomic_load(&tree->nodes_made);
    tree->leaf_count = atomic_load(&tree->leaves_made);
    return GBT_OK;
}

/* ---- binary nodes --> nodes of many ---- */

static float half_area(const struct RTCBounds *b)
{
    const float x = b->upper_x - b->lower_x, y = b->upper_y - b->lower_y, z = b->upper_z - b->lower_z;
    return x * y + y * z + z * x;
}

int binary_node_open(const binary_node *root, int width, struct RTCBounds *bounds, uint64_t *child)
{
    int count = 2;
    memcpy(bounds, root->bounds, 2 * sizeof *bounds);
    memcpy(child, root->child, 2 * sizeof *child);
    while (count < width) {
        int largest = -1;
        float area = -1;
        for (int i = 0; i < count; i++)
            if (binary_leaf_of(child[i]) == NULL && half_area(&bounds[i]) > area) {
                largest = i;
                area = half_area(&bounds[i]);
            }
        if (largest < 0)
            break;
        const binary_node *opened = (const binary_node *)(uintptr_t)child[largest];
        bounds[largest] = opened->bounds[0];
        child[largest] = opened->child[0];
        bounds[count] = opened->bounds[1];
        child[count++] = opened->child[1];
    }
    return count;
}
