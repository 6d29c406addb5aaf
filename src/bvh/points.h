/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points.h -- exact queries on balls (points with a radius): one tree, made by Embree's builder, for
   nearest, k nearest, within a radius, balls that contain a point, overlapping balls, and balls that a ray
   crosses; one by one, or in batches.

   All answers are those of double arithmetic on the coordinates given, as a test of every ball would find
   them, and ties are ordered by index. Coordinates and radii may be anything up to POINT_LIMIT, however small
   or far from the origin, and any number of points may coincide. */
#ifndef GBT_BVH_POINTS_H
#define GBT_BVH_POINTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

/** Largest |coordinate| and radius, so that squares stay finite. Every float is below it. */
#define POINT_LIMIT 1e100

/** An array of floats or of doubles; borrowed. {0}: there is none. */
typedef struct number_array {
    const float *single;
    const double *real;
} number_array;

static inline number_array number_floats(const float *values) { return (number_array){values, NULL}; }
static inline number_array number_doubles(const double *values) { return (number_array){NULL, values}; }
static inline bool number_none(number_array a) { return a.single == NULL && a.real == NULL; }
static inline double number_at(number_array a, size_t i)
{
    return a.real != NULL ? a.real[i] : (double)a.single[i];
}

typedef struct point_tree point_tree; /* immutable once built; queries are callable from any thread */

/**
 * Build the tree of a set of balls.
 *
 * @param position [in] [count][3], finite; copied
 * @param radius   [in] [count], >= 0, finite; copied; {0} for points
 * @param count    [in] may be 0: every query then answers nothing
 * @param out      [out] free with point_tree_free(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (bad point: says which), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL (Embree's own
 *         words)
 *
 * Threads: any; builds on all threads inside; the same tree for every number of them. Cost: O(n log n); 50
 * bytes per point are kept, 8 more with radii, and 100 more are used while it builds.
 */
gbt_status point_tree_build(number_array position, number_array radius, size_t count, point_tree **out,
                            gbt_error *err);
void point_tree_free(point_tree *tree); /* NULL is fine */

/* ---- one by one ---- */

/**
 * Up to k nearest centres, nearest first, ties by index; ball `skip` is left out (SIZE_MAX: none).
 *
 * @param index            [out] [k]
 * @param distance_squared [out] [k], double
 * @return how many were found; 0 for a query that is not finite
 *
 * Threads: any. Cost: about O(log n + k^2).
 */
size_t point_tree_nearest(const point_tree *tree, const double query[3], size_t k, size_t skip,
                          uint32_t *index, double *distance_squared);

/** A growing list of answers, by index; start from {0}, free with point_list_free(). */
typedef struct point_list {
    uint64_t *item; /* index of the ball << 32 | place of its value */
    double *value;
    size_t count, capacity, value_capacity;
} point_list;
void point_list_free(point_list *list);
static inline uint32_t point_list_index(const point_list *list, size_t i)
{
    return (uint32_t)(list->item[i] >> 32);
}
/** |c - a|^2; for POINTS_CROSSED the t of the point of the segment that is nearest to c. */
static inline double point_list_value(const point_list *list, size_t i)
{
    return list->value[(uint32_t)list->item[i]];
}

/** What is asked of every ball, with a, b of three coordinates each. */
typedef enum point_question {
    POINTS_WITHIN,      /* |c - a| <= radius */
    POINTS_CONTAINING,  /* |c - a| <= r */
    POINTS_OVERLAPPING, /* |c - a| <= r + radius */
    POINTS_CROSSED      /* |a + t b - c| <= r for some t, t_min <= t <= t_max */
} point_question;

typedef struct point_query {
    point_question what;
    double a[3], b[3];
    double radius;       /* >= 0, may be infinite */
    double t_min, t_max; /* may be negative or infinite; t_min > t_max is an empty segment */
} point_query;

/**
 * The balls for which the answer is yes. Replaces the contents of `out` and keeps its memory.
 *
 * @return GBT_OK; on failure out->count is 0: GBT_ERR_ARGUMENT for numbers that are not finite, a radius < 0,
 *         or a direction b whose largest component is not within 1e-100 to 1e100; GBT_ERR_NO_MEMORY
 * Threads: any, with distinct `out`. Cost: about O(log n + m) for m answers.
 */
gbt_status point_tree_list(const point_tree *tree, const point_query *query, point_list *out, gbt_error *err);

/* ---- in batches: parallel inside, the same answers for every number of threads ---- */

/**
 * point_tree_nearest() for many queries, which are worked on in Morton order.
 *
 * @param query     [in] [count][3]
 * @param skip_same [in] query i leaves ball i out: the queries are the balls' own centres
 * @param index     [out] [count][k]; UINT32_MAX where there are fewer
 * @param distance_squared [out] [count][k]; infinite where there are fewer
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first bad query), GBT_ERR_NO_MEMORY
 */
gbt_status point_tree_nearest_all(const point_tree *tree, number_array query, size_t count, size_t k,
                                  bool skip_same, uint32_t *index, double *distance_squared, gbt_error *err);

/**
 * The nearest centre of each point, in one call: builds the tree, asks, and frees it.
 *
 * @param center  [in]  [center_count][3], finite
 * @param point   [in]  [count][3], finite; NULL: the centres themselves, each of which leaves itself out
 * @param nearest [out] [count]; UINT32_MAX where there is none
 * @param squared [out] [count], squared distances, infinite where there is none; optional (NULL)
 * @return as point_tree_build() and point_tree_nearest_all()
 */
gbt_status points_find_nearest(const float *center, size_t center_count, const float *point, size_t count,
                               uint32_t *nearest, double *squared, gbt_error *err);

/** Queries of one kind. */
typedef struct point_queries {
    point_question what;
    size_t count;
    number_array a, b;         /* [count][3]; b of POINTS_CROSSED alone */
    number_array radius;       /* [count] */
    number_array t_min, t_max; /* [count]; {0}: 0, infinity */
} point_queries;

/** Answers of many queries: those of query i are index[first[i] .. first[i + 1]), ascending. */
typedef struct point_lists {
    size_t count;
    size_t *first; /* [count + 1] */
    uint32_t *index;
    double *value; /* of each answer: |c - a|; for POINTS_CROSSED the t of the point that is nearest to c */
} point_lists;

/**
 * point_tree_list() for many queries.
 *
 * @param out [out] its arrays are the caller's: mem_free(); zeroed on failure
 * @return as point_tree_list(); names the first bad query
 */
gbt_status point_tree_list_all(const point_tree *tree, const point_queries *queries, point_lists *out,
                               gbt_error *err);

/**
 * For every point: root of the mean of the squared distances to its k nearest others (fewer when there are
 * fewer; 0 for a lone point).
 *
 * @param position [in] [count][3], those that the tree was built from
 * @param k        [in] 1..64, else GBT_ERR_ARGUMENT
 * @param spacing  [out] [count]
 *
 * Threads: parallel inside; same bits for every thread count.
 */
gbt_status point_tree_spacing(const point_tree *tree, number_array position, size_t k, float *spacing,
                              gbt_error *err);

#endif
