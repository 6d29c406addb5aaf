/* gb/joint.c -- position and colour of a set of points as one vector of six: moments, principal axis, length of its description. */
#include "gb/joint.h"

#include <math.h>
#include <string.h>

void joint_of(const joint_space *space, const cloud_point *point, double y[JOINT_DIM])
{
    for (int k = 0; k < 3; k++) {
        y[k] = (double)point->position[k] / space->position_unit;
        y[3 + k] = space->color != NULL ? (double)space->color[3 * (size_t)point->index + (size_t)k] / space->color_unit : 0.0;
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

/* One Jacobi rotation that makes a[p][q] zero; `v` collects the rotations in its columns. */
static void rotate(double a[JOINT_DIM][JOINT_DIM], double v[JOINT_DIM][JOINT_DIM], int p, int q)
{
    if (a[p][q] == 0)
        return;
    const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    const double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < JOINT_DIM; k++) {
        const double kp = a[k][p], kq = a[k][q], vp = v[k][p], vq = v[k][q];
        a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        v[k][p] = c * vp - s * vq, v[k][q] = s * vp + c * vq;
    }
    for (int k = 0; k < JOINT_DIM; k++) {
        const double pk = a[p][k], qk = a[q][k];
        a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
    }
    a[p][q] = a[q][p] = 0;
}

static double off_diagonal(double a[JOINT_DIM][JOINT_DIM])
{
    double sum = 0;
    for (int k = 0; k < JOINT_DIM; k++)
        for (int l = 0; l < k; l++)
            sum += fabs(a[k][l]);
    return sum;
}

void joint_axis(const joint_moments *m, double axis[JOINT_DIM])
{
    double a[JOINT_DIM][JOINT_DIM], v[JOINT_DIM][JOINT_DIM] = {{0}}, largest = 0;
    for (int k = 0; k < JOINT_DIM; k++)
        largest = fmax(largest, m->covariance[k][k]);
    const double unit = largest > 0 ? largest : 1; /* thresholds below are then relative */
    for (int k = 0; k < JOINT_DIM; k++) {
        v[k][k] = 1;
        for (int l = 0; l < JOINT_DIM; l++)
            a[k][l] = m->covariance[k][l] / unit;
    }
    for (int sweep = 0; sweep < 32 && off_diagonal(a) > 1e-15; sweep++)
        for (int p = 0; p < JOINT_DIM; p++)
            for (int q = p + 1; q < JOINT_DIM; q++)
                rotate(a, v, p, q);
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
    double l[JOINT_DIM][JOINT_DIM], sum = 0;
    for (int i = 0; i < JOINT_DIM; i++)
        for (int j = 0; j <= i; j++) { /* Cholesky */
            double value = m->covariance[i][j] + (i == j ? 1.0 : 0.0);
            for (int k = 0; k < j; k++)
                value -= l[i][k] * l[j][k];
            if (i != j) {
                l[i][j] = value / l[j][j];
                continue;
            }
            value = fmax(value, 1.0); /* what is left of I + C is at least I; sets of one line lose that to rounding */
            l[i][i] = sqrt(value);
            sum += log(value);
        }
    return 0.5 * (double)count * sum;
}
