/* trace/footprint.c -- widen Gaussians by the footprint of a view's pixels, and back. */
#include "trace/footprint.h"

#include <math.h>
#include <string.h>

#include "base/camera_lens.h"
#include "base/fail.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { WIDEN_BLOCK = 1024 };

footprint_view footprint_view_of(const gbt_camera *camera)
{
    footprint_view view = {.kind = FOOTPRINT_ANGULAR};
    camera_lens lens;
    for (int k = 0; k < 3; k++)
        view.center[k] = camera->center[k], view.axis[k] = camera->rotation[6 + k];
    if (!camera_lens_prepare(camera, &lens))
        return view;
    if (camera_lens_looks_forward(&lens))
        view.kind = lens.kind == LENS_ORTHOGRAPHIC ? FOOTPRINT_PARALLEL : FOOTPRINT_PERSPECTIVE;
    /* Of an equirectangular picture: on its horizon; towards the poles columns are closer. */
    view.pixel = 1 / sqrt(lens.fx * lens.fy);
    return view;
}

/* Towards a point: unit direction, and the distance. */
static double look(const footprint_view *view, const double point[3], double dir[3])
{
    for (int k = 0; k < 3; k++)
        dir[k] = point[k] - view->center[k];
    const double distance = dvec_length(dir);
    dvec_normalize(dir);
    return distance;
}

/* Pixel size at distance t in direction `dir`, and its gradient by the point. A perspective pixel at an angle theta from the axis has the
   solid angle cos^3(theta) / f^2. */
static double pixel_at(const footprint_view *view, double t, const double dir[3], double d_point[3])
{
    d_point[0] = d_point[1] = d_point[2] = 0;
    if (view->kind == FOOTPRINT_PARALLEL)
        return view->pixel;
    if (view->kind == FOOTPRINT_ANGULAR) {
        for (int k = 0; k < 3; k++)
            d_point[k] = view->pixel * dir[k];
        return view->pixel * t;
    }
    const double cosine = dvec_dot(dir, view->axis);
    if (!(cosine > 0))
        return 0;
    const double root = sqrt(cosine);
    for (int k = 0; k < 3; k++) /* p = f^-1 z^(3/2) t^(-1/2), z = t cos */
        d_point[k] = view->pixel * (1.5 * root * view->axis[k] - 0.5 * root * cosine * dir[k]);
    return view->pixel * t * cosine * root;
}

double footprint_pixel(const footprint_view *view, const double point[3])
{
    double dir[3], unused[3];
    const double distance = look(view, point, dir);
    return pixel_at(view, distance, dir, unused);
}

/* The squared area across a direction u (local axes) of an ellipsoid with squared half-axes e: det S^2 |S^-1 u|^2, without a division. */
static double area_square(const double u[3], const double e[3])
{
    return u[0] * u[0] * e[1] * e[2] + u[1] * u[1] * e[0] * e[2] + u[2] * u[2] * e[0] * e[1];
}

/* Its gradients, times `weight`, added. */
static void area_square_adjoint(const double u[3], const double e[3], double weight, double d_e[3], double d_u[3])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        d_e[i] += weight * (u[j] * u[j] * e[k] + u[k] * u[k] * e[j]);
        d_u[i] += weight * 2 * u[i] * e[j] * e[k];
    }
}

/* What forward and adjoint have in common. */
typedef struct widening {
    double rotation[9], dir[3], distance, u[3]; /* u: dir in local axes */
    double w, d_w[3];                           /* added variance, and its gradient by the mean */
    double e[3], wide[3];                       /* squared scales before and after */
    double area, wide_area, kept;               /* kept: share of the opacity */
} widening;

static widening prepare(const footprint_view *view, double variance, double pixel_min, const footprint_gaussian *g)
{
    widening x;
    dquat_to_matrix(g->quat, x.rotation);
    x.distance = look(view, g->mean, x.dir);
    double d_pixel[3];
    double pixel = pixel_at(view, x.distance, x.dir, d_pixel);
    if (!(pixel >= pixel_min)) {
        pixel = pixel_min;
        memset(d_pixel, 0, sizeof d_pixel);
    }
    x.w = variance * pixel * pixel;
    for (int k = 0; k < 3; k++) {
        x.d_w[k] = 2 * variance * pixel * d_pixel[k];
        x.e[k] = g->scale[k] * g->scale[k];
        x.wide[k] = x.e[k] + x.w;
    }
    dmat_apply_transposed(x.rotation, view->kind == FOOTPRINT_PARALLEL ? view->axis : x.dir, x.u);
    x.area = area_square(x.u, x.e), x.wide_area = area_square(x.u, x.wide);
    x.kept = x.w > 0 && x.wide_area > 0 ? sqrt(x.area / x.wide_area) : 1;
    return x;
}

void footprint_widen(const footprint_view *view, double variance, double pixel_min, footprint_gaussian *g)
{
    const widening x = prepare(view, variance, pixel_min, g);
    for (int k = 0; k < 3; k++)
        g->scale[k] = sqrt(x.wide[k]);
    g->opacity *= x.kept;
}

void footprint_adjoint(const footprint_view *view, double variance, double pixel_min, const footprint_gaussian *g, footprint_gaussian *d)
{
    const widening x = prepare(view, variance, pixel_min, g);
    const bool narrows = x.area > 0 && x.wide_area > 0 && x.w > 0; /* an ellipsoid without area is never seen */
    double d_e[3], d_u[3] = {0, 0, 0}, d_wide[3];
    for (int k = 0; k < 3; k++)
        d_wide[k] = x.wide[k] > 0 ? d->scale[k] / (2 * sqrt(x.wide[k])) : 0, d_e[k] = 0;
    if (narrows) {
        const double d_kept = g->opacity * d->opacity * x.kept / 2; /* d kept = kept / 2 (d area / area - d wide_area / wide_area) */
        area_square_adjoint(x.u, x.e, d_kept / x.area, d_e, d_u);
        area_square_adjoint(x.u, x.wide, -d_kept / x.wide_area, d_wide, d_u);
    }
    d->opacity *= x.kept;
    const double d_w = d_wide[0] + d_wide[1] + d_wide[2];
    double d_dir[3];
    dmat_apply(x.rotation, d_u, d_dir);
    const double along = dvec_dot(d_dir, x.dir);
    const bool turns = view->kind != FOOTPRINT_PARALLEL && x.distance > 0;
    for (int k = 0; k < 3; k++) {
        d->scale[k] = 2 * g->scale[k] * (d_wide[k] + d_e[k]);
        d->mean[k] += d_w * x.d_w[k] + (turns ? (d_dir[k] - along * x.dir[k]) / x.distance : 0);
    }
    /* A turn by omega in local axes takes u to u - omega x u; dL/dq = 2 q (0, dL/domega). */
    double omega[3];
    dvec_cross(d_u, x.u, omega);
    const double *q = g->quat;
    d->quat[0] += 2 * (-q[1] * omega[0] - q[2] * omega[1] - q[3] * omega[2]);
    d->quat[1] += 2 * (q[0] * omega[0] + q[2] * omega[2] - q[3] * omega[1]);
    d->quat[2] += 2 * (q[0] * omega[1] + q[3] * omega[0] - q[1] * omega[2]);
    d->quat[3] += 2 * (q[0] * omega[2] + q[1] * omega[1] - q[2] * omega[0]);
}

/* ---- arrays -------------------------------------------------------------------------------------------------------------------------- */

typedef struct widen_job {
    const footprint_view *view;
    double variance;
    const float *pixel_min;
    const gaussians *g;
    gaussians *out; /* widened, or gradients */
} widen_job;

static footprint_gaussian read_gaussian(const gaussians *g, size_t i)
{
    return (footprint_gaussian){.mean = {(double)g->mean_x[i], (double)g->mean_y[i], (double)g->mean_z[i]},
                                .scale = {(double)g->scale_x[i], (double)g->scale_y[i], (double)g->scale_z[i]},
                                .quat = {(double)g->quat_w[i], (double)g->quat_x[i], (double)g->quat_y[i], (double)g->quat_z[i]},
                                .opacity = (double)g->opacity[i]};
}

static double pixel_min_of(const widen_job *job, size_t i)
{
    return job->pixel_min != NULL ? (double)job->pixel_min[i] : 0;
}

static void widen_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const widen_job *job = context;
    for (size_t i = begin; i < end; i++) {
        footprint_gaussian one = read_gaussian(job->g, i);
        footprint_widen(job->view, job->variance, pixel_min_of(job, i), &one);
        job->out->scale_x[i] = (float)one.scale[0], job->out->scale_y[i] = (float)one.scale[1], job->out->scale_z[i] = (float)one.scale[2];
        job->out->opacity[i] = (float)one.opacity;
    }
}

static void adjoint_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const widen_job *job = context;
    gaussians *d = job->out;
    for (size_t i = begin; i < end; i++) {
        const footprint_gaussian one = read_gaussian(job->g, i);
        footprint_gaussian back = read_gaussian(d, i);
        footprint_adjoint(job->view, job->variance, pixel_min_of(job, i), &one, &back);
        d->mean_x[i] = (float)back.mean[0], d->mean_y[i] = (float)back.mean[1], d->mean_z[i] = (float)back.mean[2];
        d->scale_x[i] = (float)back.scale[0], d->scale_y[i] = (float)back.scale[1], d->scale_z[i] = (float)back.scale[2];
        d->quat_w[i] = (float)back.quat[0], d->quat_x[i] = (float)back.quat[1], d->quat_y[i] = (float)back.quat[2],
            d->quat_z[i] = (float)back.quat[3];
        d->opacity[i] = (float)back.opacity;
    }
}

gbt_status footprint_forward(const footprint_view *view, float variance, const float *pixel_min, const gaussians *g, gaussians *out,
                             gbt_error *err)
{
    GBT_TRY(gaussians_copy(g, out, err));
    widen_job job = {view, (double)variance, pixel_min, g, out};
    parallel_blocks(g->count, WIDEN_BLOCK, widen_block, &job);
    return GBT_OK;
}

void footprint_backward(const footprint_view *view, float variance, const float *pixel_min, const gaussians *g, gaussians *d)
{
    widen_job job = {view, (double)variance, pixel_min, g, d};
    parallel_blocks(g->count, WIDEN_BLOCK, adjoint_block, &job);
}
