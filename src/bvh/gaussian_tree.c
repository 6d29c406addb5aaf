/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/gaussian_tree.c -- Embree's builder over the boxes of Gaussians, its nodes laid out for our kernels. */
#include "bvh/gaussian_tree.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "bvh/device.h"
#include "bvh/embree_api.h"
#include "bvh/proxy.h"

enum { LEAF_BLOCK = 256 };

/* What Embree builds: binary, because its wider builders make as many children as they can and leave leaves
   almost empty. */
typedef struct binary_node {
    struct RTCBounds bounds[2];
    uint64_t child[2]; /* address of a binary_node, or that of leaf_members + 1 */
} binary_node;

typedef struct leaf_members {
    uint32_t count, id[TREE_WIDTH];
} leaf_members;

typedef struct builder {
    RTCBVH bvh;
    proxy_boxes boxes;
    const gaussians *g;
    float alpha_min, radius;
    atomic_size_t binary_count, leaf_count;
    atomic_bool refused; /* an allocation of Embree's was refused: the tree has holes */
    tree_node *nodes;
    size_t node_count, node_capacity;
    tree_leaf *leaves;
    const leaf_members **members; /* of each leaf */
    size_t filled_count, leaf_capacity, member_capacity;
} builder;

static void node_clear(tree_node *node)
{
    for (int i = 0; i < TREE_WIDTH; i++) {
        node->lower_x[i] = node->lower_y[i] = node->lower_z[i] = 1e30f;
        node->upper_x[i] = node->upper_y[i] = node->upper_z[i] = -1e30f;
        node->child[i] = 0;
    }
}

/* A little more than k^2 R S S R^T: the kernels' test adds what rounding needs beyond that. */
static void set_ellipsoid(const builder *b, uint32_t id, tree_leaf *leaf, size_t slot)
{
    const gaussians *g = b->g;
    const float q[4] = {g->quat_w[id], g->quat_x[id], g->quat_y[id], g->quat_z[id]};
    const float s[3] = {g->scale_x[id], g->scale_y[id], g->scale_z[id]};
    const float square = 1.0001f * fminf(2 * logf(g->opacity[id] / b->alpha_min), b->radius * b->radius);
    static const int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {2, 0}, {0, 1}};
    float m[9];
    quat_to_matrix(q, m);
    for (int row = 0; row < 3; row++)
        for (int axis = 0; axis < 3; axis++)
            m[3 * row + axis] *= s[axis];
    for (int k = 0; k < 6; k++) {
        const float *x = m + 3 * pair[k][0], *y = m + 3 * pair[k][1];
        leaf->spread[k][slot] = square * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
    }
    leaf->mean[0][slot] = g->mean_x[id];
    leaf->mean[1][slot] = g->mean_y[id];
    leaf->mean[2][slot] = g->mean_z[id];
    leaf->id[slot] = id;
}

static void fill_leaves(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const builder *b = context;
    for (size_t at = begin; at < end; at++) {
        const leaf_members *members = b->members[at];
        b->leaves[at].count = members->count;
        for (size_t i = 0; i < TREE_WIDTH; i++)
            set_ellipsoid(b, members->id[i < members->count ? i : 0], &b->leaves[at], i);
    }
}

/* ---- Embree's callbacks; a leaf is a tagged address in place of a pointer ---- */

static void *create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void *user)
{
    (void)child_count;
    builder *b = user;
    embree_receive(b);
    atomic_fetch_add_explicit(&b->binary_count, 1, memory_order_relaxed);
    binary_node *node = rtcThreadLocalAlloc(allocator, sizeof(binary_node), 16);
    if (node == NULL) /* the memory limit (bvh_limit_memory) */
        atomic_store_explicit(&b->refused, true, memory_order_relaxed);
    embree_publish(b);
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
    builder *b = user;
    embree_receive(b);
    atomic_fetch_add_explicit(&b->leaf_count, 1, memory_order_relaxed);
    leaf_members *leaf = rtcThreadLocalAlloc(allocator, sizeof *leaf, 16);
    if (leaf == NULL) {
        atomic_store_explicit(&b->refused, true, memory_order_relaxed);
        embree_publish(b);
        return NULL;
    }
    leaf->count = (uint32_t)count;
    for (size_t i = 0; i < count; i++)
        leaf->id[i] = primitives[i].primID;
    embree_publish(b);
    return (char *)leaf + 1;
}

/* ---- binary nodes --> nodes of 16 ---- */

static float half_area(const struct RTCBounds *b)
{
    const float x = b->upper_x - b->lower_x, y = b->upper_y - b->lower_y, z = b->upper_z - b->lower_z;
    return x * y + y * z + z * x;
}

static uint64_t place_leaf(builder *b, uint64_t child)
{
    b->members[b->filled_count] = (const leaf_members *)(uintptr_t)(child - 1);
    return (uint64_t)(uintptr_t)&b->leaves[b->filled_count++] + 1;
}

/* The wide node for a binary one: its largest child is opened until there are 16. Depth first, so that
   neighbours lie side by side. */
static tree_node *widen(builder *b, const binary_node *root)
{
    struct RTCBounds bounds[TREE_WIDTH];
    uint64_t child[TREE_WIDTH];
    int count = 2;
    memcpy(bounds, root->bounds, 2 * sizeof *bounds);
    memcpy(child, root->child, 2 * sizeof *child);
    while (count < TREE_WIDTH) {
        int largest = -1;
        float area = -1;
        for (int i = 0; i < count; i++)
            if ((child[i] & 1) == 0 && half_area(&bounds[i]) > area) {
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
    tree_node *node = &b->nodes[b->node_count++];
    node_clear(node);
    for (int i = 0; i < count; i++) {
        node->lower_x[i] = bounds[i].lower_x;
        node->upper_x[i] = bounds[i].upper_x;
        node->lower_y[i] = bounds[i].lower_y;
        node->upper_y[i] = bounds[i].upper_y;
        node->lower_z[i] = bounds[i].lower_z;
        node->upper_z[i] = bounds[i].upper_z;
        node->child[i] = (child[i] & 1) != 0
                             ? place_leaf(b, child[i])
                             : (uint64_t)(uintptr_t)widen(b, (const binary_node *)(uintptr_t)child[i]);
    }
    return node;
}

/* Few Gaussians make one leaf, and the node above it is ours. Nothing is culled there. */
static void single_node(builder *b, uint64_t leaf)
{
    tree_node *node = &b->nodes[b->node_count++];
    node_clear(node);
    node->lower_x[0] = node->lower_y[0] = node->lower_z[0] = -1e30f;
    node->upper_x[0] = node->upper_y[0] = node->upper_z[0] = 1e30f;
    node->child[0] = place_leaf(b, leaf);
}

static gbt_status run_builder(builder *b, void *device, gbt_error *err)
{
    if (b->bvh == NULL)
        b->bvh = rtcNewBVH(device);
    struct RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.byteSize = sizeof arguments;
    arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM; /* deterministic, unlike HIGH */
    arguments.maxBranchingFactor = 2;
    arguments.maxDepth = 48;
    arguments.sahBlockSize = TREE_WIDTH; /* a leaf costs the same, whether it holds 1 or 16 */
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = TREE_WIDTH;
    arguments.traversalCost = 1;
    arguments.intersectionCost = 1;
    arguments.bvh = b->bvh;
    arguments.primitives = b->boxes.box;
    arguments.primitiveCount = b->boxes.count;
    arguments.primitiveArrayCapacity = b->boxes.capacity;
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.userPtr = b;
    atomic_store(&b->binary_count, 0);
    atomic_store(&b->leaf_count, 0);
    atomic_store(&b->refused, false);
    embree_publish(b);
    void *root = rtcBuildBVH(&arguments);
    embree_receive(b);
    const gbt_status complaint = bvh_check("tree", err);
    if (b->refused || complaint != GBT_OK)
        return base_fail(err, GBT_ERR_NO_MEMORY, "bvh: no memory for a tree over %zu Gaussians",
                         b->boxes.count);
    if (root == NULL)
        return base_fail(err, GBT_ERR_INTERNAL,
                         "bvh: Embree could not build a tree over %zu Gaussians (error %d)", b->boxes.count,
                         (int)rtcGetDeviceError(device));
    b->node_count = 0;
    GBT_TRY(mem_reserve((void **)&b->nodes, &b->node_capacity, 0, b->binary_count + 1, sizeof *b->nodes,
                        "bvh nodes", err));
    GBT_TRY(mem_reserve((void **)&b->leaves, &b->leaf_capacity, 0, b->leaf_count, sizeof *b->leaves,
                        "bvh leaves", err));
    GBT_TRY(mem_reserve((void **)&b->members, &b->member_capacity, 0, b->leaf_count, sizeof *b->members,
                        "bvh leaves", err));
    b->filled_count = 0;
    if (b->binary_count > 0)
        widen(b, root);
    else
        single_node(b, (uint64_t)(uintptr_t)root);
    parallel_blocks(b->leaf_count, LEAF_BLOCK, fill_leaves, b);
    return GBT_OK;
}

gbt_status gaussian_tree_build(const gaussians *g, float alpha_min, float radius, float reach,
                               gaussian_tree *tree, gbt_error *err)
{
    tree->root = NULL;
    tree->leaves = NULL;
    tree->box_count = tree->rejected_count = tree->node_count = tree->leaf_count = tree->bytes = 0;
    tree->coordinate_max = 0;
    if (g->count == 0)
        return GBT_OK;
    void *device = bvh_device(err);
    if (device == NULL)
        return GBT_ERR_INTERNAL;
    if (tree->internal == NULL) {
        tree->internal = mem_calloc(1, sizeof(builder), "bvh builder", err);
        if (tree->internal == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    builder *b = tree->internal;
    GBT_TRY(proxy_boxes_make(g, alpha_min, radius, reach, &b->boxes, err));
    tree->box_count = b->boxes.count;
    tree->rejected_count = b->boxes.rejected_count;
    tree->coordinate_max = b->boxes.coordinate_max;
    b->g = g;
    b->alpha_min = alpha_min;
    b->radius = radius;
    if (tree->box_count == 0)
        return GBT_OK;
    GBT_TRY(run_builder(b, device, err));
    tree->root = b->nodes;
    tree->leaves = b->leaves;
    tree->node_count = b->node_count;
    tree->leaf_count = b->leaf_count;
    tree->bytes = tree->node_count * sizeof(tree_node) + tree->leaf_count * sizeof(tree_leaf);
    return GBT_OK;
}

void gaussian_tree_free(gaussian_tree *tree)
{
    builder *b = tree->internal;
    if (b != NULL) {
        if (b->bvh != NULL)
            rtcReleaseBVH(b->bvh);
        proxy_boxes_free(&b->boxes);
        mem_free(b->nodes);
        mem_free(b->leaves);
        mem_free(b->members);
        mem_free(b);
    }
    memset(tree, 0, sizeof *tree);
}
