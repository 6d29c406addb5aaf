/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/query.h -- spatial queries over balls and anchors: nearest, within a radius, containing a point,
   overlapping a ball, crossed by a ray; in a run, a file of balls, any point cloud, or your own arrays.

   Answers are exact: the same as testing every ball in double arithmetic, with ties ordered by index.
   Coordinates are doubles, in the system of the data set or file. docs/queries.md has a tour. */
#ifndef GBTRACE_QUERY_H
#define GBTRACE_QUERY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/api.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * A set of balls (points are balls of radius 0) with a search tree. Immutable once made.
 *
 * Threads: any number of threads may query at the same time; each query runs on all threads that
 * gbt_set_threads() allows, with the same answers for any number of them.
 */
typedef struct gbt_balls gbt_balls;

/* ---- make ---- */

/**
 * Balls from a file or folder.
 *
 * A run or its model file: a ball per anchor that encloses everything its Gaussians can show in any view: the
 * radius is the distance to the farthest of their centres, plus the distance at which the largest std-dev has
 * a response of 1/255. Plain Gaussians: a ball per Gaussian, out to where its response falls to 1/255, radius
 * at least 0; Gaussians with unusable values are left out and not counted. A .ply of other vertices (also of
 * gbtrace init): its `radius`, or points. A data set: its sparse points. A text file: a line per ball, "x y
 * z" or "x y z radius", commas or blanks, # for comments.
 *
 * @param path [in]  RUN, model.gbt, plain Gaussians in any format of gbt_export_format_at(), .ply, data set
 *                   folder, or .txt, .csv, .xyz
 * @param out  [out] free with gbt_balls_free(); NULL on failure
 * @param err  [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 * Cost: O(n log n); keeps about 90 bytes per ball.
 */
gbt_status gbt_balls_open(const char *path, gbt_balls **out, gbt_error *err);

/**
 * Balls from arrays, which are copied.
 *
 * @param position [in]  [count][3], within +-1e100
 * @param radius   [in]  [count], 0 to 1e100; NULL: points
 * @param count    [in]  fewer than 2^32 - 1; with 0 every answer is empty
 * @param out      [out] free with gbt_balls_free(); NULL on failure
 * @param err      [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first bad ball), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 */
gbt_status gbt_balls_from_arrays(const double *position, const double *radius, size_t count, gbt_balls **out,
                                 gbt_error *err);

/** NULL is fine. */
void gbt_balls_free(gbt_balls *balls);

/** The balls of a set; borrowed until gbt_balls_free(). */
typedef struct gbt_balls_view {
    size_t count;
    const double *position; /* [count][3] */
    const double *radius;   /* [count]; NULL: points, whose radius is 0 */
    bool anchors;           /* true: the balls are the anchors of a run */
} gbt_balls_view;

gbt_balls_view gbt_balls_get(const gbt_balls *balls);

/* ---- ask: many at once ---- */

/**
 * The k nearest centres of each point, nearest first.
 *
 * @param point    [in]  [count][3], within +-1e100
 * @param k        [in]  >= 1
 * @param skip_same [in] exclude ball i from the answer to query i: for points that are the balls' own centres
 * @param index    [out] [count][k]; UINT32_MAX where there are fewer than k
 * @param distance [out] [count][k]; infinite where there are fewer
 * @param err      [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first bad point), GBT_ERR_NO_MEMORY
 * Cost: about O(log n + k^2) each; docs/queries.md has figures.
 */
gbt_status gbt_balls_nearest(const gbt_balls *balls, const double *point, size_t count, size_t k,
                             bool skip_same, uint32_t *index, double *distance, gbt_error *err);

/** Answers to many queries: query i has index[first[i]] .. index[first[i + 1] - 1], in ascending order. Start
    from {0}; a call first frees what is in it. Free it with gbt_answers_free(), also after a failure; it does
    not need the balls any more. */
typedef struct gbt_answers {
    size_t count;    /* queries */
    size_t *first;   /* [count + 1] */
    uint32_t *index; /* [first[count]] balls */
    double *value;   /* [first[count]]; distance to the centre; for rays, t of the point on the segment that
                        is nearest to the centre */
} gbt_answers;

/** Free the arrays and leave {0}. NULL is fine. */
void gbt_answers_free(gbt_answers *answers);

/* The next four functions answer `count` queries, with points and origins within +-1e100. They return GBT_OK,
   GBT_ERR_ARGUMENT (names the first bad query) or GBT_ERR_NO_MEMORY. Cost: about O(log n + m) per query with
   m answers. */

/** Centres within radius[i] (>= 0, may be infinite) of point[i]. */
gbt_status gbt_balls_within(const gbt_balls *balls, const double *point, const double *radius, size_t count,
                            gbt_answers *out, gbt_error *err);

/** Balls that contain point[i], the surface included. */
gbt_status gbt_balls_containing(const gbt_balls *balls, const double *point, size_t count, gbt_answers *out,
                                gbt_error *err);

/** Balls that overlap, or touch, the ball of radius[i] around point[i]. */
gbt_status gbt_balls_overlapping(const gbt_balls *balls, const double *point, const double *radius,
                                 size_t count, gbt_answers *out, gbt_error *err);

/**
 * Balls that intersect the segment origin[i] + t direction[i], t_min[i] <= t <= t_max[i].
 *
 * @param direction [in] [count][3], within +-1e100, one component at least 1e-100 or at most -1e-100
 * @param t_min, t_max [in] [count], may be negative or infinite; NULL: 0, infinity
 */
gbt_status gbt_balls_crossed(const gbt_balls *balls, const double *origin, const double *direction,
                             const double *t_min, const double *t_max, size_t count, gbt_answers *out,
                             gbt_error *err);

/* ---- files ---- */

typedef enum gbt_query_kind {
    GBT_QUERY_NEAREST,
    GBT_QUERY_WITHIN,
    GBT_QUERY_CONTAINING,
    GBT_QUERY_OVERLAPPING,
    GBT_QUERY_CROSSED
} gbt_query_kind;

typedef struct gbt_query_def {
    gbt_query_kind kind; /* default GBT_QUERY_NEAREST */
    const char *at;      /* one query: "x,y,z", or for GBT_QUERY_CROSSED "x,y,z,dx,dy,dz" with an optional
                            ",t_min,t_max". Default NULL */
    const char *from;    /* a file with one such line per query (for all but rays also a .ply); a fourth
                            number is that query's own radius. Default NULL; either `at` or `from` is
                            required */
    int k;               /* of GBT_QUERY_NEAREST, [1, 1e6]. Default 1 */
    double radius;       /* of GBT_QUERY_WITHIN and GBT_QUERY_OVERLAPPING, >= 0. Default 0 */
    uint32_t cookie_;    /* set by gbt_query_def_default() */
} gbt_query_def;

gbt_query_def gbt_query_def_default(void);

/**
 * Query the balls of a file or folder, and print one CSV line per answer: query, rank, ball, distance or t,
 * and the ball's centre and radius.
 *
 * @param path [in] as gbt_balls_open()
 * @return as gbt_balls_open() and the queries
 *
 * Threads: any, with distinct `out`.
 */
gbt_status gbt_query(const char *path, const gbt_query_def *def, FILE *out, gbt_error *err);

GBT_API_END
#endif
