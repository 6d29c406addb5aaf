/* bvh/gaussian_tree.c -- ellipsoid proxies, and Embree's builder over them. */
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

/* Embree drops boxes beyond 1.844e18; squares of coordinates must stay finite in float32 as well. */
static const float coordinate_limit = 1e17f;
enum { BLOCK = 4096 };

typedef struct builder {
    tree_node single;
    RTCBVH bvh;
    struct RTCBuildPrimitive *primitives;
    size_t capacity;
} builder;

typedef struct box_job {
    const gaussians *g;
    builder *b;
    float alpha_min;
    uint32_t *block_kept;
    float *block_max;
    uint32_t *block_rejected;
    int writing;
    float pad;
} box_job;

/* Tight half extents of the proxy: k * sqrt(sum_i (R_ji s_i)^2). False when the Gaussian cannot be seen. */
static bool proxy_box(const gaussians *g, size_t i, float alpha_min, float center[3], float half[3], bool *rejected)
{
    *rejected = false;
    const float opacity = g->opacity[i];
    const float q[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]};
    const float s[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    center[0] = g->mean_x[i], center[1] = g->mean_y[i], center[2] = g->mean_z[i];
    if (opacity <= alpha_min)
        return false;
    const float k = sqrtf(2 * logf(opacity / alpha_min));
    float m[9];
    quat_to_matrix(q, m);
    bool fine = isfinite(opacity) && s[0] > 0 && s[1] > 0 && s[2] > 0 && isfinite(g->red[i]) && isfinite(g->green[i]) && isfinite(g->blue[i]);
    for (int j = 0; j < 3; j++) {
        const float a = m[3 * j] * s[0], b = m[3 * j + 1] * s[1], c = m[3 * j + 2] * s[2];
        half[j] = k * sqrtf(a * a + b * b + c * c);
        fine = fine && fabsf(center[j]) + half[j] < coordinate_limit; /* false for NaN too */
    }
    *rejected = !fine;
    return fine;
}

static void box_block(size_t block, size_t begin, size_t end, void *context)
{
    box_job *job = context;
    uint32_t kept = 0, rejected_count = 0;
    float largest = 0;
    struct RTCBuildPrimitive *out = job->writing ? job->b->primitives + job->block_kept[block] : NULL;
    for (size_t i = begin; i < end; i++) {
        float center[3], half[3];
        bool rejected;
        if (!proxy_box(job->g, i, job->alpha_min, center, half, &rejected)) {
            rejected_count += rejected;
            continue;
        }
        if (!job->writing) {
            for (int j = 0; j < 3; j++)
                largest = fmaxf(largest, fabsf(center[j]) + half[j]);
            kept++;
            continue;
        }
        /* 1e-5 of the half extent covers the rounding of k and of the rotation; the pad covers that of the coordinates. */
        struct RTCBuildPrimitive *p = &out[kept++];
        p->lower_x = center[0] - half[0] * 1.00001f - job->pad, p->upper_x = center[0] + half[0] * 1.00001f + job->pad;
        p->lower_y = center[1] - half[1] * 1.00001f - job->pad, p->upper_y = center[1] + half[1] * 1.00001f + job->pad;
        p->lower_z = center[2] - half[2] * 1.00001f - job->pad, p->upper_z = center[2] + half[2] * 1.00001f + job->pad;
        p->geomID = 0;
        p->primID = (unsigned)i;
    }
    if (!job->writing) {
        job->block_kept[block] = kept;
        job->block_max[block] = largest;
        job->block_rejected[block] = rejected_count;
    }
}

static void node_clear(tree_node *node)
{
    for (int i = 0; i < TREE_WIDTH; i++) {
        node->lower_x[i] = node->lower_y[i] = node->lower_z[i] = 1e30f;
        node->upper_x[i] = node->upper_y[i] = node->upper_z[i] = -1e30f;
        node->child[i] = 0;
    }
}

/* ---- Embree's callbacks: a leaf is one Gaussian, returned as a tagged integer in place of a pointer ---- */

static void *create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void *user)
{
    (void)child_count;
    atomic_fetch_add_explicit((atomic_size_t *)user, 1, memory_order_relaxed);
    tree_node *node = rtcThreadLocalAlloc(allocator, sizeof *node, 64);
    node_clear(node);
    return node;
}

static void set_children(void *pointer, void **children, unsigned child_count, void *user)
{
    (void)user;
    tree_node *node = pointer;
    for (unsigned i = 0; i < child_count; i++)
        node->child[i] = (uint64_t)(uintptr_t)children[i];
}

static void set_bounds(void *pointer, const struct RTCBounds **bounds, unsigned child_count, void *user)
{
    (void)user;
    tree_node *node = pointer;
    for (unsigned i = 0; i < child_count; i++) {
        node->lower_x[i] = bounds[i]->lower_x, node->upper_x[i] = bounds[i]->upper_x;
        node->lower_y[i] = bounds[i]->lower_y, node->upper_y[i] = bounds[i]->upper_y;
        node->lower_z[i] = bounds[i]->lower_z, node->upper_z[i] = bounds[i]->upper_z;
    }
}

static void *create_leaf(RTCThreadLocalAllocator allocator, const struct RTCBuildPrimitive *primitives, size_t count, void *user)
{
    (void)allocator, (void)count, (void)user; /* count is 1: maxLeafSize says so */
    return (void *)(uintptr_t)((uint64_t)primitives[0].primID << 1 | 1);
}

static gbt_status run_builder(builder *b, size_t box_count, void *device, gaussian_tree *tree, gbt_error *err)
{
    if (b->bvh == NULL)
        b->bvh = rtcNewBVH(device);
    atomic_size_t nodes = 0;
    struct RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.byteSize = sizeof arguments;
    arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM; /* deterministic, unlike HIGH */
    arguments.maxBranchingFactor = TREE_WIDTH;
    arguments.maxDepth = 48;
    arguments.sahBlockSize = 1;
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = 1;
    arguments.traversalCost = 1;
    arguments.intersectionCost = 1;
    arguments.bvh = b->bvh;
    arguments.primitives = b->primitives;
    arguments.primitiveCount = box_count;
    arguments.primitiveArrayCapacity = b->capacity;
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.userPtr = &nodes;
    void *root = rtcBuildBVH(&arguments);
    if (root == NULL)
        return base_fail(err, GBT_ERR_INTERNAL, "bvh: Embree could not build a tree over %zu Gaussians (error %d)", box_count,
                         (int)rtcGetDeviceError(device));
    tree->root = root;
    tree->node_count = nodes;
    tree->bytes = tree->node_count * sizeof(tree_node);
    return GBT_OK;
}

/* A single Gaussian makes Embree return a bare leaf, so its node is ours. */
static void single_node(builder *b, gaussian_tree *tree)
{
    tree_node *node = &b->single;
    const struct RTCBuildPrimitive *p = &b->primitives[0];
    node_clear(node);
    node->lower_x[0] = p->lower_x, node->upper_x[0] = p->upper_x;
    node->lower_y[0] = p->lower_y, node->upper_y[0] = p->upper_y;
    node->lower_z[0] = p->lower_z, node->upper_z[0] = p->upper_z;
    node->child[0] = (uint64_t)p->primID << 1 | 1;
    tree->root = node;
    tree->node_count = 1;
    tree->bytes = sizeof *node;
}

gbt_status gaussian_tree_build(const gaussians *g, float alpha_min, float reach, gaussian_tree *tree, gbt_error *err)
{
    tree->root = NULL;
    tree->box_count = tree->rejected_count = tree->node_count = tree->bytes = 0;
    tree->coordinate_max = 0;
    if (g->count == 0)
        return GBT_OK;
    if (g->count > UINT32_MAX / 2)
        return base_fail(err, GBT_ERR_NO_MEMORY, "bvh: %zu Gaussians (limit 2^31)", g->count);
    void *device = bvh_device(err);
    if (device == NULL)
        return GBT_ERR_INTERNAL;
    if (tree->internal == NULL) {
        tree->internal = mem_calloc(1, sizeof(builder), "bvh builder", err);
        if (tree->internal == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    builder *b = tree->internal;
    const size_t blocks = parallel_block_count(g->count, BLOCK);
    uint32_t *scratch = mem_alloc(blocks, 3 * sizeof *scratch, "bvh blocks", err);
    if (scratch == NULL)
        return GBT_ERR_NO_MEMORY;
    box_job job = {.g = g, .b = b, .alpha_min = alpha_min, .block_kept = scratch, .block_rejected = scratch + blocks, .block_max = (float *)(scratch + 2 * blocks)};
    parallel_blocks(g->count, BLOCK, box_block, &job);
    for (size_t i = 0; i < blocks; i++) {
        const uint32_t kept = job.block_kept[i];
        job.block_kept[i] = (uint32_t)tree->box_count;
        tree->box_count += kept;
        tree->rejected_count += job.block_rejected[i];
        tree->coordinate_max = fmaxf(tree->coordinate_max, job.block_max[i]);
    }
    gbt_status status = GBT_OK;
    if (tree->box_count == 0)
        goto done;
    status = mem_reserve((void **)&b->primitives, &b->capacity, 0, tree->box_count + tree->box_count / 4 + 2, sizeof *b->primitives, "bvh boxes", err);
    if (status != GBT_OK)
        goto done;
    job.pad = bvh_box_pad(fmaxf(tree->coordinate_max, reach));
    job.writing = 1;
    parallel_blocks(g->count, BLOCK, box_block, &job);
    if (tree->box_count == 1)
        single_node(b, tree);
    else
        status = run_builder(b, tree->box_count, device, tree, err);
done:
    mem_free(scratch);
    return status;
}

void gaussian_tree_free(gaussian_tree *tree)
{
    builder *b = tree->internal;
    if (b != NULL) {
        if (b->bvh != NULL)
            rtcReleaseBVH(b->bvh);
        mem_free(b->primitives);
        mem_free(b);
    }
    memset(tree, 0, sizeof *tree);
}
