/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/query.h -- balls and anchors by place: nearest, within a radius, those that contain a point,
   overlap a ball, or are crossed by a ray; over a run, a file of balls, any point cloud, or your own arrays.

   Answers are exact: those of double arithmetic on the coordinates given, as a test of every ball would find
   them, ties by index. Coordinates are in double and those of the data set or file. docs/queries.md has a
   tour. */
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
 * Balls, points being balls of radius 0, and a tree over them. Nothing changes once it is made.
 *
 * Threads: queries from any number of threads at once; each uses all processors that gbt_set_threads()
 * allows, and answers the same for any number of them.
 */
typedef struct gbt_balls gbt_balls;

/* ---- make ---- */

/**
 * Balls from a file or folder.
 *
 * A run or its model file: a ball per anchor, around everything that its Gaussians can show in any view: the
 * farthest of their centres, and beyond it the largest std-dev as far as a response of 1/255 reaches. Plain
 * Gaussians: a ball per Gaussian, to where its response falls to 1/255, at least 0; those left out because a
 * value is not usable are not counted. A .ply of other vertices (also of gbtrace init): its `radius`, or
 * points. A data set: its sparse points. A text file: a line per ball, "x y z" or "x y z radius", commas or
 * blanks, # for comments.
 *
 * @param path [in]  RUN, model.gbt, plain Gaussians in any format of gbt_export_format_at(), .ply, data set
 *                   folder, or .txt, .csv, .xyz
 * @param out  [out] free with gbt_balls_free(); NULL on failure
 * @param err  [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 * Cost: O(n log n); about 90 bytes a ball are kept.
 */
gbt_status gbt_balls_open(const char *path, gbt_balls **out, gbt_error *err);

/**
 * Balls from arrays, which are copied.
 *
 * @param position [in]  [count][3], within +-1e100
 * @param radius   [in]  [count], 0 to 1e100; NULL: points
 * @param count    [in]  fewer than 2^32 - 1
 * @param out      [out] free with gbt_balls_free(); NULL on failure
 * @param err      [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first bad ball), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL
 */
gbt_status gbt_balls_from_arrays(const double *position, const double *radius, size_t count, gbt_balls **out,
                                 gbt_error *err);

/** NULL is fine. */
void gbt_balls_free(gbt_balls *balls);

/** What there is; borrowed until gbt_balls_free(). */
typedef struct gbt_balls_view {
    size_t count;
    const double *position; /* [count][3] */
    const double *radius;   /* [count]; NULL: points */
    bool anchors;           /* a ball is an anchor of a run */
} gbt_balls_view;

gbt_balls_view gbt_balls_get(const gbt_balls *balls);

/* ---- ask: many at once ---- */

/**
 * The k nearest centres of each point, nearest first.
 *
 * @param point    [in]  [count][3], within +-1e100
 * @param k        [in]  >= 1
 * @param skip_same [in] ball i is no answer to query i: the points are the balls' own centres
 * @param index    [out] [count][k]; UINT32_MAX where there are fewer than k
 * @param distance [out] [count][k]; infinite where there are fewer
 * @param err      [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first bad point), GBT_ERR_NO_MEMORY
 * Cost: about O(log n + k^2) each; docs/queries.md has figures.
 */
gbt_status gbt_balls_nearest(const gbt_balls *balls, const double *point, size_t count, size_t k,
                             bool skip_same, uint32_t *index, double *distance, gbt_error *err);

/** Answers of many queries: those of query i are index[first[i]] .. index[first[i + 1] - 1], ascending. Start
    from {0}; free with gbt_answers_free(), also after a failure. */
typedef struct gbt_answers {
    size_t count;    /* queries */
    size_t *first;   /* [count + 1] */
    uint32_t *index; /* [first[count]] balls */
    double *value;   /* [first[count]]; distance to the centre; of rays the t of the point of the segment that
                        is nearest to the centre */
} gbt_answers;

void gbt_answers_free(gbt_answers *answers);

/* What the next four have in common: count queries, points and origins within +-1e100; GBT_OK,
   GBT_ERR_ARGUMENT (names the first bad query), GBT_ERR_NO_MEMORY. Cost: about O(log n + m) each, of m
   answers. */

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
 * Balls that meet the segment origin[i] + t direction[i], t_min[i] <= t <= t_max[i].
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
    const char *at;      /* one query: "x,y,z", or of GBT_QUERY_CROSSED "x,y,z,dx,dy,dz" and perhaps
                            ",t_min,t_max". Default NULL */
    const char *from;    /* a file with such a line per query (not of rays: a .ply too); a fourth number is a
                            radius of its own. Default NULL; one of the two is needed */
    int k;               /* of GBT_QUERY_NEAREST, [1, 1e6]. Default 1 */
    double radius;       /* of GBT_QUERY_WITHIN and GBT_QUERY_OVERLAPPING, >= 0. Default 0 */
    uint32_t cookie_;    /* set by gbt_query_def_default() */
} gbt_query_def;

gbt_query_def gbt_query_def_default(void);

/**
 * Ask the balls of a file or folder, and print a line of CSV per answer: query, rank, ball, distance or t,
 * its centre and radius.
 *
 * @param path [in] as gbt_balls_open()
 * @return as gbt_balls_open() and the queries
 *
 * Threads: any, with distinct `out`.
 */
gbt_status gbt_query(const char *path, const gbt_query_def *def, FILE *out, gbt_error *err);

GBT_API_END
#endif
