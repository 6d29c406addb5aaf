/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gaussians_support.h -- Gaussians by field, random ones, and those of a file. */
#ifndef GBT_TEST_GAUSSIANS_SUPPORT_H
#define GBT_TEST_GAUSSIANS_SUPPORT_H

#include "test_support.h"

#include "base/gaussians.h"
#include "base/rng.h"
#include "data/gaussian_cloud.h"

enum { FIELD_MEAN = 0, FIELD_SCALE = 3, FIELD_QUAT = 6, FIELD_OPACITY = 10, FIELD_COLOR = 11 };

/** The arrays in the order of base/gaussians.h. */
static inline void field_list(const gaussians *g, float *fields[GAUSSIANS_FIELD_COUNT])
{
    size_t i = 0;
#define X(name, pad, meaning) fields[i++] = g->name;
    GAUSSIANS_FIELDS(X)
#undef X
}

/** Means are normal, with the std-dev `spread`; scales log-uniform; opacities from 0.02. The x axis is
    divided by `flatness`, and y too for odd ids: discs and needles. */
static inline gaussians scattered_gaussians(size_t count, float spread, float scale_low, float scale_high,
                                            float flatness, float opacity_high, uint64_t seed)
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, count, NULL));
    float *f[GAUSSIANS_FIELD_COUNT];
    field_list(&g, f);
    for (size_t i = 0; i < count; i++) {
        double q[4], square = 0;
        for (uint64_t k = 0; k < 3; k++) {
            f[FIELD_MEAN + k][i] = (float)((double)spread * rng_normal(seed, k, i));
            f[FIELD_SCALE + k][i] = scale_low * powf(scale_high / scale_low, rng_uniform(seed, 3 + k, i));
            f[FIELD_COLOR + k][i] = rng_uniform(seed, 11 + k, i);
        }
        f[FIELD_SCALE][i] /= flatness;
        f[FIELD_SCALE + 1][i] /= i % 2 == 1 ? flatness : 1;
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(seed, 6 + k, i);
            square += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            f[FIELD_QUAT + k][i] = (float)(q[k] * (1 / sqrt(square)));
        g.opacity[i] = 0.02f + (opacity_high - 0.02f) * rng_uniform(seed, 10, i);
    }
    gaussians_pad(&g);
    return g;
}

/** Those of a 3DGS file, larger by `scale`; colours of degree 0. */
static inline gaussians gaussians_of_cloud(const gaussian_cloud *cloud, float scale)
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, cloud->count, NULL));
    float *f[GAUSSIANS_FIELD_COUNT];
    field_list(&g, f);
    for (size_t i = 0; i < cloud->count; i++) {
        for (size_t k = 0; k < 3; k++) {
            f[FIELD_MEAN + k][i] = scale * cloud->mean[3 * i + k];
            f[FIELD_SCALE + k][i] = scale * expf(cloud->scale_log[3 * i + k]);
            f[FIELD_COLOR + k][i] = fmaxf(0, 0.5f + 0.28209479f * cloud->sh[i * GAUSSIAN_SH_COUNT * 3 + k]);
        }
        for (size_t k = 0; k < 4; k++)
            f[FIELD_QUAT + k][i] = cloud->quat[4 * i + k];
        g.opacity[i] = cloud->opacity[i];
    }
    gaussians_pad(&g);
    return g;
}

#endif
