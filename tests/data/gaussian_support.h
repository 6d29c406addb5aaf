/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/gaussian_support.h -- random plain Gaussians, and how far a file moved them. */
#ifndef GBT_TEST_GAUSSIAN_SUPPORT_H
#define GBT_TEST_GAUSSIAN_SUPPORT_H

#include "base/rng.h"
#include "data/data_support.h"
#include "gbtrace/progress.h"

static const double nowhere[3] = {0, 0, 0};

static inline float between(uint64_t stream, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(7, stream, index);
}

static inline void make_cloud(gaussian_cloud *c, size_t count, int degree)
{
    assert_ok(gaussian_cloud_alloc(c, count, &assert_ok_err_));
    c->sh_degree = degree;
    for (size_t i = 0; i < count; i++) {
        float square = 0;
        c->opacity[i] = between(1, i, 0.01f, 0.99f);
        for (size_t k = 0; k < 3; k++) {
            c->mean[3 * i + k] = between(2, 3 * i + k, -20, 20);
            c->scale_log[3 * i + k] = between(3, 3 * i + k, -6, 0);
        }
        for (size_t k = 0; k < 4; k++) {
            c->quat[4 * i + k] = (float)rng_normal(7, 4, 4 * i + k);
            square += c->quat[4 * i + k] * c->quat[4 * i + k];
        }
        for (size_t k = 0; k < 4; k++)
            c->quat[4 * i + k] /= sqrtf(square);
        for (size_t k = 0; k < 48; k++)
            c->sh[48 * i + k] =
                k < 3 * (size_t)((degree + 1) * (degree + 1)) ? between(5, 48 * i + k, -0.9f, 0.9f) : 0;
    }
}

/** A listener for gbt_listen(): the last warning, in a char[256]. */
static inline void keep_warning(const gbt_event *event, void *context)
{
    if (event->kind == GBT_EVENT_WARNING)
        snprintf(context, 256, "%s", event->text);
}

/* How far a format may move a value; scales as logs. */
typedef struct limits {
    double mean, scale, quat, opacity, color, harmonics;
} limits;

static inline void check_near(const gaussian_cloud *a, const gaussian_cloud *b, const double origin[3],
                              const limits *l)
{
    assert_int_equal(a->count, b->count);
    assert_true(cloud_is_sound(b));
    for (size_t i = 0; i < a->count; i++) {
        double dot = 0;
        for (size_t k = 0; k < 3; k++) {
            assert_true(fabs((double)a->mean[3 * i + k] + origin[k] - (double)b->mean[3 * i + k] -
                             b->origin[k]) <= l->mean);
            assert_true(fabs((double)a->scale_log[3 * i + k] - (double)b->scale_log[3 * i + k]) <= l->scale);
            assert_true(fabs((double)a->sh[48 * i + k] - (double)b->sh[48 * i + k]) <= l->color);
        }
        for (size_t k = 0; k < 4; k++)
            dot += (double)a->quat[4 * i + k] * (double)b->quat[4 * i + k];
        assert_true(1 - fabs(dot) <= l->quat);
        assert_true(fabs((double)a->opacity[i] - (double)b->opacity[i]) <= l->opacity);
        for (size_t k = 3; k < 48; k++)
            assert_true(fabs((double)a->sh[48 * i + k] - (double)b->sh[48 * i + k]) <= l->harmonics);
    }
}

/** Put the Gaussians of `b` into the order of `a`: each goes to the nearest mean, one to one. For formats
   that sort. */
static inline void match_order(const gaussian_cloud *a, gaussian_cloud *b, const double origin[3])
{
    gaussian_cloud out;
    assert_ok(gaussian_cloud_alloc(&out, a->count, &assert_ok_err_));
    assert_int_equal(a->count, b->count);
    unsigned char *taken = calloc(a->count, 1);
    for (size_t j = 0; j < b->count; j++) {
        size_t best = 0;
        double least = INFINITY;
        for (size_t i = 0; i < a->count; i++) {
            double square = 0;
            for (size_t k = 0; k < 3; k++)
                square += pow((double)a->mean[3 * i + k] + origin[k] - (double)b->mean[3 * j + k], 2);
            best = square < least ? i : best;
            least = fmin(least, square);
        }
        assert_false(taken[best]);
        taken[best] = 1;
        memcpy(out.mean + 3 * best, b->mean + 3 * j, 3 * sizeof(float));
        memcpy(out.scale_log + 3 * best, b->scale_log + 3 * j, 3 * sizeof(float));
        memcpy(out.quat + 4 * best, b->quat + 4 * j, 4 * sizeof(float));
        memcpy(out.sh + 48 * best, b->sh + 48 * j, 48 * sizeof(float));
        out.opacity[best] = b->opacity[j];
    }
    free(taken);
    out.sh_degree = b->sh_degree;
    out.antialiased = b->antialiased;
    gaussian_cloud_free(b);
    *b = out;
}

#endif
