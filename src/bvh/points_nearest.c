/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_nearest.c -- the k nearest centres of one query.

   Depth first, with a stack of opened nodes: the children of each are visited nearest first, and those that
   are farther than the k-th best so far are skipped. Ties are decided by index. */
#include "base/clones.h"
#include "bvh/point_tree.h"

typedef struct nearest_search {
    size_t k, skip, found;
    uint32_t *index;          /* [k], ordered by (distance, index) */
    double *distance_squared; /* [k] */
    double worst;             /* squared distance of the k-th best; infinite while there are fewer */
    uint32_t worst_index;
} nearest_search;

static inline bool nearer(double d2, uint32_t index, double than_d2, uint32_t than_index)
{
    return d2 < than_d2 || (d2 == than_d2 && index < than_index);
}

static void insert(nearest_search *s, uint32_t index, double d2)
{
    size_t at = s->found < s->k ? s->found++ : s->k - 1;
    for (; at > 0 && nearer(d2, index, s->distance_squared[at - 1], s->index[at - 1]); at--) {
        s->distance_squared[at] = s->distance_squared[at - 1];
        s->index[at] = s->index[at - 1];
    }
    s->distance_squared[at] = d2;
    s->index[at] = index;
    if (s->found == s->k) {
        s->worst = s->distance_squared[s->k - 1];
        s->worst_index = s->index[s->k - 1];
    }
}

/* The children of a node that has been opened, nearest first. */
typedef struct opened {
    const point_node *node;
    size_t next;                   /* the next key */
    double d2[POINT_WIDTH];        /* of the lanes */
    uint64_t key[POINT_WIDTH + 1]; /* ascending: the bits of d2, which are in the order of the numbers, with
                                      the lane in the last three; then a sentinel above all */
} opened;

static const uint64_t LANE_BITS = POINT_WIDTH - 1;

static inline uint64_t bits_of(double x)
{
    union {
        double value;
        uint64_t bits;
    } both = {x};
    return both.bits;
}

/* The place of a key is the number of smaller ones, so that there is no branch to mispredict. */
static inline __attribute__((always_inline)) void open_node(const point_node *node, const double q[3],
                                                            opened *o)
{
    uint64_t key[POINT_WIDTH], rank[POINT_WIDTH] = {0};
    boxes_distance(node, q, o->d2);
    for (uint64_t i = 0; i < POINT_WIDTH; i++)
        key[i] = (bits_of(o->d2[i]) & ~LANE_BITS) | i;
    for (int j = 0; j < POINT_WIDTH; j++)
        for (int i = 0; i < POINT_WIDTH; i++)
            rank[i] += key[j] < key[i];
    for (int i = 0; i < POINT_WIDTH; i++)
        o->key[rank[i]] = key[i];
    o->node = node;
    o->next = 0;
    o->key[POINT_WIDTH] = UINT64_MAX;
}

FASTEST_CLONE static void walk(const point_tree *tree, const double query[3], nearest_search *s)
{
    const double q[3] = {query[0], query[1], query[2]};
    opened stack[POINT_DEPTH_MAX];
    opened *top = stack;
    open_node(tree->nodes, q, top);
    for (;;) {
        const uint64_t key = top->key[top->next];
        if ((key & ~LANE_BITS) > bits_of(s->worst)) { /* the other children of this node are farther, too */
            if (top == stack)
                return;
            top--;
            continue;
        }
        top->next++;
        const point_node *node = top->node;
        const size_t lane = key & LANE_BITS;
        if (lane >= node->child_count ||
            !nearer(top->d2[lane], node->least_index[lane], s->worst, s->worst_index))
            continue;
        const uint32_t child = node->child[lane], size = node->size[lane];
        if (size == 0) {
            open_node(&tree->nodes[child], q, ++top);
            continue;
        }
        double d2[POINT_WIDTH];
        points_distance(tree, child, size, q, d2);
        for (uint32_t i = 0; i < size; i++)
            if (d2[i] <= s->worst) {
                const uint32_t index = tree->index[child + i];
                if (nearer(d2[i], index, s->worst, s->worst_index) && index != s->skip)
                    insert(s, index, d2[i]);
            }
    }
}

size_t point_tree_nearest(const point_tree *tree, const double query[3], size_t k, size_t skip,
                          uint32_t *index, double *distance_squared)
{
    if (k == 0 || tree->count == 0 || !usable3(query))
        return 0;
    nearest_search s = {.k = k,
                        .skip = skip,
                        .index = index,
                        .distance_squared = distance_squared,
                        .worst = INFINITY,
                        .worst_index = UINT32_MAX};
    walk(tree, query, &s);
    return s.found;
}
