/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_list.c -- queries around a point whose answer is a list: balls within, containing,
   overlapping. */
#include <stdlib.h>

#include "base/fail.h"
#include "base/memory.h"
#include "bvh/point_tree.h"

void point_list_free(point_list *list)
{
    mem_free(list->index);
    *list = (point_list){0};
}

static int compare_index(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void push(list_search *s, uint32_t index)
{
    if (s->status != GBT_OK)
        return;
    s->status = mem_reserve((void **)&s->out->index, &s->out->capacity, s->out->count, s->out->count + 1,
                            sizeof *s->out->index, "points.list", s->err);
    if (s->status == GBT_OK)
        s->out->index[s->out->count++] = index;
}

void list_push_reaching(list_search *s, uint32_t site, double d2)
{
    const point_tree *tree = s->tree;
    for (uint32_t m = tree->first[site]; m < tree->first[site + 1]; m++) {
        const uint32_t index = tree->member[m];
        const double reach =
            s->radius + (s->centers || tree->radius == NULL ? 0 : (double)tree->radius[index]);
        if (d2 <= reach * reach)
            push(s, index);
    }
}

static bool visit_list(struct RTCPointQueryFunctionArguments *args)
{
    list_search *s = args->userPtr;
    list_push_reaching(s, args->primID, distance_squared_to(s->tree, args->primID, s->query));
    return false; /* the radius has not changed */
}

gbt_status list_finish(list_search *s)
{
    if (s->status != GBT_OK)
        s->out->count = 0;
    else if (s->out->count > 1)
        qsort(s->out->index, s->out->count, sizeof *s->out->index, compare_index);
    return s->status;
}

static gbt_status list_sites(const point_tree *tree, const float query[3], float radius, bool centers,
                             point_list *out, gbt_error *err)
{
    out->count = 0;
    if (!finite3(query))
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad query (wanted finite coordinates, got %g %g %g)",
                         (double)query[0], (double)query[1], (double)query[2]);
    if (!(radius >= 0))
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad search radius (wanted >= 0, got %g)",
                         (double)radius);
    list_search search = {.tree = tree,
                          .query = {(double)query[0], (double)query[1], (double)query[2]},
                          .radius = (double)radius,
                          .centers = centers,
                          .out = out,
                          .err = err};
    RTCScene scene = centers || tree->radius == NULL ? tree->centers : tree->balls;
    sites_search(tree, scene, search.query, search.radius, visit_list, &search);
    return list_finish(&search);
}

gbt_status point_tree_within(const point_tree *tree, const float query[3], float radius, point_list *out,
                             gbt_error *err)
{
    return list_sites(tree, query, radius, true, out, err);
}

gbt_status point_tree_containing(const point_tree *tree, const float query[3], point_list *out,
                                 gbt_error *err)
{
    return list_sites(tree, query, 0, false, out, err);
}

gbt_status point_tree_overlapping(const point_tree *tree, const float query[3], float radius, point_list *out,
                                  gbt_error *err)
{
    return list_sites(tree, query, radius, false, out, err);
}
