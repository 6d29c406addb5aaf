/* SPDX-License-Identifier: Apache-2.0 */
/* bench/versus_flann.c -- nearest neighbours by our tree, by FLANN's exact and approximate trees, and by
   brute force, on one thread: the table of docs/queries.md. Fails if an exact method finds other distances.
   Needs libflann-dev. Build and run; the argument is the largest number of points (Embree 4: -lembree4): cc
   -O3 -Isrc -Iinclude bench/versus_flann.c build/release/libgbtrace.a -lembree3 -ltbb -lflann -lstdc++ -lm -o
   build/versus_flann && build/versus_flann 10000000 */
#include <flann/flann.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "bvh/points.h"

enum { QUERIES = 20000, K = 8, CHECKS = 64, BRUTE_PAIRS = 40000000 };
enum { APPROXIMATE_MAX = 1000000 }; /* above it, building the random trees would dominate the run time */
enum { BATCH, SINGLE, FLANN, APPROXIMATE, BRUTE, WAYS };

static const char *const clouds[] = {"random", "surface", "sparse"};
static size_t points, queries;
static float *position, query[3 * QUERIES], flann_d2[K * QUERIES];
static double d2[K * QUERIES], true_d2[K * QUERIES];
static uint32_t found[K * QUERIES];
static int flann_found[K * QUERIES];
static point_tree *tree;
static flann_index_t flann;
static struct FLANNParameters parameters;

/* Point i of a cloud; another seed gives other points of the same distribution. */
static void cloud_point(int cloud, uint64_t seed, size_t i, float *out)
{
    double p[3];
    for (uint64_t j = 0; j < 3; j++)
        p[j] = cloud == 0 ? 2 * (double)rng_uniform(seed, j, i) - 1 : rng_normal(seed, j, i);
    const double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) + 1e-9;
    double radius = 1 + 0.1 * sin(5 * p[0] / length) * cos(4 * p[1] / length);
    if (cloud == 1) /* a surface with a little noise */
        radius += 0.002 * rng_normal(seed, 3, i);
    else /* as from photos: densities of several orders of magnitude, and outliers */
        radius *= exp(1.5 * rng_normal(seed, 3, i)) * (i % 100 == 0 ? 30 : 1);
    for (int j = 0; j < 3; j++)
        out[j] = (float)(cloud == 0 ? p[j] : p[j] * radius / length);
}

static void ask_brute(const float *q, size_t k, double *best)
{
    size_t count = 0;
    for (const float *p = position; p < position + 3 * points; p += 3) {
        const double x = (double)p[0] - (double)q[0], y = (double)p[1] - (double)q[1],
                     z = (double)p[2] - (double)q[2], far = x * x + y * y + z * z;
        if (count == k && far >= best[k - 1])
            continue;
        size_t at = count < k ? count++ : k - 1;
        for (; at > 0 && best[at - 1] > far; at--)
            best[at] = best[at - 1];
        best[at] = far;
    }
}

/* The k nearest neighbours of every query: squared distances into d2, or into flann_d2 for FLANN. */
static void ask(int way, size_t k)
{
    if (way == BATCH)
        point_tree_nearest_all(tree, number_floats(query), queries, k, false, found, d2, NULL);
    if (way == FLANN || way == APPROXIMATE)
        flann_find_nearest_neighbors_index_float(flann, query, (int)queries, flann_found, flann_d2, (int)k,
                                                 &parameters);
    for (size_t i = 0; i < queries && (way == SINGLE || way == BRUTE); i++) {
        const float *q = query + 3 * i;
        if (way == BRUTE)
            ask_brute(q, k, d2 + k * i);
        else
            point_tree_nearest(tree, (double[]){(double)q[0], (double)q[1], (double)q[2]}, k, SIZE_MAX,
                               found + k * i, d2 + k * i);
    }
}

/* Build the index of a method. Returns core-seconds. */
static double build(int way)
{
    float speedup;
    parameters = DEFAULT_FLANN_PARAMETERS;
    parameters.algorithm = way == FLANN ? FLANN_INDEX_KDTREE_SINGLE : FLANN_INDEX_KDTREE;
    parameters.checks = way == FLANN ? FLANN_CHECKS_UNLIMITED : CHECKS;
    parameters.leaf_max_size = 10; /* FLANN's default */
    parameters.cores = 1;
    parameters.sorted = 1;
    parameters.random_seed = 1;
    const double start = clock_process();
    if (way == BATCH &&
        point_tree_build(number_floats(position), (number_array){0}, points, &tree, NULL) != 0)
        exit(EXIT_FAILURE);
    if (way != BATCH)
        flann = flann_build_index_float(position, (int)points, 3, &speedup, &parameters);
    return clock_process() - start;
}

/* Core-microseconds per query, minimum of three, and in *right the percentage of neighbours that are as near
   as the true ones. FLANN's squared distances in float32 have relative errors of a few 2^-24. */
static double measure(int way, size_t k, double *right)
{
    const bool is_flann = way == FLANN || way == APPROXIMATE;
    double best = HUGE_VAL;
    for (int r = 0; r < (way == APPROXIMATE ? 1 : 3); r++) {
        const double start = clock_process();
        ask(way, k);
        best = fmin(best, clock_process() - start);
    }
    size_t same = 0;
    for (size_t i = 0; i < k * queries; i++) {
        const double far = is_flann ? (double)flann_d2[i] : d2[i], want = true_d2[i / k * K + i % k];
        same += fabs(far - want) <= 1e-5 * want + 1e-30;
    }
    *right = 100 * (double)same / (double)(k * queries);
    return 1e6 * best / (double)queries;
}

/* Print a row of the table; false if an exact method finds other distances. */
static bool compare(int cloud)
{
    bool same = true;
    for (size_t i = 0; i < points; i++)
        cloud_point(cloud, 1, i, position + 3 * i);
    for (size_t i = 0; i < QUERIES; i++)
        cloud_point(cloud, 2, i, query + 3 * i);
    queries = QUERIES;
    printf("| %s | %zu | %.2g, ", clouds[cloud], points, build(BATCH));
    printf("%.2g |", build(FLANN));
    point_tree_nearest_all(tree, number_floats(query), queries, K, false, found, true_d2, NULL);
    for (int way = 0; way < WAYS; way++) {
        double us[2], right[2];
        if (way == APPROXIMATE) {
            flann_free_index_float(flann, &parameters);
            if (points > APPROXIMATE_MAX) {
                printf(" |");
                continue;
            }
            build(way);
        }
        if (way == BRUTE && BRUTE_PAIRS / points < QUERIES)
            queries = BRUTE_PAIRS / points;
        for (int i = 0; i < 2; i++)
            us[i] = measure(way, i == 0 ? 1 : K, &right[i]);
        printf(" %.2f, %.2f", us[0], us[1]);
        if (way == APPROXIMATE) {
            printf(" (%.1f, %.1f)", right[0], right[1]);
            flann_free_index_float(flann, &parameters);
        } else
            same = same && right[0] == 100 && right[1] == 100;
        printf(" |");
    }
    printf("\n");
    point_tree_free(tree);
    return same;
}

int main(int count, char **words)
{
    const size_t most = count > 1 ? strtoull(words[1], NULL, 10) : APPROXIMATE_MAX;
    bool same = true;
    position = malloc(3 * most * sizeof *position);
    if (position == NULL)
        return EXIT_FAILURE;
    parallel_set_threads(1);
    printf(
        "| cloud | points | build, s: gbtrace, FLANN | gbtrace, batch | one by one | FLANN, exact | FLANN, "
        "%d checks (right, %%) | brute force |\n|---|---|---|---|---|---|---|---|\n",
        (int)CHECKS);
    for (int cloud = 0; cloud < 3; cloud++)
        for (points = 10000; points <= most; points *= 10)
            same = compare(cloud) && same;
    free(position);
    if (!same)
        fprintf(stderr, "distances differ\n");
    return same ? EXIT_SUCCESS : EXIT_FAILURE;
}
