/* SPDX-License-Identifier: Apache-2.0 */
/* gb/joint.c -- position and colour of points as joint vectors of six numbers: moments, principal axis,
   coding length. */
#include "gb/joint.h"

#include <math.h>
#include <string.h>

#include "base/symmetric.h"

void joint_of(const joint_space *space, const cloud_point *point, double y[JOINT_DIM])
{
    for (int k = 0; k < 3; k++) {
        y[k] = (double)point->position[k] / space->position_unit;
        y[3 + k] = space->color != NULL
                       ? (double)space->color[3 * (size_t)point->index + (size_t)k] / space->color_unit
                       : 0.0;
    }
}

void joint_compute(const joint_space *space, const cloud_point *points, size_t count, joint_moments *out)
{
    double first[JOINT_DIM], y[JOINT_DIM], sum[JOINT_DIM] = {0};
    joint_of(space, &points[0], first);
    for (size_t i = 1; i < count; i++) {
        joint_of(space, &points[i], y);
        for (int k = 0; k < JOINT_DIM; k++)
            sum[k] += y[k] - first[k];
    }
    for (int k = 0; k < JOINT_DIM; k++)
        out->mean[k] = first[k] + sum[k] / (double)count;
    memset(out->covariance, 0, sizeof out->covariance);
    for (size_t i = 0; i < count; i++) {
        joint_of(space, &points[i], y);
        for (int k = 0; k < JOINT_DIM; k++) {
            y[k] -= out->mean[k];
            for (int l = 0; l <= k; l++)
                out->covariance[k][l] += y[k] * y[l];
        }
    }
    for (int k = 0; k < JOINT_DIM; k++)
        for (int l = 0; l <= k; l++)
            out->covariance[l][k] = out->covariance[k][l] /= (double)count;
}

void joint_axis(const joint_moments *m, double axis[JOINT_DIM])
{
    double a[JOINT_DIM][JOINT_DIM], v[JOINT_DIM][JOINT_DIM];
    memcpy(a, m->covariance, sizeof a);
    symmetric_eigen(&a[0][0], &v[0][0], JOINT_DIM, 1e-15);
    int best = 0, decides = 0;
    for (int k = 1; k < JOINT_DIM; k++)
        if (a[k][k] > a[best][best])
            best = k;
    double size = 0;
    for (int k = 0; k < JOINT_DIM; k++)
        size = fmax(size, fabs(v[k][best]));
    while (fabs(v[decides][best]) < (1 - 1e-9) * size)
        decides++;
    const double sign = v[decides][best] < 0 ? -1.0 : 1.0;
    for (int k = 0; k < JOINT_DIM; k++)
        axis[k] = sign * v[k][best];
}

double joint_nats(const joint_moments *m, size_t count)
{
    double widened[JOINT_DIM][JOINT_DIM], l[JOINT_DIM][JOINT_DIM], sum = 0;
    memcpy(widened, m->covariance, sizeof widened);
    for (int k = 0; k < JOINT_DIM; k++)
        widened[k][k] += 1.0;
    symmetric_cholesky(&widened[0][0], &l[0][0], JOINT_DIM, 1.0); /* in exact arithmetic I + C >= I; rounding
                                                                     can break this for collinear sets, so
                                                                     pivots are raised to 1 */
    for (int k = 0; k < JOINT_DIM; k++)
        sum += log(l[k][k]);
    return (double)count * sum;
}
