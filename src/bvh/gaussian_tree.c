/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/gaussian_tree.c -- the 16-wide tree over Gaussians: Embree's builder, its nodes laid out for our
   kernels.

     Gaussians --> boxes of their proxies (proxy.c) --> binary tree, leaves of up to 16 (binary_tree.c)
         --> [widen] nodes of 16 children, depth first --> [fill_leaves] ellipsoids in SoA layout */
#include "bvh/gaussian_tree.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "bvh/binary_tree.h"
#include "bvh/device.h"
#include "bvh/proxy.h"

enum { LEAF_BLOCK = 256 };

typedef struct builder {
    RTCBVH bvh;
    proxy_boxes boxes;
    const gaussians *g;
    float alpha_min;
    binary_tree binary;
    tree_node *nodes;
    size_t node_count, node_capacity;
    tree_leaf *leaves;
    const binary_leaf **members; /* of each leaf */
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

/* The covariance k^2 R S S R^T of the proxy, 1e-4 larger for its own rounding; the kernels add what their
   tests need. */
static void set_ellipsoid(const builder *b, uint32_t id, tree_leaf *leaf, size_t slot)
{
    const gaussians *g = b->g;
    const float q[4] = {g->quat_w[id], g->quat_x[id], g->quat_y[id], g->quat_z[id]};
    const float s[3] = {g->scale_x[id], g->scale_y[id], g->scale_z[id]};
    const float square = 1.0001f * (2 * logf(g->opacity[id] / b->alpha_min));
    static const int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {2, 0}, {0, 1}};
    float m[9];
    quat_to_matrix(q, m);
    for (int row = 0; row < 3; row++)
        for (int axis = 0; axis < 3; axis++)
            m[3 * row + axis] *= s[axis];
    for (int k = 0; k < 6; k++) {
        const float *x = m + 3 * pair[k][0], *y = m + 3 * pair[k][1];
        leaf->covariance[k][slot] = square * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
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
        const binary_leaf *members = b->members[at];
        b->leaves[at].count = members->count;
        for (size_t i = 0; i < TREE_WIDTH; i++)
            set_ellipsoid(b, members->id[i < members->count ? i : 0], &b->leaves[at], i);
    }
}

/* ---- binary nodes --> nodes of 16 ---- */

static uint64_t place_leaf(builder *b, uint64_t child)
{
    b->members[b->filled_count] = binary_leaf_of(child);
    return (uint64_t)(uintptr_t)&b->leaves[b->filled_count++] + 1;
}

/* The wide node in place of a binary one. Depth first, so that neighbours lie side by side. */
static tree_node *widen(builder *b, const binary_node *root)
{
    struct RTCBounds bounds[TREE_WIDTH];
    uint64_t child[TREE_WIDTH];
    const int count = binary_node_open(root, TREE_WIDTH, bounds, child);
    tree_node *node = &b->nodes[b->node_count++];
    node_clear(node);
    for (int i = 0; i < count; i++) {
        node->lower_x[i] = bounds[i].lower_x;
        node->upper_x[i] = bounds[i].upper_x;
        node->lower_y[i] = bounds[i].lower_y;
        node->upper_y[i] = bounds[i].upper_y;
        node->lower_z[i] = bounds[i].lower_z;
        node->upper_z[i] = bounds[i].upper_z;
        node->child[i] = binary_leaf_of(child[i]) != NULL
                             ? place_leaf(b, child[i])
                             : (uint64_t)(uintptr_t)widen(b, (const binary_node *)(uintptr_t)child[i]);
    }
    return node;
}

/* Few Gaussians make one leaf and no node: puts a node above it, in which nothing is culled. */
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
    const gbt_status status = binary_tree_build(&b->binary, b->bvh, b->boxes.box, b->boxes.count,
                                                b->boxes.capacity, TREE_WIDTH, "bvh", err);
    if (status == GBT_ERR_NO_MEMORY)
        return base_fail(err, status, "bvh: no memory for a tree over %zu Gaussians", b->boxes.count);
    GBT_TRY(status);
    const size_t leaf_count = b->binary.leaf_count;
    b->node_count = 0;
    GBT_TRY(mem_reserve((void **)&b->nodes, &b->node_capacity, 0, b->binary.node_count + 1, sizeof *b->nodes,
                        "bvh nodes", err));
    GBT_TRY(mem_reserve((void **)&b->leaves, &b->leaf_capacity, 0, leaf_count, sizeof *b->leaves,
                        "bvh leaves", err));
    GBT_TRY(mem_reserve((void **)&b->members, &b->member_capacity, 0, leaf_count, sizeof *b->members,
                        "bvh leaves", err));
    b->filled_count = 0;
    if (b->binary.node_count > 0)
        widen(b, (const binary_node *)(uintptr_t)b->binary.root);
    else
        single_node(b, b->binary.root);
    parallel_blocks(leaf_count, LEAF_BLOCK, fill_leaves, b);
    return GBT_OK;
}

gbt_status gaussian_tree_build(const gaussians *g, float alpha_min, float reach, gaussian_tree *tree,
                               gbt_error *err)
{
    tree->root = NULL;
    tree->leaves = NULL;
    tree->box_count = tree->rejected_count = tree->node_count = tree->leaf_count = tree->bytes = 0;
    tree->coordinate_max = 0;
    if (g->count == 0)
        return GBT_OK;
    void *device = bvh_device(err);
    if (device == NULL)
        return bvh_check("bvh", err);
    if (tree->internal == NULL) {
        tree->internal = mem_calloc(1, sizeof(builder), "bvh builder", err);
        if (tree->internal == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    builder *b = tree->internal;
    GBT_TRY(proxy_boxes_make(g, alpha_min, reach, &b->boxes, err));
    tree->box_count = b->boxes.count;
    tree->rejected_count = b->boxes.rejected_count;
    tree->coordinate_max = b->boxes.coordinate_max;
    b->g = g;
    b->alpha_min = alpha_min;
    if (tree->box_count == 0)
        return GBT_OK;
    GBT_TRY(run_builder(b, device, err));
    tree->root = b->nodes;
    tree->leaves = b->leaves;
    tree->node_count = b->node_count;
    tree->leaf_count = b->binary.leaf_count;
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
