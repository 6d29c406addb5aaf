/* SPDX-License-Identifier: Apache-2.0 */
/* trace/pose_gradient.c -- the sums of pose_gradient.h: the gradient of a mean acts as a force; with that of
   the rotation it gives a torque about the camera's centre. */
#include "trace/pose_gradient.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { SUM_BLOCK = 2048 };

typedef struct sum_job {
    const gaussians *g, *d;
    const double *center;
    double (*sums)[6]; /* per block: force, torque about the centre */
} sum_job;

static void sum_block(size_t block, size_t begin, size_t end, void *context)
{
    const sum_job *job = context;
    const gaussians *g = job->g, *d = job->d;
    double *sum = job->sums[block];
    for (size_t i = begin; i < end; i++) {
        const double force[3] = {(double)d->mean_x[i], (double)d->mean_y[i], (double)d->mean_z[i]};
        const double mean[3] = {(double)g->mean_x[i], (double)g->mean_y[i], (double)g->mean_z[i]};
        const double arm[3] = {mean[0] - job->center[0], mean[1] - job->center[1], mean[2] - job->center[2]};
        const double qw = (double)g->quat_w[i],
                     q[3] = {(double)g->quat_x[i], (double)g->quat_y[i], (double)g->quat_z[i]};
        const double dw = (double)d->quat_w[i],
                     dq[3] = {(double)d->quat_x[i], (double)d->quat_y[i], (double)d->quat_z[i]};
        double turn[3], spin[3];
        dvec_cross(arm, force, turn);
        dvec_cross(dq, q, spin);
        for (int k = 0; k < 3; k++) {
            sum[k] += force[k];
            sum[3 + k] += turn[k] + 0.5 * (qw * dq[k] - dw * q[k] - spin[k]);
        }
    }
}

gbt_status pose_gradient(const gaussians *g, const gaussians *d, const gbt_camera *camera,
                         const double eye[3], const double d_eye[3], double out[6], gbt_error *err)
{
    const size_t blocks = parallel_block_count(g->count, SUM_BLOCK);
    sum_job job = {g, d, camera->center, mem_calloc(blocks, sizeof *job.sums, "pose gradient", err)};
    if (job.sums == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(g->count, SUM_BLOCK, sum_block, &job);
    double sum[6] = {0}, arm[3], by_eye[3];
    for (size_t b = 0; b < blocks; b++)
        for (int k = 0; k < 6; k++)
            sum[k] += job.sums[b][k];
    mem_free(job.sums);
    for (int k = 0; k < 3; k++)
        arm[k] = eye[k] - camera->center[k];
    dvec_cross(arm, d_eye, by_eye);
    for (int k = 0; k < 3; k++) {
        sum[k] = d_eye[k] - sum[k];
        sum[3 + k] = by_eye[k] - sum[3 + k];
    }
    dmat_apply(camera->rotation, sum, out);
    dmat_apply(camera->rotation, sum + 3, out + 3);
    return GBT_OK;
}
