/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/point_tree.c -- builds the 8-wide tree over balls (point_tree.h has the data flow).

     positions --> frame in which float32 keeps their digits --> boxes --> binary tree (binary_tree.c)
         --> [widen] nodes of 8 children, depth first --> [fill_leaves] points in the order of the leaves
         --> [fill_nodes] boxes, radii and least indices in double, from the last node to the root */
#include "bvh/point_tree.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "bvh/binary_tree.h"
#include "bvh/device.h"

enum { CHECK_BLOCK = 65536, LEAF_BLOCK = 1024, MEDIAN_SAMPLES = 4095, CHECK_NODES = 1 << 12 };

typedef struct leaf_place {
    const binary_leaf *members;
    uint32_t first;
} leaf_place;

typedef struct builder {
    number_array position, radius;
    size_t count;
    double origin[3], scale; /* what Embree sees: (position - origin) scale, mostly within about 1 */
    struct RTCBuildPrimitive *boxes;
    atomic_size_t bad;
    binary_tree binary;
    point_tree *tree;
    leaf_place *leaves;
    size_t filled_count, filled_points, node_capacity;
    int depth;
    gbt_status status; /* of making room for nodes */
    gbt_error *err;
} builder;

/* ---- points --> boxes ---- */

static bool bad_point(const builder *b, size_t i)
{
    for (size_t j = 0; j < 3; j++)
        if (!(fabs(number_at(b->position, 3 * i + j)) <= POINT_LIMIT))
            return true;
    return !number_none(b->radius) &&
           !(number_at(b->radius, i) >= 0 && number_at(b->radius, i) <= POINT_LIMIT);
}

static void check_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    builder *b = context;
    size_t i = begin;
    while (i < end && !bad_point(b, i))
        i++;
    size_t known = atomic_load(&b->bad);
    while (i < end && i < known && !atomic_compare_exchange_weak(&b->bad, &known, i))
        ;
}

static gbt_status check_points(builder *b, gbt_error *err)
{
    if (b->count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: too many (wanted fewer than 2^32 - 1, got %zu)",
                         b->count);
    atomic_store(&b->bad, SIZE_MAX);
    parallel_blocks(b->count, CHECK_BLOCK, check_block, b);
    const size_t i = atomic_load(&b->bad);
    if (i == SIZE_MAX)
        return GBT_OK;
    for (size_t j = 0; j < 3; j++)
        if (!(fabs(number_at(b->position, 3 * i + j)) <= POINT_LIMIT))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "points: point %zu: bad coordinate (wanted -1e100 to 1e100, got %g)", i,
                             number_at(b->position, 3 * i + j));
    return base_fail(err, GBT_ERR_ARGUMENT, "points: point %zu: bad radius (wanted 0 to 1e100, got %g)", i,
                     number_at(b->radius, i));
}

/* Finds the frame of Embree's float32 boxes, such that outliers do not cost the other points their digits:
   the origin is the median, and the quartiles are at about 1, both of a sample. Answers are right whatever
   Embree sees, because the tree gets boxes in double. */
static gbt_status find_frame(builder *b, gbt_error *err)
{
    const size_t step = 1 + (b->count - 1) / MEDIAN_SAMPLES, samples = (b->count - 1) / step + 1;
    double *value = mem_alloc(samples, sizeof *value, "points.sample", err), spread = 0, far = 0;
    if (value == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t j = 0; j < 3; j++) {
        for (size_t i = 0; i < samples; i++)
            value[i] = number_at(b->position, 3 * i * step + j);
        qsort(value, samples, sizeof *value, compare_doubles);
        b->origin[j] = value[samples / 2];
        spread = fmax(spread, value[samples - 1 - samples / 4] - value[samples / 4]);
        far = fmax(far, value[samples - 1] - value[0]);
    }
    mem_free(value);
    spread = spread > 0 ? spread : far;
    int exponent = 0;
    if (spread > 0)
        frexp(spread, &exponent);
    b->scale = ldexp(1, -(exponent > -1000 ? exponent : -1000));
    return GBT_OK;
}

static float held(double x)
{
    return (float)fmax(fmin(x, (double)bvh_coordinate_limit), (double)-bvh_coordinate_limit);
}

static void box_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const builder *b = context;
    for (size_t i = begin; i < end; i++) {
        float lower[3], upper[3];
        const double radius = number_none(b->radius) ? 0 : number_at(b->radius, i);
        for (size_t j = 0; j < 3; j++) {
            const double center = number_at(b->position, 3 * i + j) - b->origin[j];
            lower[j] = held((center - radius) * b->scale);
            upper[j] = held((center + radius) * b->scale);
        }
        b->boxes[i] = (struct RTCBuildPrimitive){.lower_x = lower[0],
                                                 .lower_y = lower[1],
                                                 .lower_z = lower[2],
                                                 .upper_x = upper[0],
                                                 .upper_y = upper[1],
                                                 .upper_z = upper[2],
                                                 .primID = (unsigned)i};
    }
}

/* ---- binary nodes --> nodes of 8 ---- */

static uint32_t add_node(builder *b)
{
    point_tree *t = b->tree;
    void *nodes = t->nodes;
    if (b->status == GBT_OK)
        b->status = mem_reserve(&nodes, &b->node_capacity, t->node_count, t->node_count + 1, sizeof *t->nodes,
                                "points.nodes", b->err);
    if (b->status != GBT_OK)
        return 0;
    if (t->node_count % CHECK_NODES == 0)
        paged_check();
    t->nodes = nodes;
    memset(&t->nodes[t->node_count], 0, sizeof *t->nodes);
    return (uint32_t)t->node_count++;
}

static void place_leaf(builder *b, uint64_t child, point_node *node, int lane)
{
    const binary_leaf *members = binary_leaf_of(child);
    b->leaves[b->filled_count++] = (leaf_place){members, (uint32_t)b->filled_points};
    node->child[lane] = (uint32_t)b->filled_points;
    node->size[lane] = (uint8_t)members->count;
    b->filled_points += members->count;
}

/* The wide node in place of a binary one. Depth first, so that neighbours lie side by side. */
static uint32_t widen(builder *b, const binary_node *root, int depth)
{
    struct RTCBounds bounds[POINT_WIDTH];
    uint64_t child[POINT_WIDTH];
    const int count = binary_node_open(root, POINT_WIDTH, bounds, child);
    b->depth = depth > b->depth ? depth : b->depth;
    const uint32_t at = add_node(b);
    if (b->status != GBT_OK)
        return 0;
    b->tree->nodes[at].child_count = (uint8_t)count;
    for (int i = 0; i < count && b->status == GBT_OK; i++) {
        if (binary_leaf_of(child[i]) != NULL)
            place_leaf(b, child[i], &b->tree->nodes[at], i);
        else if (depth < POINT_DEPTH_MAX) {
            const uint32_t below = widen(b, (const binary_node *)(uintptr_t)child[i], depth + 1);
            b->tree->nodes[at].child[i] = below; /* the array may have moved */
        } else {
            b->depth = POINT_DEPTH_MAX + 1;
        }
    }
    return at;
}

static void fill_leaves(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const builder *b = context;
    point_tree *t = b->tree;
    for (size_t at = begin; at < end; at++) {
        const binary_leaf *members = b->leaves[at].members;
        const size_t first = b->leaves[at].first, count = members->count;
        for (size_t i = 0; i < count; i++) {
            const uint32_t id = members->id[i];
            t->index[first + i] = id;
            for (size_t j = 0; j < 3; j++)
                t->coordinate[3 * first + j * count + i] = number_at(b->position, 3 * (size_t)id + j);
            if (t->radius != NULL)
                t->radius[first + i] = number_at(b->radius, id);
        }
    }
}

static float round_up(double x)
{
    const float f = (float)x;
    return (double)f < x ? nextafterf(f, INFINITY) : f;
}

typedef struct lane_sum {
    double lower[3], upper[3], radius;
    uint32_t least_index;
} lane_sum;

static lane_sum sum_leaf(const point_tree *t, size_t first, size_t count)
{
    lane_sum s = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0, UINT32_MAX};
    for (size_t i = 0; i < count; i++) {
        for (size_t j = 0; j < 3; j++) {
            const double x = t->coordinate[3 * first + j * count + i];
            s.lower[j] = fmin(s.lower[j], x);
            s.upper[j] = fmax(s.upper[j], x);
        }
        if (t->radius != NULL)
            s.radius = fmax(s.radius, t->radius[first + i]);
        if (t->index[first + i] < s.least_index)
            s.least_index = t->index[first + i];
    }
    return s;
}

static lane_sum sum_node(const point_node *node)
{
    lane_sum s = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0, UINT32_MAX};
    for (int i = 0; i < node->child_count; i++) {
        for (int j = 0; j < 3; j++) {
            s.lower[j] = fmin(s.lower[j], node->lower[j][i]);
            s.upper[j] = fmax(s.upper[j], node->upper[j][i]);
        }
        s.radius = fmax(s.radius, (double)node->radius[i]);
        if (node->least_index[i] < s.least_index)
            s.least_index = node->least_index[i];
    }
    return s;
}

/* From the last node to the first, because children come after their parents. */
static void fill_nodes(point_tree *t)
{
    for (size_t at = t->node_count; at-- > 0;) {
        point_node *node = &t->nodes[at];
        if (at % CHECK_NODES == 0)
            paged_check();
        for (int i = 0; i < POINT_WIDTH; i++) {
            const int from = i < node->child_count ? i : 0;
            const lane_sum s = node->size[from] > 0 ? sum_leaf(t, node->child[from], node->size[from])
                                                    : sum_node(&t->nodes[node->child[from]]);
            for (int j = 0; j < 3; j++) {
                node->lower[j][i] = s.lower[j];
                node->upper[j][i] = s.upper[j];
            }
            node->radius[i] = round_up(s.radius);
            node->least_index[i] = s.least_index;
        }
    }
    const lane_sum all = sum_node(t->nodes);
    memcpy(t->lower, all.lower, sizeof t->lower);
    memcpy(t->upper, all.upper, sizeof t->upper);
    for (int j = 0; j < 3; j++)
        t->reach = fmax(t->reach, fmax(fabs(all.lower[j]), fabs(all.upper[j])) + all.radius);
}

/* ---- build ---- */

static gbt_status run_builder(builder *b, RTCBVH bvh, gbt_error *err)
{
    GBT_TRY(binary_tree_build(&b->binary, bvh, b->boxes, b->count, b->count, POINT_WIDTH, "points", err));
    point_tree *t = b->tree;
    b->leaves = mem_alloc(b->binary.leaf_count, sizeof *b->leaves, "points.leaves", err);
    if (b->leaves == NULL)
        return GBT_ERR_NO_MEMORY;
    b->err = err;
    if (b->binary.node_count > 0) {
        widen(b, (const binary_node *)(uintptr_t)b->binary.root, 1);
    } else { /* a single leaf: put a node above it */
        const uint32_t at = add_node(b);
        if (b->status == GBT_OK) {
            t->nodes[at].child_count = 1;
            place_leaf(b, b->binary.root, &t->nodes[at], 0);
        }
    }
    GBT_TRY(b->status);
    if (b->depth > POINT_DEPTH_MAX)
        return base_fail(err, GBT_ERR_INTERNAL, "points: Embree's tree is deeper than %d nodes",
                         (int)POINT_DEPTH_MAX);
    void *nodes = t->nodes;
    GBT_TRY(mem_trim(&nodes, &b->node_capacity, t->node_count, sizeof *t->nodes, "points.nodes", err));
    t->nodes = nodes;
    return GBT_OK;
}

static gbt_status fill(builder *b, gbt_error *err)
{
    point_tree *t = b->tree;
    /* Leaves are read 8 lanes at a time: the last one up to 7 beyond the end. */
    t->coordinate = mem_calloc(3 * b->count + POINT_WIDTH, sizeof *t->coordinate, "points.coordinate", err);
    t->index = mem_alloc(b->count, sizeof *t->index, "points.index", err);
    if (!number_none(b->radius))
        t->radius = mem_calloc(b->count + POINT_WIDTH, sizeof *t->radius, "points.radius", err);
    if (t->coordinate == NULL || t->index == NULL || (t->radius == NULL && !number_none(b->radius)))
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(b->filled_count, LEAF_BLOCK, fill_leaves, b);
    fill_nodes(t);
    return GBT_OK;
}

static gbt_status build(builder *b, gbt_error *err)
{
    GBT_TRY(find_frame(b, err));
    RTCDevice device = bvh_device(err);
    if (device == NULL)
        return bvh_check("points", err);
    b->boxes = mem_alloc(b->count, sizeof *b->boxes, "points.boxes", err);
    if (b->boxes == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(b->count, CHECK_BLOCK, box_block, b);
    RTCBVH bvh = rtcNewBVH(device);
    gbt_status status = bvh_check("points", err);
    if (status == GBT_OK)
        status = run_builder(b, bvh, err);
    mem_free(b->boxes);
    if (status == GBT_OK)
        status = fill(b, err);
    if (bvh != NULL)
        rtcReleaseBVH(bvh);
    mem_free(b->leaves);
    return status;
}

gbt_status point_tree_build(number_array position, number_array radius, size_t count, point_tree **out,
                            gbt_error *err)
{
    *out = NULL;
    builder b = {.position = position, .radius = radius, .count = count};
    GBT_TRY(check_points(&b, err));
    point_tree *tree = mem_calloc(1, sizeof *tree, "points", err);
    if (tree == NULL)
        return GBT_ERR_NO_MEMORY;
    b.tree = tree;
    tree->count = count;
    const gbt_status status = count > 0 ? build(&b, err) : GBT_OK;
    if (status != GBT_OK) {
        point_tree_free(tree);
        return status;
    }
    *out = tree;
    return GBT_OK;
}

void point_tree_free(point_tree *tree)
{
    if (tree == NULL)
        return;
    mem_free(tree->nodes);
    mem_free(tree->coordinate);
    mem_free(tree->radius);
    mem_free(tree->index);
    mem_free(tree);
}
