/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_nearest.c -- the nearest centres, and how far they are apart. */
#include <fenv.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "bvh/point_tree.h"

enum { MAX_NEIGHBOURS = 64, SPACING_GRAIN = 512 };

typedef struct nearest_search {
    const point_tree *tree;
    double query[3];
    size_t k, skip, found;
    uint32_t *index;          /* [k], ordered by (distance, index) */
    double *distance_squared; /* [k] */
} nearest_search;

/* False when the point is worse than all k that are known. */
static bool insert_nearest(nearest_search *s, uint32_t index, double d2)
{
    if (s->found == s->k) {
        const size_t last = s->k - 1;
        if (d2 > s->distance_squared[last] || (d2 == s->distance_squared[last] && index > s->index[last]))
            return false;
    } else {
        s->found++;
    }
    size_t at = s->found - 1;
    for (; at > 0 && (d2 < s->distance_squared[at - 1] ||
                      (d2 == s->distance_squared[at - 1] && index < s->index[at - 1]));
         at--) {
        s->distance_squared[at] = s->distance_squared[at - 1];
        s->index[at] = s->index[at - 1];
    }
    s->distance_squared[at] = d2;
    s->index[at] = index;
    return true;
}

static bool visit_nearest(struct RTCPointQueryFunctionArguments *args)
{
    nearest_search *s = args->userPtr;
    const point_tree *tree = s->tree;
    const double d2 = distance_squared_to(tree, args->primID, s->query);
    if (s->found == s->k && d2 > s->distance_squared[s->k - 1])
        return false;
    /* The list ascends and all of it is at one distance: after the first that is refused, so are the rest. */
    for (uint32_t m = tree->first[args->primID]; m < tree->first[args->primID + 1]; m++)
        if (tree->member[m] != s->skip && !insert_nearest(s, tree->member[m], d2))
            break;
    if (s->found < s->k)
        return false;
    const float radius = site_search_radius(tree, sqrt(s->distance_squared[s->k - 1]));
    if (!(radius < args->query->radius))
        return false;
    args->query->radius =
        radius; /* sites at exactly the k-th distance stay inside: they may have a lower index */
    return true;
}

static size_t find_nearest(const point_tree *tree, const double query[3], size_t k, size_t skip,
                           uint32_t *index, double *distance_squared)
{
    nearest_search search = {.tree = tree,
                             .query = {query[0], query[1], query[2]},
                             .k = k,
                             .skip = skip,
                             .index = index,
                             .distance_squared = distance_squared};
    sites_search(tree, tree->centers, query, INFINITY, visit_nearest, &search);
    return search.found;
}

size_t point_tree_nearest(const point_tree *tree, const float query[3], size_t k, size_t skip,
                          uint32_t *index, double *distance_squared)
{
    if (k == 0 || !finite3(query))
        return 0;
    const double exact[3] = {(double)query[0], (double)query[1], (double)query[2]};
    return find_nearest(tree, exact, k, skip, index, distance_squared);
}

/* ---- spacing ---- */

typedef struct spacing_job {
    const point_tree *tree;
    size_t k;
    float *spacing;
} spacing_job;

static void space_sites(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const spacing_job *job = context;
    const point_tree *tree = job->tree;
    uint32_t index[MAX_NEIGHBOURS + 1];
    double d2[MAX_NEIGHBOURS + 1];
    /* Threads of oneTBB may have inherited Embree's mode that flushes small numbers to 0: then the bits would
       depend on the thread. */
    fenv_t before;
    fegetenv(&before);
    fesetenv(FE_DFL_ENV);
    for (size_t site = begin; site < end; site++) {
        const uint32_t first = tree->first[site], last = tree->first[site + 1];
        double spacing = 0;
        if (last - first <= job->k) { /* else k others are here */
            const size_t found = find_nearest(tree, tree->site + 3 * site, job->k + 1, SIZE_MAX, index, d2);
            double sum = 0;
            for (size_t i = 1; i < found; i++) /* 0 is a point of the site itself */
                sum += d2[i];
            if (found > 1)
                spacing = sqrt(sum / (double)(found - 1));
        }
        for (uint32_t m = first; m < last; m++)
            job->spacing[tree->member[m]] = (float)spacing;
    }
    fesetenv(&before);
}

gbt_status point_tree_spacing(const point_tree *tree, size_t k, float *spacing, gbt_error *err)
{
    if (k < 1 || k > MAX_NEIGHBOURS)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad number of neighbours (wanted 1..%d, got %zu)",
                         (int)MAX_NEIGHBOURS, k);
    spacing_job job = {.tree = tree, .k = k, .spacing = spacing};
    parallel_blocks(tree->site_count, SPACING_GRAIN, space_sites, &job);
    return GBT_OK;
}
