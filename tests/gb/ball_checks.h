/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/ball_checks.h -- what holds for balls however they were found, and a hash of all their bits. */
#ifndef GBT_TESTS_GB_BALL_CHECKS_H
#define GBT_TESTS_GB_BALL_CHECKS_H

#include <float.h>

#include "base/hash.h"
#include "gb/balls.h"
#include "test_support.h"

/** Eq 17 (disjoint and covering), order inside a ball, eqs 19-22 in double from the input; of `def` the depth
    and the floor. */
static inline void check_balls(const balls *b, const float *position, const float *color, size_t count,
                               const balls_def *def)
{
    assert_int_equal(b->point_count, count);
    assert_int_equal(b->first[0], 0);
    assert_int_equal(b->first[b->count], count);
    unsigned char *seen = calloc(count + 1, 1);
    assert_non_null(seen);
    for (size_t j = 0; j < b->count; j++) {
        const size_t begin = b->first[j], end = b->first[j + 1];
        const double n = (double)(end - begin);
        assert_true(begin < end);
        assert_in_range(b->depth[j], 0, def->max_depth);
        double mean[3], tint[3] = {0, 0, 0}, cov[6] = {0}, var[3] = {0, 0, 0};
        const float *origin =
            position + 3 * (size_t)b->member[begin]; /* else a thousand equal points get a mean beside them */
        for (int k = 0; k < 3; k++)
            mean[k] = (double)origin[k];
        for (size_t i = begin; i < end; i++) {
            const uint32_t m = b->member[i];
            assert_true(m < count && !seen[m]);
            seen[m] = 1;
            assert_true(i == begin || b->member[i - 1] < m);
            for (int k = 0; k < 3; k++) {
                mean[k] += ((double)position[3 * m + k] - (double)origin[k]) / n;
                tint[k] += color != NULL ? (double)color[3 * m + k] / n : 0;
            }
        }
        double size = 0;
        for (size_t i = begin; i < end; i++) {
            const uint32_t m = b->member[i];
            double d[3];
            for (int k = 0; k < 3; k++) {
                d[k] = (double)position[3 * m + k] - mean[k];
                const double c = color != NULL ? (double)color[3 * m + k] - tint[k] : 0;
                var[k] += c * c / n;
            }
            cov[0] += d[0] * d[0] / n;
            cov[1] += d[0] * d[1] / n;
            cov[2] += d[0] * d[2] / n;
            cov[3] += d[1] * d[1] / n;
            cov[4] += d[1] * d[2] / n;
            cov[5] += d[2] * d[2] / n;
        }
        size = cov[0] + cov[3] + cov[5];
        const double floor_radius =
            fmax(fmax((double)def->min_scale, 1e-6) * (double)def->voxel_size, (double)def->min_radius);
        const double radius = fmax(sqrt(size), floor_radius);
        if (!(fabs((double)b->radius[j] - radius) <= 1e-5 * radius))
            fail_msg("ball %zu of %g points: radius wanted %.9g, got %.9g", j, n, radius,
                     (double)b->radius[j]);
        for (int k = 0; k < 3; k++) {
            if (!(fabs((double)b->center[3 * j + k] - mean[k]) <= 1e-6 * fabs(mean[k]) + 1e-6 * radius))
                fail_msg("ball %zu: center wanted %.9g, got %.9g", j, mean[k], (double)b->center[3 * j + k]);
            assert_true(fabs((double)b->color[3 * j + k] - tint[k]) <= 1e-5);
        }
        for (int k = 0; k < 6; k++)
            if (!(fabs((double)b->covariance[6 * j + k] - cov[k]) <= 1e-5 * size + (double)FLT_TRUE_MIN))
                fail_msg("ball %zu: covariance %d wanted %.9g, got %.9g", j, k, cov[k],
                         (double)b->covariance[6 * j + k]);
        const double spread = (sqrt(var[0]) + sqrt(var[1]) + sqrt(var[2])) / 3;
        assert_true(fabs((double)b->color_std[j] - spread) <= 1e-5);
    }
    free(seen);
}

static inline uint64_t hash_balls(const balls *b)
{
    uint64_t h = hash_bytes(HASH_START, b->first, (b->count + 1) * sizeof *b->first);
    h = hash_bytes(h, b->member, b->point_count * sizeof *b->member);
    h = hash_bytes(h, b->center, 3 * b->count * sizeof *b->center);
    h = hash_bytes(h, b->radius, b->count * sizeof *b->radius);
    h = hash_bytes(h, b->covariance, 6 * b->count * sizeof *b->covariance);
    h = hash_bytes(h, b->color, 3 * b->count * sizeof *b->color);
    h = hash_bytes(h, b->color_std, b->count * sizeof *b->color_std);
    return hash_bytes(h, b->depth, b->count * sizeof *b->depth);
}

static inline int check_by_index(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/** `b` are the balls of the shuffled cloud: those of `a`, in the same order, where point i of `b` is point
    to[i] of `a`. */
static inline void check_same_partition(const balls *a, const balls *b, const uint32_t *to)
{
    assert_int_equal(a->count, b->count);
    assert_memory_equal(a->first, b->first, (a->count + 1) * sizeof *a->first);
    assert_memory_equal(a->depth, b->depth, a->count * sizeof *a->depth);
    uint32_t *mapped = malloc((a->point_count + 1) * sizeof *mapped);
    assert_non_null(mapped);
    for (size_t i = 0; i < a->point_count; i++)
        mapped[i] = to[b->member[i]];
    for (size_t j = 0; j < a->count; j++) {
        qsort(mapped + b->first[j], b->first[j + 1] - b->first[j], sizeof *mapped, check_by_index);
        assert_true(fabsf(a->radius[j] - b->radius[j]) <= 1e-6f * a->radius[j]);
    }
    assert_memory_equal(mapped, a->member, a->point_count * sizeof *mapped);
    free(mapped);
}

#endif
