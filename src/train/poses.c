/* SPDX-License-Identifier: Apache-2.0 */
/* train/poses.c -- the photos' poses and their optimizer. */
#include "train/poses.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/vec.h"
#include "train/adam.h"
#include "train/gradient_check.h"
#include "train/schedule.h"

gbt_status poses_make(poses *p, const scene *s, size_t count, double unit, gbt_error *err)
{
    p->given = mem_alloc(s->view_count, sizeof *p->given, "poses", err);
    p->packed = mem_alloc(s->view_count, POSE_PACKED * sizeof *p->packed, "poses", err);
    p->moment1 = mem_calloc(count, POSE_NUMBERS * sizeof *p->moment1, "poses", err);
    p->moment2 = mem_calloc(count, POSE_NUMBERS * sizeof *p->moment2, "poses", err);
    p->visits = mem_calloc(count, sizeof *p->visits, "poses", err);
    if (p->given == NULL || p->packed == NULL || p->moment1 == NULL || p->moment2 == NULL ||
        p->visits == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < s->view_count; i++)
        p->given[i] = s->views[i].camera;
    p->unit = unit;
    p->count = count;
    return GBT_OK;
}

void poses_free(poses *p)
{
    mem_free(p->given);
    mem_free(p->packed);
    mem_free(p->moment1);
    mem_free(p->moment2);
    mem_free(p->visits);
    *p = (poses){0};
}

void pose_learn(float *moment1, float *moment2, const double gradient[POSE_NUMBERS], double unit,
                uint64_t age, double rate, double motion[POSE_NUMBERS])
{
    float step[POSE_NUMBERS] = {0}, g[POSE_NUMBERS];
    for (int k = 0; k < POSE_NUMBERS; k++)
        g[k] = (float)(k < 3 ? unit * gradient[k] : gradient[k]);
    adam_step(step, g, moment1, moment2, POSE_NUMBERS, adam_rates_at(rate, age));
    for (int k = 0; k < POSE_NUMBERS; k++)
        motion[k] = k < 3 ? unit * (double)step[k] : (double)step[k];
}

const gbt_camera *poses_given(const poses *p, const scene *s, size_t view)
{
    return p->count > 0 ? &p->given[view] : &s->views[view].camera;
}

bool pose_is_finite(const double gradient[POSE_NUMBERS])
{
    double sum = 0;
    for (int k = 0; k < POSE_NUMBERS; k++)
        sum += fabs(gradient[k]);
    return sum <= (double)GRADIENT_LIMIT;
}

/* Move a camera by a motion given in world axes. */
static void move_by(gbt_camera *camera, const double move[3], const double turn[3])
{
    double motion[POSE_NUMBERS];
    dmat_apply(camera->rotation, move, motion);
    dmat_apply(camera->rotation, turn, motion + 3);
    *camera = gbt_camera_moved(camera, motion);
}

void poses_step(poses *p, scene *s, const size_t *train_views, size_t index,
                const double gradient[POSE_NUMBERS], double rate)
{
    gbt_camera *camera = &s->views[train_views[index]].camera;
    const size_t first = index * POSE_NUMBERS;
    double motion[POSE_NUMBERS], move[3], turn[3];
    pose_learn(p->moment1 + first, p->moment2 + first, gradient, p->unit, ++p->visits[index], rate, motion);
    dmat_apply_transposed(camera->rotation, motion, move);
    dmat_apply_transposed(camera->rotation, motion + 3, turn);
    *camera = gbt_camera_moved(camera, motion);
    for (int k = 0; k < 3; k++) {
        move[k] /= -(double)p->count;
        turn[k] /= -(double)p->count;
    }
    for (size_t i = 0; i < p->count; i++)
        move_by(&s->views[train_views[i]].camera, move, turn);
}

double poses_rate(size_t count, double progress, double step)
{
    const double begin = 0.03, way = 0.04, most = 0.002, last = 0.05, mean = 0.32; /* mean of last^progress
                                                                                      over a run */
    if (progress < begin)
        return 0;
    const double cool = fmin((1 - progress) / (1 - SCHEDULE_COOL_FROM), 1); /* like all learning rates */
    return fmin(way / mean * (double)count * step, most) * exp(progress * log(last)) * fmax(cool, 0);
}

void poses_pack(const poses *p, const scene *s)
{
    for (size_t i = 0; i < s->view_count; i++) {
        memcpy(p->packed + i * POSE_PACKED, s->views[i].camera.rotation, 9 * sizeof(double));
        memcpy(p->packed + i * POSE_PACKED + 9, s->views[i].camera.center, 3 * sizeof(double));
    }
}

void poses_unpack(const poses *p, scene *s)
{
    for (size_t i = 0; i < s->view_count; i++) {
        if (s->views[i].is_test)
            continue;
        memcpy(s->views[i].camera.rotation, p->packed + i * POSE_PACKED, 9 * sizeof(double));
        memcpy(s->views[i].camera.center, p->packed + i * POSE_PACKED + 9, 3 * sizeof(double));
    }
}

/* Angle of the rotation from one camera to another. */
static double angle_between(const gbt_camera *a, const gbt_camera *b)
{
    double square = 0; /* |A - B|^2 = 8 sin^2(angle / 2) */
    for (int k = 0; k < 9; k++)
        square += (a->rotation[k] - b->rotation[k]) * (a->rotation[k] - b->rotation[k]);
    return 2 * asin(fmin(sqrt(square / 8), 1));
}

gbt_status poses_moved(const poses *p, const scene *s, const size_t *views, size_t count, double *angle,
                       double *distance, gbt_error *err)
{
    double *values = mem_alloc(2 * count, sizeof *values, "poses", err);
    if (values == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++) {
        const gbt_camera *now = &s->views[views[i]].camera, *given = &p->given[views[i]];
        double way[3];
        for (int k = 0; k < 3; k++)
            way[k] = now->center[k] - given->center[k];
        values[i] = angle_between(now, given);
        values[count + i] = dvec_length(way);
    }
    qsort(values, count, sizeof *values, compare_doubles);
    qsort(values + count, count, sizeof *values, compare_doubles);
    *angle = values[count / 2];
    *distance = values[count + count / 2];
    mem_free(values);
    return GBT_OK;
}
