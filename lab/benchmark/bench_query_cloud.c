/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_query_cloud.c -- clouds on which queries are measured, and the names of what is compared.
 */
#include <math.h>

#include "base/rng.h"
#include "benchmark/bench_query.h"

const char *const query_cloud_names[QUERY_CLOUDS] = {"random", "surface", "sparse"};

const char *query_engine_name(query_engine engine)
{
    static const char *const names[ENGINE_COUNT] = {"batch", "single", "flann", "flann-approximate", "brute"};
    return names[engine];
}

void query_cloud_point(int cloud, uint64_t seed, size_t i, double out[3])
{
    for (uint64_t j = 0; j < 3; j++)
        out[j] = cloud == 0 ? 2 * (double)rng_uniform(seed, j, i) - 1 : rng_normal(seed, j, i);
    if (cloud == 0)
        return;
    const double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]) + 1e-9;
    double radius = 1 + 0.1 * sin(5 * out[0] / length) * cos(4 * out[1] / length);
    if (cloud == 1) /* a surface, and a little noise on it */
        radius += 0.002 * rng_normal(seed, 3, i);
    else /* as from photos: densities over orders of magnitude, and outliers */
        radius *= exp(1.5 * rng_normal(seed, 3, i)) * (i % 100 == 0 ? 30 : 1);
    for (int j = 0; j < 3; j++)
        out[j] *= radius / length;
}
