/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_query.h -- what `bench query` measures, for the files that measure and write it. */
#ifndef LAB_BENCHMARK_BENCH_QUERY_H
#define LAB_BENCHMARK_BENCH_QUERY_H

#include "lab/lab.h"

/* Beyond it, building FLANN's random trees takes most of the time. */
enum { QUERY_APPROXIMATE_MAX = 1000000 };

enum { QUERY_CLOUDS = 3, QUERY_ROWS_MAX = 512, QUERY_CHECKS = 6 };

typedef enum query_engine {
    ENGINE_BATCH,       /* ours, all queries in one call */
    ENGINE_SINGLE,      /* ours, one after the other */
    ENGINE_FLANN,       /* FLANN's exact kd-tree */
    ENGINE_APPROXIMATE, /* FLANN's four random kd-trees, which look at `checks` points */
    ENGINE_BRUTE,
    ENGINE_COUNT
} query_engine;

typedef struct query_row {
    int cloud;
    size_t points, k;
    query_engine engine;
    int checks;           /* of ENGINE_APPROXIMATE */
    double build_seconds; /* of one core */
    double us;            /* core-microseconds per query, least of three; of one for ENGINE_APPROXIMATE */
    double right;         /* share of the k neighbours that are no farther than the true ones */
    double bytes;         /* of ours, per point; NaN for others */
} query_row;

typedef struct query_check {
    const char *kind;
    size_t queries, answers, wrong; /* queries with another answer than brute force */
} query_check;

typedef struct query_bench {
    const lab_bench_query_def *def;
    query_row row[QUERY_ROWS_MAX];
    size_t row_count;
    query_check check[QUERY_CHECKS];
    size_t check_count;
} query_bench;

extern const char *const query_cloud_names[QUERY_CLOUDS];
const char *query_engine_name(query_engine engine);

/** Point i of a cloud of n points; other seeds give other points of the same cloud. */
void query_cloud_point(int cloud, uint64_t seed, size_t i, double out[3]);

/** Every kind of query, def->queries each, against a test of every ball. */
gbt_status query_check_all(query_bench *bench, gbt_error *err);

/** query.csv, query.json and query.svg into `folder` (NULL: nowhere), and the tables to `out`. */
gbt_status query_bench_write(const query_bench *bench, const char *folder, FILE *out, gbt_error *err);

#endif
