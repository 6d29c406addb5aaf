/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_list.c -- queries whose answer is a list: balls within, containing, overlapping, crossed.

   One walk with a stack: nodes whose boxes (grown by the largest radius in them) may hold an answer are
   pushed, the balls of leaves are tested eight at a time; then the answers are sorted by index. */
#include <string.h>

#include "base/clones.h"
#include "base/fail.h"
#include "base/memory.h"
#include "bvh/point_tree.h"

void point_list_free(point_list *list)
{
    mem_free(list->item);
    mem_free(list->value);
    *list = (point_list){0};
}

/* ---- what is asked ---- */

gbt_status point_query_check(const point_query *q, gbt_error *err)
{
    if (q->what != POINTS_CROSSED) {
        if (!usable3(q->a))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "points: bad query (wanted coordinates from -1e100 to 1e100, got %g %g %g)",
                             q->a[0], q->a[1], q->a[2]);
        if (q->what != POINTS_CONTAINING && !(q->radius >= 0))
            return base_fail(err, GBT_ERR_ARGUMENT, "points: bad search radius (wanted >= 0, got %g)",
                             q->radius);
        return GBT_OK;
    }
    const double most = fmax(fabs(q->b[0]), fmax(fabs(q->b[1]), fabs(q->b[2])));
    if (!usable3(q->a) || !usable3(q->b) || !(most >= 1 / POINT_LIMIT) || isnan(q->t_min) || isnan(q->t_max))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "points: bad ray (wanted coordinates from -1e100 to 1e100, a direction with a "
                         "component from 1e-100 to 1e100, no NaN; got origin %g %g %g, direction %g %g %g, "
                         "from %g to %g)",
                         q->a[0], q->a[1], q->a[2], q->b[0], q->b[1], q->b[2], q->t_min, q->t_max);
    return GBT_OK;
}

/* Squared distance of (x, y, z) to the segment: at t = (m . dir) / (dir . dir), m = c - origin, clamped to
   [t_min, t_max]. */
static inline __attribute__((always_inline)) double segment_distance(const point_query *q, double x, double y,
                                                                     double z, double *where)
{
    const double *d = q->b;
    const double mx = x - q->a[0], my = y - q->a[1], mz = z - q->a[2];
    double t = (mx * d[0] + my * d[1] + mz * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    t = t > q->t_min ? t : q->t_min;
    t = t < q->t_max ? t : q->t_max;
    const double ex = mx - t * d[0], ey = my - t * d[1], ez = mz - t * d[2];
    *where = t;
    return ex * ex + ey * ey + ez * ez;
}

/* ---- the walk ---- */

typedef struct search {
    const point_tree *tree;
    const point_query *query;
    double radius; /* added to that of every ball */
    bool balls;    /* the radii of the balls count */
    double pad;    /* added to boxes that are tested against rays */
    double inverse[3];
    point_list *out;
} search;

/* Children of a node that may hold an answer (node_touches) and points of a leaf that are one: out > 0. */
static inline __attribute__((always_inline)) void node_touches(const search *s, const point_node *node,
                                                               double out[POINT_WIDTH])
{
    double d2[POINT_WIDTH];
    boxes_distance(node, s->query->a, d2);
    if (s->balls)
        for (int i = 0; i < POINT_WIDTH; i++) {
            const double reach = s->radius + (double)node->radius[i];
            out[i] = d2[i] <= reach * reach ? 1 : 0;
        }
    else
        for (int i = 0; i < POINT_WIDTH; i++)
            out[i] = d2[i] <= s->radius * s->radius ? 1 : 0;
}

static inline __attribute__((always_inline)) void leaf_answers(const search *s, uint32_t place, size_t size,
                                                               double out[POINT_WIDTH],
                                                               double d2[POINT_WIDTH])
{
    points_distance(s->tree, place, size, s->query->a, d2);
    if (s->balls)
        for (int i = 0; i < POINT_WIDTH; i++) {
            const double reach = s->radius + s->tree->radius[place + (size_t)i];
            out[i] = d2[i] <= reach * reach ? 1 : 0;
        }
    else
        for (int i = 0; i < POINT_WIDTH; i++)
            out[i] = d2[i] <= s->radius * s->radius ? 1 : 0;
}

/* Tests the boxes of centres, grown by the largest radius and the pad, against the segment, by slabs. */
static inline __attribute__((always_inline)) void node_crossed(const search *s, const point_node *node,
                                                               double out[POINT_WIDTH])
{
    const point_query *q = s->query;
    double from[POINT_WIDTH], to[POINT_WIDTH];
    for (int i = 0; i < POINT_WIDTH; i++) {
        from[i] = q->t_min;
        to[i] = q->t_max;
    }
    for (int j = 0; j < 3; j++) {
        const double origin = q->a[j], inverse = s->inverse[j];
        if (q->b[j] == 0) {
            for (int i = 0; i < POINT_WIDTH; i++) {
                const double grow = s->pad + (double)node->radius[i];
                const bool inside = node->lower[j][i] - grow <= origin && origin <= node->upper[j][i] + grow;
                to[i] = inside ? to[i] : -HUGE_VAL;
                from[i] = inside ? from[i] : HUGE_VAL;
            }
            continue;
        }
        for (int i = 0; i < POINT_WIDTH; i++) {
            const double grow = s->pad + (double)node->radius[i];
            const double a = (node->lower[j][i] - grow - origin) * inverse,
                         b = (node->upper[j][i] + grow - origin) * inverse;
            const double low = a < b ? a : b, high = a < b ? b : a;
            from[i] = low > from[i] ? low : from[i];
            to[i] = high < to[i] ? high : to[i];
        }
    }
    for (int i = 0; i < POINT_WIDTH; i++)
        out[i] = from[i] <= to[i] ? 1 : 0;
}

static inline __attribute__((always_inline)) void leaf_crossed(const search *s, uint32_t place, size_t size,
                                                               double out[POINT_WIDTH], double t[POINT_WIDTH])
{
    const double *x = s->tree->coordinate + 3 * (size_t)place, *y = x + size, *z = y + size;
    double d2[POINT_WIDTH];
    for (int i = 0; i < POINT_WIDTH; i++)
        d2[i] = segment_distance(s->query, x[i], y[i], z[i], &t[i]);
    if (s->tree->radius == NULL)
        for (int i = 0; i < POINT_WIDTH; i++)
            out[i] = d2[i] <= 0 ? 1 : 0;
    else
        for (int i = 0; i < POINT_WIDTH; i++) {
            const double reach = s->tree->radius[place + (size_t)i];
            out[i] = d2[i] <= reach * reach ? 1 : 0;
        }
}

static gbt_status make_room(point_list *list, gbt_error *err)
{
    const size_t wanted = list->count + POINT_WIDTH;
    GBT_TRY(mem_reserve((void **)&list->item, &list->capacity, list->count, wanted, sizeof *list->item,
                        "points.list", err));
    return mem_reserve((void **)&list->value, &list->value_capacity, list->count, wanted, sizeof *list->value,
                       "points.list", err);
}

static inline __attribute__((always_inline)) gbt_status walk(const search *s, bool ray, gbt_error *err)
{
    const point_tree *tree = s->tree;
    point_list *list = s->out;
    double yes[POINT_WIDTH], value[POINT_WIDTH];
    struct {
        uint32_t child, size;
    } stack[POINT_STACK];
    size_t top = 1;
    stack[0].child = stack[0].size = 0;
    while (top > 0) {
        top--;
        const uint32_t child = stack[top].child, size = stack[top].size;
        if (size == 0) {
            const point_node *node = &tree->nodes[child];
            if (ray)
                node_crossed(s, node, yes);
            else
                node_touches(s, node, yes);
            for (int i = node->child_count; i-- > 0;)
                if (yes[i] > 0) {
                    stack[top].child = node->child[i];
                    stack[top++].size = node->size[i];
                }
            continue;
        }
        if (list->count + POINT_WIDTH > list->capacity || list->count + POINT_WIDTH > list->value_capacity) {
            const gbt_status status = make_room(list, err);
            if (status != GBT_OK)
                return status;
        }
        if (ray)
            leaf_crossed(s, child, size, yes, value);
        else
            leaf_answers(s, child, size, yes, value);
        for (uint32_t i = 0; i < size; i++) {
            list->item[list->count] = (uint64_t)tree->index[child + i] << 32 | (uint32_t)list->count;
            list->value[list->count] = value[i];
            list->count += yes[i] > 0;
        }
    }
    return GBT_OK;
}

FASTEST_CLONE static gbt_status walk_around(const search *s, gbt_error *err) { return walk(s, false, err); }
FASTEST_CLONE static gbt_status walk_along(const search *s, gbt_error *err) { return walk(s, true, err); }

/* ---- by index ---- */

void point_sort(uint64_t *item, uint64_t *spare, size_t count, int bits)
{
    if (count <= 48) {
        for (size_t i = 1; i < count; i++) {
            const uint64_t moved = item[i];
            size_t at = i;
            for (; at > 0 && item[at - 1] >> 32 > moved >> 32; at--)
                item[at] = item[at - 1];
            item[at] = moved;
        }
        return;
    }
    uint64_t *from = item, *to = spare;
    for (int shift = 32; shift < 32 + bits; shift += 8) {
        size_t first[257] = {0};
        for (size_t i = 0; i < count; i++)
            first[(from[i] >> shift & 255) + 1]++;
        for (int d = 0; d < 256; d++)
            first[d + 1] += first[d];
        for (size_t i = 0; i < count; i++)
            to[first[from[i] >> shift & 255]++] = from[i];
        uint64_t *other = from;
        from = to;
        to = other;
    }
    if (from != item)
        memcpy(item, from, count * sizeof *item);
}

static int bits_of(size_t count)
{
    int bits = 0;
    while (bits < 32 && count >> bits != 0)
        bits++;
    return bits;
}

static gbt_status sort_list(const point_tree *tree, point_list *list, gbt_error *err)
{
    GBT_TRY(mem_reserve((void **)&list->item, &list->capacity, list->count, 2 * list->count,
                        sizeof *list->item, "points.list", err));
    point_sort(list->item, list->item + list->count, list->count, bits_of(tree->count));
    return GBT_OK;
}

gbt_status point_tree_list(const point_tree *tree, const point_query *query, point_list *out, gbt_error *err)
{
    out->count = 0;
    GBT_TRY(point_query_check(query, err));
    const bool ray = query->what == POINTS_CROSSED;
    if (tree->count == 0 ||
        (ray && (query->t_min > query->t_max || query->t_min == HUGE_VAL || query->t_max == -HUGE_VAL)))
        return GBT_OK;
    search s = {.tree = tree,
                .query = query,
                .radius = query->what == POINTS_CONTAINING ? 0 : query->radius,
                .balls = tree->radius != NULL && query->what != POINTS_WITHIN,
                .out = out};
    double far = tree->reach;
    for (int j = 0; j < 3; j++) {
        s.inverse[j] = 1 / query->b[j];
        far = fmax(far, fabs(query->a[j]));
    }
    /* The slab test and the distance to the segment can lose about 2^-48 of the largest coordinate. */
    s.pad = 0x1p-44 * far;
    gbt_status status = ray ? walk_along(&s, err) : walk_around(&s, err);
    if (status == GBT_OK && out->count > 1)
        status = sort_list(tree, out, err);
    if (status != GBT_OK)
        out->count = 0;
    return status;
}
