/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_query_check.c -- every kind of query against a test of every ball, through the public
   interface, at georeferenced coordinates. */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "benchmark/bench_query.h"
#include "gbtrace/query.h"

enum { BALLS = 10000, K = 8, GRAIN = 64 };

typedef enum kind { NEAREST, K_NEAREST, WITHIN, CONTAINING, OVERLAPPING, CROSSED } kind;

typedef struct check_job {
    kind what;
    const double *position, *radius;           /* of the balls */
    const double *point, *dir, *reach, *t_max; /* of the queries */
    const uint32_t *index;
    const double *distance;
    const gbt_answers *answers;
    atomic_size_t wrong;
} check_job;

static double square_to(const double *a, const double *b)
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static bool nearest_is_right(const check_job *job, size_t i, size_t k)
{
    double d2[K];
    uint32_t index[K];
    size_t found = 0;
    for (uint32_t n = 0; n < BALLS; n++) {
        const double far = square_to(job->position + 3 * (size_t)n, job->point + 3 * i);
        if (found == k && far >= d2[k - 1])
            continue;
        size_t at = found < k ? found++ : k - 1;
        for (; at > 0 && d2[at - 1] > far; at--) {
            d2[at] = d2[at - 1];
            index[at] = index[at - 1];
        }
        d2[at] = far;
        index[at] = n;
    }
    for (size_t n = 0; n < k; n++)
        if (index[n] != job->index[k * i + n] || sqrt(d2[n]) != job->distance[k * i + n])
            return false;
    return true;
}

static double square_to_segment(const double *c, const double *o, const double *d, double t_max)
{
    const double m[3] = {c[0] - o[0], c[1] - o[1], c[2] - o[2]};
    const double t =
        fmin(fmax((m[0] * d[0] + m[1] * d[1] + m[2] * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), 0),
             t_max);
    const double e[3] = {m[0] - t * d[0], m[1] - t * d[1], m[2] - t * d[2]};
    return e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
}

static bool list_is_right(const check_job *job, size_t i)
{
    const gbt_answers *a = job->answers;
    size_t at = a->first[i];
    for (uint32_t n = 0; n < BALLS; n++) {
        const double *c = job->position + 3 * (size_t)n, *q = job->point + 3 * i, r = job->radius[n];
        const double d2 =
            job->what == CROSSED ? square_to_segment(c, q, job->dir + 3 * i, job->t_max[i]) : square_to(c, q);
        const double reach = job->what == WITHIN        ? job->reach[i]
                             : job->what == OVERLAPPING ? job->reach[i] + r
                                                        : r;
        const bool wanted = d2 <= reach * reach, got = at < a->first[i + 1] && a->index[at] == n;
        if (wanted != got)
            return false;
        at += got;
    }
    return at == a->first[i + 1];
}

static void check_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    check_job *job = context;
    for (size_t i = begin; i < end; i++)
        if (!(job->what <= K_NEAREST ? nearest_is_right(job, i, job->what == NEAREST ? 1 : K)
                                     : list_is_right(job, i)))
            atomic_fetch_add(&job->wrong, 1);
}

static gbt_status ask(const gbt_balls *balls, const check_job *job, size_t n, uint32_t *index,
                      double *distance, gbt_answers *answers, gbt_error *err)
{
    switch (job->what) {
    case NEAREST:
        return gbt_balls_nearest(balls, job->point, n, 1, false, index, distance, err);
    case K_NEAREST:
        return gbt_balls_nearest(balls, job->point, n, K, false, index, distance, err);
    case WITHIN:
        return gbt_balls_within(balls, job->point, job->reach, n, answers, err);
    case CONTAINING:
        return gbt_balls_containing(balls, job->point, n, answers, err);
    case OVERLAPPING:
        return gbt_balls_overlapping(balls, job->point, job->reach, n, answers, err);
    default:
        return gbt_balls_crossed(balls, job->point, job->dir, NULL, job->t_max, n, answers, err);
    }
}

/* The sparse cloud at the coordinates of a map, on a grid of a millimetre, which gives ties; a ball per
 * point. */
static void make_case(double *position, double *radius, double *point, double *dir, double *reach,
                      double *t_max, size_t n)
{
    static const double origin[3] = {4500000, 5300000, 300};
    for (size_t i = 0; i < BALLS + n; i++) {
        double *p = i < BALLS ? position + 3 * i : point + 3 * (i - BALLS);
        query_cloud_point(2, i < BALLS ? 1 : 2, i, p);
        for (int j = 0; j < 3; j++)
            p[j] = origin[j] + (i % 2 == 0 ? 1e-3 * rint(1e3 * p[j]) : p[j]);
    }
    for (size_t i = 0; i < BALLS; i++)
        radius[i] = i % 9 == 0 ? 0 : 0.1 * exp(rng_normal(3, 0, i));
    for (size_t i = 0; i < n; i++) {
        reach[i] = i % 11 == 0 ? 0 : 0.1 * exp(rng_normal(4, 0, i));
        t_max[i] = i % 3 == 0 ? HUGE_VAL : 5 * (double)rng_uniform(4, 1, i);
        for (uint64_t j = 0; j < 3; j++)
            dir[3 * i + j] = i % 7 == 0 ? (double)(i % 3 == j) : rng_normal(4, 2 + j, i);
    }
}

gbt_status query_check_all(query_bench *bench, gbt_error *err)
{
    static const char *const names[QUERY_CHECKS] = {"nearest",    "8 nearest",   "within",
                                                    "containing", "overlapping", "crossed"};
    const size_t n = bench->def->queries;
    /* position 3, radius 1 of each ball; point 3, direction 3, reach, t_max, K distances of each query */
    double *numbers = mem_alloc(4 * BALLS + n * (8 + K), sizeof *numbers, "check", err);
    uint32_t *index = mem_alloc(n, K * sizeof *index, "check", err);
    gbt_status status = numbers != NULL && index != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    double *position = numbers, *radius = numbers + 3 * BALLS, *point = numbers + 4 * BALLS,
           *dir = point + 3 * n, *reach = dir + 3 * n, *t_max = reach + n, *distance = t_max + n;
    gbt_balls *balls = NULL;
    if (status == GBT_OK) {
        make_case(position, radius, point, dir, reach, t_max, n);
        status = gbt_balls_from_arrays(position, radius, BALLS, &balls, err);
    }
    for (int k = 0; k < QUERY_CHECKS && status == GBT_OK; k++) {
        gbt_answers answers = {0};
        check_job job = {(kind)k, position, radius, point, dir, reach, t_max, index, distance, &answers, 0};
        status = ask(balls, &job, n, index, distance, &answers, err);
        if (status == GBT_OK) {
            parallel_blocks(n, GRAIN, check_block, &job);
            bench->check[bench->check_count++] =
                (query_check){names[k], n, k <= K_NEAREST ? n * (k == NEAREST ? 1 : K) : answers.first[n],
                              atomic_load(&job.wrong)};
        }
        gbt_answers_free(&answers);
    }
    gbt_balls_free(balls);
    mem_free(numbers);
    mem_free(index);
    return status;
}
