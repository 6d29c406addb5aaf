/* SPDX-License-Identifier: Apache-2.0 */
/* raster/gradients.c -- one record per splat and tile; their sum, and the chain to the fields of the
   Gaussian, in double.

   EWA. On the image the Gaussian has the covariance C = Y Y^T + dilation, where the columns of Y are the
   projected axes times their scales, y_k = J a_k. With delta = centre - pixel and C^-1 = L L^T, (u, v) = L^T
   delta, and q = dL/d(log alpha):

       dL/dcentre = -L (sum q u, sum q v)      dL/dC = D = L (sum q (u, v)(u, v)^T) L^T / 2
       dL/dY = 2 D Y                           P = Y^T (dL/dY)

   Per ray, with v the canonical point nearest to the mean, whose depth needs no derivative (docs/tracing.md):
   dL/dmean = R S^-1 sum q v, P = sum q v v^T. Both ways dL/ds_k = P_kk / s_k, and turning the local axes by
   omega gives dL/domega = (P_yz (s_y / s_z - s_z / s_y), ...): it is 0 for a Gaussian that is round. */
#include "raster/gradients.h"

#include <string.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "base/vec.h"

typedef struct gradient_job {
    const raster_view *view;
    const gaussians *g;
    const splat *splats;
    const size_t *drawn;
    const tile_lists *lists;
    const float *records;
    gaussians *out;
    float *weight;
} gradient_job;

/* What both forms have in common: dL/dmean in world axes, and P. */
typedef struct shape_gradient {
    double mean[3], p[3][3];
} shape_gradient;

typedef struct one_gaussian {
    double mean[3], scale[3], scale_inverse[3], quat[4], rotation[9];
} one_gaussian;

static one_gaussian read_gaussian(const gaussians *g, size_t i)
{
    one_gaussian out = {
        .mean = {(double)g->mean_x[i], (double)g->mean_y[i], (double)g->mean_z[i]},
        .scale = {(double)g->scale_x[i], (double)g->scale_y[i], (double)g->scale_z[i]},
        .quat = {(double)g->quat_w[i], (double)g->quat_x[i], (double)g->quat_y[i], (double)g->quat_z[i]}};
    dquat_to_matrix(out.quat, out.rotation);
    for (int k = 0; k < 3; k++)
        out.scale_inverse[k] = 1 / out.scale[k];
    return out;
}

/* The adjoint of one row of the projection (x or y). With ratio = X / Z the image point is focal ratio +
   shift, and the image of axis a is focal / Z (a_row - k a_z), where k is the ratio kept within limits. Sets
   dL/d(X or Y), adds to dL/dZ. */
static void project_row_adjoint(double focal, double ratio, double k, double z_inverse, const double a[3],
                                const double az[3], double d_point, const double d_y[3], double *d_x,
                                double *d_z)
{
    const double gain = focal * z_inverse;
    double d_gain = 0, d_k = 0;
    for (int i = 0; i < 3; i++) {
        d_gain += d_y[i] * (a[i] - k * az[i]);
        d_k -= d_y[i] * gain * az[i];
    }
    const double d_ratio = focal * d_point + (k == ratio ? d_k : 0);
    *d_x = d_ratio * z_inverse;
    *d_z -= (d_ratio * ratio + d_gain * gain) * z_inverse;
}

static shape_gradient ewa_adjoint(const raster_view *view, const one_gaussian *g, const splat *s,
                                  const double *sum)
{
    const double unit = 1 / HALF_LOG2_E, l[3] = {(double)s->chol[0], (double)s->chol[1], (double)s->chol[2]};
    const double d_point[2] = {-unit * l[0] * sum[1], -unit * (l[1] * sum[1] + l[2] * sum[2])};
    const double half = 0.5 * unit * unit, uu = half * sum[3], uv = half * sum[4], vv = half * sum[5];
    const double dxx = l[0] * l[0] * uu, dxy = l[0] * (l[1] * uu + l[2] * uv),
                 dyy = l[1] * l[1] * uu + 2 * l[1] * l[2] * uv + l[2] * l[2] * vv;
    double t[3], axis[3][3], y[2][3], d_y[2][3], d_t[3] = {0};
    const double offset[3] = {g->mean[0] - view->center[0], g->mean[1] - view->center[1],
                              g->mean[2] - view->center[2]};
    dmat_apply(view->rotation, offset, t);
    for (int k = 0; k < 3; k++) {
        double column[3] = {g->rotation[k] * g->scale[k], g->rotation[3 + k] * g->scale[k],
                            g->rotation[6 + k] * g->scale[k]};
        dmat_apply(view->rotation, column, column);
        for (int r = 0; r < 3; r++)
            axis[r][k] = column[r];
    }
    const double focal[2] = {view->fx, view->fy}, z_inverse = 1 / t[2];
    double ratio[2], kept[2];
    for (int r = 0; r < 2; r++) {
        const double low = view->low[r], high = view->high[r];
        ratio[r] = t[r] * z_inverse;
        kept[r] = ratio[r] < low ? low : ratio[r] > high ? high : ratio[r];
        for (int k = 0; k < 3; k++)
            y[r][k] = focal[r] * z_inverse * (axis[r][k] - kept[r] * axis[2][k]);
    }
    for (int k = 0; k < 3; k++) {
        d_y[0][k] = 2 * (dxx * y[0][k] + dxy * y[1][k]);
        d_y[1][k] = 2 * (dxy * y[0][k] + dyy * y[1][k]);
    }
    for (int r = 0; r < 2; r++)
        project_row_adjoint(focal[r], ratio[r], kept[r], z_inverse, axis[r], axis[2], d_point[r], d_y[r],
                            &d_t[r], &d_t[2]);
    shape_gradient out;
    dmat_apply_transposed(view->rotation, d_t, out.mean);
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            out.p[j][k] = y[0][j] * d_y[0][k] + y[1][j] * d_y[1][k];
    return out;
}

static shape_gradient ray_form_adjoint(const one_gaussian *g, const double *sum)
{
    shape_gradient out;
    const double *inverse = g->scale_inverse,
                 v[3] = {sum[1] * inverse[0], sum[2] * inverse[1], sum[3] * inverse[2]};
    dmat_apply(g->rotation, v, out.mean);
    for (int k = 0; k < 3; k++)
        out.p[k][k] = sum[4 + k];
    out.p[1][2] = out.p[2][1] = sum[7];
    out.p[2][0] = out.p[0][2] = sum[8];
    out.p[0][1] = out.p[1][0] = sum[9];
    return out;
}

static void store_gradient(const one_gaussian *g, const shape_gradient *d, size_t i, gaussians *out)
{
    const double *s = g->scale, *inverse = g->scale_inverse, *q = g->quat;
    const double wx = d->p[1][2] * (s[1] * inverse[2] - s[2] * inverse[1]),
                 wy = d->p[2][0] * (s[2] * inverse[0] - s[0] * inverse[2]);
    const double wz = d->p[0][1] * (s[0] * inverse[1] - s[1] * inverse[0]);
    out->mean_x[i] = (float)d->mean[0];
    out->mean_y[i] = (float)d->mean[1];
    out->mean_z[i] = (float)d->mean[2];
    out->scale_x[i] = (float)(d->p[0][0] * inverse[0]), out->scale_y[i] = (float)(d->p[1][1] * inverse[1]),
    out->scale_z[i] = (float)(d->p[2][2] * inverse[2]);
    /* dL/dq = 2 q (0, dL/domega), a quaternion product: tangent to the unit sphere */
    out->quat_w[i] = (float)(-2 * (q[1] * wx + q[2] * wy + q[3] * wz));
    out->quat_x[i] = (float)(2 * (q[0] * wx + q[2] * wz - q[3] * wy));
    out->quat_y[i] = (float)(2 * (q[0] * wy + q[3] * wx - q[1] * wz));
    out->quat_z[i] = (float)(2 * (q[0] * wz + q[1] * wy - q[2] * wx));
}

static void gradients_of_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)end;
    const gradient_job *job = context;
    const size_t sums = raster_sum_count(job->view->settings.form);
    for (size_t at = begin; at < begin + job->drawn[block]; at++) {
        const splat *s = &job->splats[at];
        const pair_range range = job->lists->ranges[at];
        const size_t i = s->id;
        double sum[RAY_SUMS] = {0};
        bool any = false;
        for (size_t pair = range.first; pair < (size_t)range.first + range.count; pair++)
            for (size_t k = 0; k < sums; k++) {
                const float part = job->records[pair * sums + k];
                sum[k] += (double)part;
                any = any || part != 0;
            }
        if (!any)
            continue;
        const one_gaussian g = read_gaussian(job->g, i);
        const shape_gradient d = job->view->settings.form == RASTER_EWA ? ewa_adjoint(job->view, &g, s, sum)
                                                                        : ray_form_adjoint(&g, sum);
        const double *color = sum + (job->view->settings.form == RASTER_EWA ? EWA_COLOR : RAY_COLOR);
        if (job->weight != NULL)
            job->weight[i] = (float)color[3]; /* the weight follows the colour in both forms */
        store_gradient(&g, &d, i, job->out);
        job->out->opacity[i] = (float)(sum[0] / (double)s->opacity);
        job->out->red[i] = (float)color[0];
        job->out->green[i] = (float)color[1];
        job->out->blue[i] = (float)color[2];
    }
}

gbt_status raster_gradients(const raster_view *view, const gaussians *g, const splat *splats,
                            const size_t *drawn, const tile_lists *lists, const float *records,
                            gaussians *out, float *weight, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_zero(out);
    if (weight != NULL)
        memset(weight, 0, g->count * sizeof *weight);
    gradient_job job = {view, g, splats, drawn, lists, records, out, weight};
    parallel_blocks(g->count, SPLAT_GRAIN, gradients_of_block, &job);
    return GBT_OK;
}
