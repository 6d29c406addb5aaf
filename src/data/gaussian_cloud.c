/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_cloud.c -- allocates, checks and normalises plain Gaussians. */
#include "data/gaussian_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/raw.h"

#define VALUE_LIMIT 1e18 /* values up to this have squares that fit a float */

gbt_status gaussian_cloud_alloc(gaussian_cloud *cloud, size_t count, gbt_error *err)
{
    *cloud = (gaussian_cloud){.count = count};
    cloud->mean = mem_alloc(count, 3 * sizeof(float), "Gaussian means", err);
    cloud->scale_log = mem_alloc(count, 3 * sizeof(float), "Gaussian scales", err);
    cloud->quat = mem_alloc(count, 4 * sizeof(float), "Gaussian rotations", err);
    cloud->opacity = mem_alloc(count, sizeof(float), "Gaussian opacities", err);
    cloud->sh = mem_alloc(count, GAUSSIAN_SH_COUNT * 3 * sizeof(float), "Gaussian colours", err);
    if (cloud->mean != NULL && cloud->scale_log != NULL && cloud->quat != NULL && cloud->opacity != NULL &&
        cloud->sh != NULL)
        return GBT_OK;
    gaussian_cloud_free(cloud);
    return GBT_ERR_NO_MEMORY;
}

void gaussian_cloud_free(gaussian_cloud *cloud)
{
    mem_free(cloud->mean);
    mem_free(cloud->scale_log);
    mem_free(cloud->quat);
    mem_free(cloud->opacity);
    mem_free(cloud->sh);
    memset(cloud, 0, sizeof *cloud);
}

static bool all_within(const double *values, size_t count, double limit)
{
    for (size_t k = 0; k < count; k++)
        if (!(fabs(values[k]) <= limit))
            return false;
    return true;
}

static double limited_log(double scale_log) { return fmax(scale_log, -GAUSSIAN_SCALE_LOG_LIMIT); }

void gaussian_cloud_add(gaussian_cloud *out, const gaussian_row *row)
{
    const double *log_scale = row->scale_log, largest = fmax(log_scale[0], fmax(log_scale[1], log_scale[2]));
    const bool no_scale = isnan(log_scale[0]) || isnan(log_scale[1]) || isnan(log_scale[2]);
    if (!all_within(row->mean, 3, RAW_COORDINATE_LIMIT) || no_scale || largest > GAUSSIAN_SCALE_LOG_LIMIT ||
        !all_within(row->quat, 4, VALUE_LIMIT) || isnan(row->opacity) ||
        !all_within(&row->sh[0][0], GAUSSIAN_SH_COUNT * 3, VALUE_LIMIT)) {
        out->dropped++;
        return;
    }
    const size_t i = out->count++;
    bool clamped = false;
    const double least = limited_log(limited_log(largest) - log(GAUSSIAN_SCALE_RATIO));
    for (size_t k = 0; k < 3; k++) {
        clamped = clamped || log_scale[k] < least;
        out->scale_log[3 * i + k] = (float)fmax(log_scale[k], least);
        out->mean[3 * i + k] = (float)row->mean[k];
    }
    out->scales_clamped += clamped;
    out->opacity[i] = (float)fmin(fmax(row->opacity, 0), 1);
    const double *q = row->quat;
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const bool has_rotation = norm > 1e-30;
    out->identity_rotations += !has_rotation;
    for (size_t k = 0; k < 4; k++)
        out->quat[4 * i + k] = has_rotation ? (float)(q[k] / norm) : k == 0 ? 1.0f : 0.0f;
    for (size_t k = 0; k < GAUSSIAN_SH_COUNT * 3; k++)
        out->sh[i * GAUSSIAN_SH_COUNT * 3 + k] = (float)row->sh[k / 3][k % 3];
}

bool gaussian_limit_scales(float scale_log[3])
{
    const float least =
        fmaxf(scale_log[0], fmaxf(scale_log[1], scale_log[2])) - (float)log(GAUSSIAN_SCALE_RATIO);
    bool changed = false;
    for (int k = 0; k < 3; k++) {
        changed = changed || scale_log[k] < least;
        scale_log[k] = fmaxf(scale_log[k], least);
    }
    return changed;
}

void gaussian_middle(const float *mean, size_t count, const double low[3], const double high[3],
                     double middle[3])
{
    enum { SAMPLE = 1024 };
    const size_t taken = count < SAMPLE ? count : SAMPLE;
    for (size_t k = 0; k < 3; k++) {
        float sample[SAMPLE];
        middle[k] = 0.5 * (low[k] + high[k]);
        for (size_t i = 0; i < taken; i++)
            sample[i] = mean[3 * (i * count / taken) + k];
        if (taken == 0)
            continue;
        qsort(sample, taken, sizeof *sample, compare_floats);
        middle[k] = fmin(fmax(middle[k], (double)sample[taken / 4]), (double)sample[taken - 1 - taken / 4]);
    }
}

float gaussian_cloud_near(double stored) { return stored > 0 && stored < 1e30 ? (float)stored : 0; }

void gaussian_cloud_warn(const gaussian_cloud *cloud, const char *name)
{
    if (cloud->dropped + cloud->identity_rotations + cloud->scales_clamped == 0)
        return;
    log_warn("%s: of %zu Gaussians %zu were left out (a value is not usable), %zu have no rotation (all "
             "zero: read as "
             "none), %zu a scale below 1/%g of their largest (raised to it)",
             name, cloud->count + cloud->dropped, cloud->dropped, cloud->identity_rotations,
             cloud->scales_clamped, GAUSSIAN_SCALE_RATIO);
}
