/* SPDX-License-Identifier: Apache-2.0 */
/* frame/plain.c -- view-dependent colours from spherical harmonics, and their adjoint. */
#include "frame/plain.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "base/sh.h"

enum { BLOCK = 2048, SH = GAUSSIAN_SH_COUNT * 3 };

typedef struct plain_job {
    const gaussian_cloud *cloud;
    const float *eye;
    const uint32_t *visible;
    gaussians *out;
    const gaussians *seen, *d_seen;
    gaussian_cloud *d_cloud;
} plain_job;

/* Spherical harmonics at the direction from the eye to Gaussian `from`. */
static void basis_of(const plain_job *job, size_t from, float y[GAUSSIAN_SH_COUNT])
{
    double d[3], square = 0;
    for (size_t k = 0; k < 3; k++) {
        d[k] = (double)job->cloud->mean[3 * from + k] - (double)job->eye[k];
        square += d[k] * d[k];
    }
    const double length = square > 0 ? sqrt(square) : 1;
    sh_basis((const float[3]){(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)}, y);
}

static void see_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const plain_job *job = context;
    const gaussian_cloud *cloud = job->cloud;
    gaussians *g = job->out;
    const int functions = sh_count(cloud->sh_degree);
    for (size_t i = begin; i < end; i++) {
        const size_t from = job->visible[i];
        const float *m = cloud->mean + 3 * from, *q = cloud->quat + 4 * from,
                    *l = cloud->scale_log + 3 * from, *sh = cloud->sh + from * SH;
        float y[GAUSSIAN_SH_COUNT], color[3] = {0.5f, 0.5f, 0.5f};
        basis_of(job, from, y);
        for (int k = 0; k < functions; k++)
            for (int c = 0; c < 3; c++)
                color[c] += y[k] * sh[3 * k + c];
        g->mean_x[i] = m[0];
        g->mean_y[i] = m[1];
        g->mean_z[i] = m[2];
        g->scale_x[i] = expf(l[0]);
        g->scale_y[i] = expf(l[1]);
        g->scale_z[i] = expf(l[2]);
        g->quat_w[i] = q[0];
        g->quat_x[i] = q[1];
        g->quat_y[i] = q[2];
        g->quat_z[i] = q[3];
        g->opacity[i] = cloud->opacity[from];
        g->red[i] = fmaxf(color[0], 0);
        g->green[i] = fmaxf(color[1], 0);
        g->blue[i] = fmaxf(color[2], 0);
    }
}

gbt_status plain_forward(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible,
                         size_t count, gaussians *out, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, count, err));
    plain_job job = {.cloud = cloud, .eye = eye, .visible = visible, .out = out};
    parallel_blocks(count, BLOCK, see_block, &job);
    gaussians_pad(out);
    return GBT_OK;
}

static void back_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const plain_job *job = context;
    const gaussians *g = job->seen, *d = job->d_seen;
    gaussian_cloud *out = job->d_cloud;
    const int functions = sh_count(job->cloud->sh_degree);
    for (size_t i = begin; i < end; i++) {
        const size_t to = job->visible[i];
        const float d_color[3] = {g->red[i] > 0 ? d->red[i] : 0, g->green[i] > 0 ? d->green[i] : 0,
                                  g->blue[i] > 0 ? d->blue[i] : 0};
        float y[GAUSSIAN_SH_COUNT], *sh = out->sh + to * SH, *scale = out->scale_log + 3 * to,
                                    *quat = out->quat + 4 * to;
        basis_of(job, to, y);
        for (int k = 0; k < functions; k++)
            for (int c = 0; c < 3; c++)
                sh[3 * k + c] = y[k] * d_color[c];
        scale[0] = d->scale_x[i] * g->scale_x[i];
        scale[1] = d->scale_y[i] * g->scale_y[i];
        scale[2] = d->scale_z[i] * g->scale_z[i];
        quat[0] = d->quat_w[i];
        quat[1] = d->quat_x[i];
        quat[2] = d->quat_y[i];
        quat[3] = d->quat_z[i];
        out->opacity[to] = d->opacity[i];
    }
}

void plain_backward(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible, size_t count,
                    const gaussians *seen, const gaussians *d_seen, gaussian_cloud *d_cloud)
{
    const size_t n = cloud->count;
    memset(d_cloud->scale_log, 0, 3 * n * sizeof *d_cloud->scale_log);
    memset(d_cloud->quat, 0, 4 * n * sizeof *d_cloud->quat);
    memset(d_cloud->opacity, 0, n * sizeof *d_cloud->opacity);
    memset(d_cloud->sh, 0, n * SH * sizeof *d_cloud->sh);
    plain_job job = {
        .cloud = cloud, .eye = eye, .visible = visible, .seen = seen, .d_seen = d_seen, .d_cloud = d_cloud};
    parallel_blocks(count, BLOCK, back_block, &job);
}
