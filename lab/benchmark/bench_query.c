/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_query.c -- nearest neighbours: ours, FLANN's exact and approximate trees, and brute force,
   on three kinds of clouds. */
#include "benchmark/bench_query.h"

#include <flann/flann.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"
#include "bvh/points.h"

enum { REPEATS = 3, BRUTE_PAIRS = 40000000, K_MAX = 8 };

lab_bench_query_def lab_bench_query_def_default(void)
{
    return (lab_bench_query_def){.points = 1000000, .queries = 20000};
}

/* ---- a cloud, its queries and their true neighbours ---- */

typedef struct test {
    int cloud;
    size_t points, queries;
    float *position, *query; /* [][3] */
    uint32_t *index;         /* [queries][K_MAX], of whoever was asked last */
    double *d2;
    double *true_d2; /* [queries][K_MAX] */
    int *flann_index;
    float *flann_d2;
} test;

static void test_free(test *t)
{
    mem_free(t->position);
    mem_free(t->query);
    mem_free(t->index);
    mem_free(t->d2);
    mem_free(t->true_d2);
    mem_free(t->flann_index);
    mem_free(t->flann_d2);
}

static gbt_status test_make(test *t, gbt_error *err)
{
    const size_t answers = t->queries * K_MAX;
    t->position = mem_alloc(t->points, 3 * sizeof *t->position, "points", err);
    t->query = mem_alloc(t->queries, 3 * sizeof *t->query, "queries", err);
    t->index = mem_alloc(answers, sizeof *t->index, "answers", err);
    t->d2 = mem_alloc(answers, sizeof *t->d2, "answers", err);
    t->true_d2 = mem_alloc(answers, sizeof *t->true_d2, "answers", err);
    t->flann_index = mem_alloc(answers, sizeof *t->flann_index, "answers", err);
    t->flann_d2 = mem_alloc(answers, sizeof *t->flann_d2, "answers", err);
    if (t->position == NULL || t->query == NULL || t->index == NULL || t->d2 == NULL || t->true_d2 == NULL ||
        t->flann_index == NULL || t->flann_d2 == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < t->points + t->queries; i++) {
        double p[3];
        query_cloud_point(t->cloud, i < t->points ? 1 : 2, i, p);
        for (size_t j = 0; j < 3; j++)
            *(i < t->points ? &t->position[3 * i + j] : &t->query[3 * (i - t->points) + j]) = (float)p[j];
    }
    return GBT_OK;
}

/* Squared distances of float32 (FLANN) have errors of a few 2^-24. */
static double share_right(const test *t, size_t k, size_t queries, bool flann)
{
    size_t right = 0;
    for (size_t i = 0; i < queries; i++)
        for (size_t n = 0; n < k; n++) {
            const double d2 = flann ? (double)t->flann_d2[k * i + n] : t->d2[k * i + n];
            right += d2 <= t->true_d2[K_MAX * i + n] * (1 + 1e-5) + 1e-30;
        }
    return (double)right / (double)(queries * k);
}

static void add(query_bench *b, const test *t, query_row row)
{
    row.cloud = t->cloud;
    row.points = t->points;
    if (b->row_count < QUERY_ROWS_MAX)
        b->row[b->row_count++] = row;
}

/* ---- engines ---- */

static void ask_single(const point_tree *tree, const test *t, size_t k)
{
    for (size_t i = 0; i < t->queries; i++) {
        const float *f = t->query + 3 * i;
        const double q[3] = {(double)f[0], (double)f[1], (double)f[2]};
        point_tree_nearest(tree, q, k, SIZE_MAX, t->index + k * i, t->d2 + k * i);
    }
}

static gbt_status measure_ours(query_bench *b, test *t, gbt_error *err)
{
    point_tree *tree;
    const double start = clock_process();
    GBT_TRY(point_tree_build(number_floats(t->position), (number_array){0}, t->points, &tree, err));
    const double build = clock_process() - start;
    gbt_status status = point_tree_nearest_all(tree, number_floats(t->query), t->queries, K_MAX, false,
                                               t->index, t->true_d2, err);
    for (size_t k = 1; k <= K_MAX && status == GBT_OK; k += K_MAX - 1)
        for (query_engine e = ENGINE_BATCH; e <= ENGINE_SINGLE && status == GBT_OK; e++) {
            double best = HUGE_VAL;
            for (int r = 0; r < REPEATS && status == GBT_OK; r++) {
                const double before = clock_process();
                if (e == ENGINE_SINGLE)
                    ask_single(tree, t, k);
                else
                    status = point_tree_nearest_all(tree, number_floats(t->query), t->queries, k, false,
                                                    t->index, t->d2, err);
                best = fmin(best, clock_process() - before);
            }
            add(b, t,
                (query_row){.k = k,
                            .engine = e,
                            .build_seconds = build,
                            .us = 1e6 * best / (double)t->queries,
                            .right = share_right(t, k, t->queries, false),
                            .bytes = (double)point_tree_bytes(tree) / (double)t->points});
        }
    point_tree_free(tree);
    return status;
}

static gbt_status measure_flann(query_bench *b, test *t, bool exact, gbt_error *err)
{
    static const int few[] = {16, 64, 256};
    struct FLANNParameters p = DEFAULT_FLANN_PARAMETERS;
    p.algorithm = exact ? FLANN_INDEX_KDTREE_SINGLE : FLANN_INDEX_KDTREE;
    p.trees = 4;
    p.leaf_max_size = 10; /* its own default */
    p.cores = 1;
    p.sorted = 1;
    p.random_seed = 1;
    float speedup;
    const double start = clock_process();
    flann_index_t index = flann_build_index_float(t->position, (int)t->points, 3, &speedup, &p);
    const double build = clock_process() - start;
    if (index == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "flann: no index over %zu points", t->points);
    for (size_t c = 0; c < (exact ? 1 : sizeof few / sizeof *few); c++)
        for (size_t k = 1; k <= K_MAX; k += K_MAX - 1) {
            double best = HUGE_VAL;
            p.checks = exact ? FLANN_CHECKS_UNLIMITED : few[c];
            for (int r = 0; r < (exact ? REPEATS : 1); r++) {
                const double before = clock_process();
                flann_find_nearest_neighbors_index_float(index, t->query, (int)t->queries, t->flann_index,
                                                         t->flann_d2, (int)k, &p);
                best = fmin(best, clock_process() - before);
            }
            add(b, t,
                (query_row){.k = k,
                            .engine = exact ? ENGINE_FLANN : ENGINE_APPROXIMATE,
                            .checks = exact ? 0 : few[c],
                            .build_seconds = build,
                            .us = 1e6 * best / (double)t->queries,
                            .right = share_right(t, k, t->queries, true),
                            .bytes = NAN});
        }
    flann_free_index_float(index, &p);
    return GBT_OK;
}

/* Every point, in float32, one query after the other; for the time alone, so of few queries. */
static void measure_brute(query_bench *b, test *t)
{
    size_t queries = BRUTE_PAIRS / t->points;
    queries = queries < 1 ? 1 : queries > t->queries ? t->queries : queries;
    for (size_t k = 1; k <= K_MAX; k += K_MAX - 1) {
        double best = HUGE_VAL;
        for (int r = 0; r < REPEATS; r++) {
            const double before = clock_process();
            for (size_t i = 0; i < queries; i++) {
                const float *q = t->query + 3 * i;
                double *d2 = t->d2 + k * i;
                size_t found = 0;
                for (size_t n = 0; n < t->points; n++) {
                    const float *p = t->position + 3 * n;
                    const double x = (double)p[0] - (double)q[0], y = (double)p[1] - (double)q[1],
                                 z = (double)p[2] - (double)q[2], far = x * x + y * y + z * z;
                    if (found == k && far >= d2[k - 1])
                        continue;
                    size_t at = found < k ? found++ : k - 1;
                    for (; at > 0 && d2[at - 1] > far; at--)
                        d2[at] = d2[at - 1];
                    d2[at] = far;
                }
            }
            best = fmin(best, clock_process() - before);
        }
        add(b, t,
            (query_row){.k = k,
                        .engine = ENGINE_BRUTE,
                        .us = 1e6 * best / (double)queries,
                        .right = share_right(t, k, queries, false),
                        .bytes = NAN});
    }
}

static gbt_status measure(query_bench *b, int cloud, size_t points, gbt_error *err)
{
    test t = {.cloud = cloud, .points = points, .queries = b->def->queries};
    gbt_status status = test_make(&t, err);
    if (status == GBT_OK)
        status = measure_ours(b, &t, err);
    if (status == GBT_OK)
        status = measure_flann(b, &t, true, err);
    if (status == GBT_OK && points <= QUERY_APPROXIMATE_MAX)
        status = measure_flann(b, &t, false, err);
    if (status == GBT_OK)
        measure_brute(b, &t);
    test_free(&t);
    return status;
}

gbt_status lab_bench_query(const lab_bench_query_def *def, const char *folder, FILE *out, gbt_error *err)
{
    if (def->points < 10000 || def->points > 10000000)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: %llu (wanted 10000 to 10000000)",
                         (unsigned long long)def->points);
    if (def->queries < 1 || def->queries > 10000000)
        return base_fail(err, GBT_ERR_ARGUMENT, "queries: %llu (wanted 1 to 10000000)",
                         (unsigned long long)def->queries);
    query_bench *b = mem_calloc(1, sizeof *b, "bench", err);
    if (b == NULL)
        return GBT_ERR_NO_MEMORY;
    b->def = def;
    gbt_status status = def->check ? query_check_all(b, err) : GBT_OK;
    for (size_t points = 10000; points <= def->points && status == GBT_OK; points *= 10)
        for (int cloud = 0; cloud < QUERY_CLOUDS && status == GBT_OK; cloud++)
            status = measure(b, cloud, points, err);
    if (status == GBT_OK)
        status = query_bench_write(b, folder, out, err);
    mem_free(b);
    return status;
}
