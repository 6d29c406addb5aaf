/* SPDX-License-Identifier: Apache-2.0 */
/* frame/plain_view.c -- adjoint of the spherical harmonics with respect to means and eye. */
#include "frame/plain_view.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "base/sh.h"

enum { BLOCK = 2048, SH = GAUSSIAN_SH_COUNT * 3 };

typedef struct view_job {
    const gaussian_cloud *cloud;
    const float *eye;
    const uint32_t *visible;
    const gaussians *seen, *d_seen;
    float *d_mean;
    double (*d_eye)[3]; /* per block */
} view_job;

/* dL/dmean through the colour of the i-th visible Gaussian. */
static void color_backward(const view_job *job, size_t i, double out[3])
{
    const gaussians *g = job->seen, *d = job->d_seen;
    const size_t from = job->visible[i];
    const float d_color[3] = {g->red[i] > 0 ? d->red[i] : 0, g->green[i] > 0 ? d->green[i] : 0,
                              g->blue[i] > 0 ? d->blue[i] : 0};
    const float *sh = job->cloud->sh + from * SH;
    const int functions = sh_count(job->cloud->sh_degree);
    double way[3], d_dir[3] = {0, 0, 0};
    for (size_t k = 0; k < 3; k++) {
        way[k] = (double)job->cloud->mean[3 * from + k] - (double)job->eye[k];
        out[k] = 0;
    }
    const double length = dvec_length(way);
    if (!(length > 0) || functions == 1)
        return;
    dvec_normalize(way);
    float slope[GAUSSIAN_SH_COUNT][3];
    sh_basis_gradient((const float[3]){(float)way[0], (float)way[1], (float)way[2]}, slope);
    for (int f = 0; f < functions; f++) {
        const double weight =
            (double)(sh[3 * f] * d_color[0] + sh[3 * f + 1] * d_color[1] + sh[3 * f + 2] * d_color[2]);
        for (int k = 0; k < 3; k++)
            d_dir[k] += weight * (double)slope[f][k];
    }
    const double along = dvec_dot(d_dir, way);
    for (int k = 0; k < 3; k++)
        out[k] = (d_dir[k] - along * way[k]) / length;
}

static void view_block(size_t block, size_t begin, size_t end, void *context)
{
    const view_job *job = context;
    const gaussians *d = job->d_seen;
    for (size_t i = begin; i < end; i++) {
        double by_color[3];
        color_backward(job, i, by_color);
        for (int k = 0; k < 3; k++)
            job->d_eye[block][k] -= by_color[k];
        if (job->d_mean == NULL)
            continue;
        float *to = job->d_mean + 3 * (size_t)job->visible[i];
        to[0] = (float)((double)d->mean_x[i] + by_color[0]);
        to[1] = (float)((double)d->mean_y[i] + by_color[1]);
        to[2] = (float)((double)d->mean_z[i] + by_color[2]);
    }
}

gbt_status plain_backward_view(const gaussian_cloud *cloud, const float eye[3], const uint32_t *visible,
                               size_t count, const gaussians *seen, const gaussians *d_seen, float *d_mean,
                               double d_eye[3], gbt_error *err)
{
    const size_t blocks = parallel_block_count(count, BLOCK);
    view_job job = {
        cloud, eye, visible, seen, d_seen, d_mean, mem_calloc(blocks, sizeof *job.d_eye, "gradient", err)};
    if (job.d_eye == NULL)
        return GBT_ERR_NO_MEMORY;
    if (d_mean != NULL)
        memset(d_mean, 0, 3 * cloud->count * sizeof *d_mean);
    parallel_blocks(count, BLOCK, view_block, &job);
    for (int k = 0; k < 3; k++) {
        d_eye[k] = 0;
        for (size_t b = 0; b < blocks; b++)
            d_eye[k] += job.d_eye[b][k];
    }
    mem_free(job.d_eye);
    return GBT_OK;
}
