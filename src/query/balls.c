/* SPDX-License-Identifier: Apache-2.0 */
/* query/balls.c -- the queries of gbt_balls: nearest, within, containing, overlapping, crossed. */
#include <math.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "query/handle.h"

enum { ROOT_GRAIN = 65536 };

static void roots(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    double *value = context;
    for (size_t i = begin; i < end; i++)
        value[i] = sqrt(value[i]);
}

gbt_status gbt_balls_nearest(const gbt_balls *b, const double *point, size_t count, size_t k, bool skip_same,
                             uint32_t *index, double *distance, gbt_error *err)
{
    size_t all;
    if (k < 1 || __builtin_mul_overflow(count, k, &all))
        return base_fail(err, GBT_ERR_ARGUMENT, "k: %zu neighbours of %zu points (wanted at least 1)", k,
                         count);
    GBT_TRY(
        point_tree_nearest_all(b->tree, number_doubles(point), count, k, skip_same, index, distance, err));
    parallel_blocks(all, ROOT_GRAIN, roots, distance);
    return GBT_OK;
}

static gbt_status ask(const gbt_balls *b, const point_queries *queries, gbt_answers *out, gbt_error *err)
{
    gbt_answers_free(out);
    point_lists lists;
    GBT_TRY(point_tree_list_all(b->tree, queries, &lists, err));
    *out =
        (gbt_answers){.count = lists.count, .first = lists.first, .index = lists.index, .value = lists.value};
    return GBT_OK;
}

gbt_status gbt_balls_within(const gbt_balls *b, const double *point, const double *radius, size_t count,
                            gbt_answers *out, gbt_error *err)
{
    const point_queries queries = {
        .what = POINTS_WITHIN, .count = count, .a = number_doubles(point), .radius = number_doubles(radius)};
    return ask(b, &queries, out, err);
}

gbt_status gbt_balls_containing(const gbt_balls *b, const double *point, size_t count, gbt_answers *out,
                                gbt_error *err)
{
    const point_queries queries = {.what = POINTS_CONTAINING, .count = count, .a = number_doubles(point)};
    return ask(b, &queries, out, err);
}

gbt_status gbt_balls_overlapping(const gbt_balls *b, const double *point, const double *radius, size_t count,
                                 gbt_answers *out, gbt_error *err)
{
    const point_queries queries = {.what = POINTS_OVERLAPPING,
                                   .count = count,
                                   .a = number_doubles(point),
                                   .radius = number_doubles(radius)};
    return ask(b, &queries, out, err);
}

gbt_status gbt_balls_crossed(const gbt_balls *b, const double *origin, const double *direction,
                             const double *t_min, const double *t_max, size_t count, gbt_answers *out,
                             gbt_error *err)
{
    const point_queries queries = {.what = POINTS_CROSSED,
                                   .count = count,
                                   .a = number_doubles(origin),
                                   .b = number_doubles(direction),
                                   .t_min = number_doubles(t_min),
                                   .t_max = number_doubles(t_max)};
    return ask(b, &queries, out, err);
}

void gbt_answers_free(gbt_answers *answers)
{
    if (answers == NULL)
        return;
    mem_free(answers->first);
    mem_free(answers->index);
    mem_free(answers->value);
    *answers = (gbt_answers){0};
}
