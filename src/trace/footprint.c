/* SPDX-License-Identifier: Apache-2.0 */
/* trace/footprint.c -- widen Gaussians by the footprint of a view's pixels, and the adjoint of that.

   Per Gaussian (footprint.h has the equations):

     mean --> size p of a pixel there --> w = v p^2 --> squared scales s_i^2 + w
          --> opacity times sqrt(area before / area after)

   The adjoint computes these quantities again and goes through the chain backwards. Eight Gaussians at a
   time, in double, without a branch per lane: where a quantity is undefined, the divisor is replaced and a
   select discards the quotient. */
#include "trace/footprint.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/clones.h"
#include "base/fail.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { LANES = FOOTPRINT_LANES, WIDEN_BLOCK = 512 /* a multiple of LANES */ };

typedef double d8 __attribute__((vector_size(LANES * sizeof(double))));
typedef float f8 __attribute__((vector_size(LANES * sizeof(float))));
typedef int64_t m8
    __attribute__((vector_size(LANES * sizeof(int64_t)))); /* all bits or none, as comparisons give it */

/* Inlined into every clone. */
#define LANE_CODE static inline __attribute__((always_inline))

footprint_view footprint_view_with(const gbt_camera *camera, const camera_lens *lens)
{
    footprint_view view = {.kind = FOOTPRINT_ANGULAR};
    for (int k = 0; k < 3; k++) {
        view.center[k] = camera->center[k];
        view.axis[k] = camera->rotation[6 + k];
    }
    if (lens == NULL)
        return view;
    if (camera_lens_looks_forward(lens))
        view.kind = lens->kind == LENS_ORTHOGRAPHIC ? FOOTPRINT_PARALLEL : FOOTPRINT_PERSPECTIVE;
    view.pixel = 1 / sqrt(lens->fx * lens->fy);
    if (lens->kind == LENS_EQUIRECTANGULAR) {
        view.kind = FOOTPRINT_PANORAMA;
        view.pixel *= sqrt(2) * PI; /* fx pixels go round, fy half round */
        memcpy(view.axis, camera->rotation + 3, sizeof view.axis);
    }
    return view;
}

footprint_view footprint_view_of(const gbt_camera *camera)
{
    camera_lens lens;
    return footprint_view_with(camera, camera_lens_prepare(camera, &lens) ? &lens : NULL);
}

/* ---- lanes ---- */

LANE_CODE d8 d8_set(double a) { return (d8){a, a, a, a, a, a, a, a}; }

LANE_CODE d8 d8_select(m8 where, d8 yes, d8 no) { return (d8)((where & (m8)yes) | (~where & (m8)no)); }

LANE_CODE d8 d8_sqrt(d8 a)
{
    d8 root;
    for (int lane = 0; lane < LANES; lane++)
        root[lane] = sqrt(a[lane]);
    return root;
}

/* a / b where b > 0, else 0. */
LANE_CODE d8 d8_over(d8 a, d8 b)
{
    const m8 some = b > 0;
    return d8_select(some, a, d8_set(0)) / d8_select(some, b, d8_set(1));
}

LANE_CODE d8 d8_dot(const d8 a[3], const d8 b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

typedef struct gaussian8 {
    d8 mean[3], scale[3], quat[4], opacity;
} gaussian8;

/* ---- the pixel at a point ---- */

/* Unit directions from the camera to points; returns the distances. */
LANE_CODE d8 directions_to(const footprint_view *view, const d8 point[3], d8 dir[3])
{
    for (int k = 0; k < 3; k++)
        dir[k] = point[k] - view->center[k];
    const d8 distance = d8_sqrt(d8_dot(dir, dir));
    for (int k = 0; k < 3; k++)
        dir[k] = d8_over(dir[k], distance);
    return distance;
}

/* Pixel size p at distance t in direction `dir`, and its gradient with respect to the point.

   Perspective: a pixel at the angle theta from the axis has the solid angle cos^3(theta) / f^2, so p = f^-1
   z^(3/2) t^(-1/2) with z = t cos(theta). Points behind the camera can be seen only in mirrors; a mirror at
   right angles to the axis shows them as if they stood in front, so |cos(theta)| is taken. Towards the sides
   it is kept at FOOTPRINT_COSINE_MIN.

   Panorama: columns converge towards the poles. A pixel at the latitude phi has cos(phi) times the solid
   angle of one on the horizon, so p = p_0 t cos^(1/2)(phi). */
LANE_CODE d8 pixel_at(const footprint_view *view, d8 t, const d8 dir[3], d8 d_point[3])
{
    const d8 pixel = d8_set(view->pixel), none = d8_set(0);
    if (view->kind == FOOTPRINT_PARALLEL) {
        d_point[0] = d_point[1] = d_point[2] = none;
        return pixel;
    }
    if (view->kind == FOOTPRINT_ANGULAR) {
        for (int k = 0; k < 3; k++)
            d_point[k] = pixel * dir[k];
        return pixel * t;
    }
    const d8 axis[3] = {d8_set(view->axis[0]), d8_set(view->axis[1]), d8_set(view->axis[2])},
             cosine = d8_dot(dir, axis);
    if (view->kind == FOOTPRINT_PANORAMA) {
        const d8 square = 1 - cosine * cosine, level = d8_sqrt(d8_select(square > 0, square, none)),
                 root = d8_sqrt(level);
        for (int k = 0; k < 3; k++)
            d_point[k] = 0.5 * pixel * (root * dir[k] + d8_over(dir[k] - cosine * axis[k], level * root));
        return pixel * t * root;
    }
    const d8 side = d8_select(cosine < 0, d8_set(-1), d8_set(1)), least = d8_set(FOOTPRINT_COSINE_MIN);
    const m8 varies = side * cosine > least;
    const d8 ahead = d8_select(varies, side * cosine, least), root = d8_sqrt(ahead);
    for (int k = 0; k < 3; k++)
        d_point[k] = pixel * d8_select(varies, 1.5 * root * side * axis[k] - 0.5 * root * ahead * dir[k],
                                       root * ahead * dir[k]);
    return pixel * t * ahead * root;
}

void footprint_pixels(const footprint_view *view, double point[3][LANES], double pixel[LANES])
{
    d8 at[3], dir[3], unused[3];
    memcpy(at, point, sizeof at);
    const d8 distance = directions_to(view, at, dir), there = pixel_at(view, distance, dir, unused);
    memcpy(pixel, &there, sizeof there);
}

/* ---- widening ---- */

/* The squared area (over pi^2) that an ellipsoid with squared half-axes e shows along a direction u (local
   axes): det S^2 |S^-1 u|^2, written without a division. */
LANE_CODE d8 area_square(const d8 u[3], const d8 e[3])
{
    return u[0] * u[0] * e[1] * e[2] + u[1] * u[1] * e[0] * e[2] + u[2] * u[2] * e[0] * e[1];
}

/* Adds the gradients of area_square(), times `weight`. */
LANE_CODE void area_square_adjoint(const d8 u[3], const d8 e[3], d8 weight, d8 d_e[3], d8 d_u[3])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        d_e[i] += weight * (u[j] * u[j] * e[k] + u[k] * u[k] * e[j]);
        d_u[i] += weight * 2 * u[i] * e[j] * e[k];
    }
}

/* Quantities that the forward pass and the adjoint have in common. */
typedef struct widening {
    d8 axes[3][3], dir[3], distance, u[3]; /* axes: of the Gaussian, in the world; u: dir in them */
    d8 w, d_w[3];                          /* added variance, and its gradient with respect to the mean */
    d8 e[3], wide[3];                      /* squared scales before and after */
    d8 area, wide_area, kept;              /* kept: factor of the opacity */
    m8 narrows;                            /* that factor is less than 1 */
} widening;

/* Columns of the rotation matrix. */
LANE_CODE void axes_of(const d8 q[4], d8 axes[3][3])
{
    const d8 w = q[0], x = q[1], y = q[2], z = q[3];
    axes[0][0] = 1 - 2 * (y * y + z * z);
    axes[1][0] = 2 * (x * y - w * z);
    axes[2][0] = 2 * (x * z + w * y);
    axes[0][1] = 2 * (x * y + w * z);
    axes[1][1] = 1 - 2 * (x * x + z * z);
    axes[2][1] = 2 * (y * z - w * x);
    axes[0][2] = 2 * (x * z - w * y);
    axes[1][2] = 2 * (y * z + w * x);
    axes[2][2] = 1 - 2 * (x * x + y * y);
}

LANE_CODE void prepare(const footprint_view *view, double variance, d8 pixel_min, const gaussian8 *g,
                       widening *x)
{
    axes_of(g->quat, x->axes);
    x->distance = directions_to(view, g->mean, x->dir);
    d8 d_pixel[3];
    const d8 there = pixel_at(view, x->distance, x->dir, d_pixel);
    const m8 larger = there >= pixel_min;
    const d8 pixel = d8_select(larger, there, pixel_min);
    x->w = variance * pixel * pixel;
    for (int k = 0; k < 3; k++) {
        x->d_w[k] = d8_select(larger, 2 * variance * pixel * d_pixel[k], d8_set(0));
        x->e[k] = g->scale[k] * g->scale[k];
        x->wide[k] = x->e[k] + x->w;
    }
    const d8 axis[3] = {d8_set(view->axis[0]), d8_set(view->axis[1]), d8_set(view->axis[2])};
    for (int k = 0; k < 3; k++)
        x->u[k] = d8_dot(x->axes[k], view->kind == FOOTPRINT_PARALLEL ? axis : x->dir);
    x->area = area_square(x->u, x->e);
    x->wide_area = area_square(x->u, x->wide);
    x->narrows = (x->w > 0) & (x->wide_area > 0);
    x->kept = d8_select(x->narrows, d8_sqrt(d8_over(x->area, x->wide_area)), d8_set(1));
}

LANE_CODE void widen_lanes(const footprint_view *view, double variance, d8 pixel_min, gaussian8 *g)
{
    widening x;
    prepare(view, variance, pixel_min, g, &x);
    for (int k = 0; k < 3; k++)
        g->scale[k] = d8_sqrt(x.wide[k]);
    g->opacity *= x.kept;
}

LANE_CODE void adjoint_lanes(const footprint_view *view, double variance, d8 pixel_min, const gaussian8 *g,
                             gaussian8 *d)
{
    widening x;
    prepare(view, variance, pixel_min, g, &x);
    d8 d_e[3], d_u[3], d_wide[3];
    for (int k = 0; k < 3; k++) {
        d_e[k] = d_u[k] = d8_set(0);
        d_wide[k] = d8_over(d->scale[k], 2 * d8_sqrt(x.wide[k]));
    }
    /* d kept = kept / 2 (d area / area - d wide_area / wide_area); an ellipsoid without area is never seen */
    const d8 d_kept = d8_select(x.narrows & (x.area > 0), g->opacity * d->opacity * x.kept / 2, d8_set(0));
    area_square_adjoint(x.u, x.e, d8_over(d_kept, x.area), d_e, d_u);
    area_square_adjoint(x.u, x.wide, -d8_over(d_kept, x.wide_area), d_wide, d_u);
    d->opacity *= x.kept;
    const d8 d_w = d_wide[0] + d_wide[1] + d_wide[2];
    d8 d_dir[3];
    for (int k = 0; k < 3; k++)
        d_dir[k] = x.axes[0][k] * d_u[0] + x.axes[1][k] * d_u[1] + x.axes[2][k] * d_u[2];
    const d8 along = d8_dot(d_dir, x.dir);
    for (int k = 0; k < 3; k++) {
        d->scale[k] = 2 * g->scale[k] * (d_wide[k] + d_e[k]);
        d->mean[k] += d_w * x.d_w[k];
        if (view->kind != FOOTPRINT_PARALLEL)
            d->mean[k] += d8_over(d_dir[k] - along * x.dir[k], x.distance);
    }
    /* A turn by omega in local axes takes u to u - omega x u; dL/dq = 2 q (0, dL/domega). */
    const d8 *u = x.u, *q = g->quat;
    const d8 omega[3] = {d_u[1] * u[2] - d_u[2] * u[1], d_u[2] * u[0] - d_u[0] * u[2],
                         d_u[0] * u[1] - d_u[1] * u[0]};
    d->quat[0] += 2 * (-q[1] * omega[0] - q[2] * omega[1] - q[3] * omega[2]);
    d->quat[1] += 2 * (q[0] * omega[0] + q[2] * omega[2] - q[3] * omega[1]);
    d->quat[2] += 2 * (q[0] * omega[1] + q[3] * omega[0] - q[1] * omega[2]);
    d->quat[3] += 2 * (q[0] * omega[2] + q[1] * omega[1] - q[2] * omega[0]);
}

/* ---- one Gaussian ---- */

static gaussian8 broadcast(const footprint_gaussian *g)
{
    gaussian8 out = {.opacity = d8_set(g->opacity)};
    for (int k = 0; k < 3; k++) {
        out.mean[k] = d8_set(g->mean[k]);
        out.scale[k] = d8_set(g->scale[k]);
    }
    for (int k = 0; k < 4; k++)
        out.quat[k] = d8_set(g->quat[k]);
    return out;
}

static footprint_gaussian gaussian_of_lane_0(const gaussian8 *g)
{
    return (footprint_gaussian){.mean = {g->mean[0][0], g->mean[1][0], g->mean[2][0]},
                                .scale = {g->scale[0][0], g->scale[1][0], g->scale[2][0]},
                                .quat = {g->quat[0][0], g->quat[1][0], g->quat[2][0], g->quat[3][0]},
                                .opacity = g->opacity[0]};
}

void footprint_widen(const footprint_view *view, double variance, double pixel_min, footprint_gaussian *g)
{
    gaussian8 lanes = broadcast(g);
    widen_lanes(view, variance, d8_set(pixel_min), &lanes);
    *g = gaussian_of_lane_0(&lanes);
}

/* ---- arrays ---- */

typedef struct widen_job {
    const footprint_view *view;
    double variance;
    const float *pixel_min;
    const gaussians *g;
    gaussians *out; /* widened, or gradients */
} widen_job;

/* `count` values, at most LANES; the other lanes are 0. */
LANE_CODE d8 load(const float *from, size_t count)
{
    f8 lanes = {0};
    if (count >= LANES)
        memcpy(&lanes, from, sizeof lanes);
    else
        memcpy(&lanes, from, count * sizeof *from);
    return __builtin_convertvector(lanes, d8);
}

LANE_CODE void store(float *to, size_t count, d8 a)
{
    const f8 lanes = __builtin_convertvector(a, f8);
    if (count >= LANES)
        memcpy(to, &lanes, sizeof lanes);
    else
        memcpy(to, &lanes, count * sizeof *to);
}

LANE_CODE gaussian8 load_gaussians(const gaussians *g, size_t i, size_t count)
{
    return (gaussian8){
        .mean = {load(g->mean_x + i, count), load(g->mean_y + i, count), load(g->mean_z + i, count)},
        .scale = {load(g->scale_x + i, count), load(g->scale_y + i, count), load(g->scale_z + i, count)},
        .quat = {load(g->quat_w + i, count), load(g->quat_x + i, count), load(g->quat_y + i, count),
                 load(g->quat_z + i, count)},
        .opacity = load(g->opacity + i, count)};
}

LANE_CODE d8 load_pixel_min(const widen_job *job, size_t i, size_t count)
{
    return job->pixel_min != NULL ? load(job->pixel_min + i, count) : d8_set(0);
}

/* The fields that widening replaces; in the adjoint, their gradients. */
LANE_CODE void store_scale_opacity(gaussians *out, size_t i, size_t count, const gaussian8 *g)
{
    store(out->scale_x + i, count, g->scale[0]);
    store(out->scale_y + i, count, g->scale[1]);
    store(out->scale_z + i, count, g->scale[2]);
    store(out->opacity + i, count, g->opacity);
}

FASTEST_CLONE static void widen_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const widen_job *job = context;
    gaussians_copy_range(job->g, begin, end, job->out);
    for (size_t i = begin; i < end; i += LANES) {
        const size_t count = end - i;
        gaussian8 g = load_gaussians(job->g, i, count);
        widen_lanes(job->view, job->variance, load_pixel_min(job, i, count), &g);
        store_scale_opacity(job->out, i, count, &g);
    }
}

FASTEST_CLONE static void adjoint_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const widen_job *job = context;
    for (size_t i = begin; i < end; i += LANES) {
        const size_t count = end - i;
        const gaussian8 g = load_gaussians(job->g, i, count);
        gaussian8 d = load_gaussians(job->out, i, count);
        adjoint_lanes(job->view, job->variance, load_pixel_min(job, i, count), &g, &d);
        store_scale_opacity(job->out, i, count, &d);
        float *mean[] = {job->out->mean_x, job->out->mean_y, job->out->mean_z};
        float *quat[] = {job->out->quat_w, job->out->quat_x, job->out->quat_y, job->out->quat_z};
        for (int k = 0; k < 3; k++)
            store(mean[k] + i, count, d.mean[k]);
        for (int k = 0; k < 4; k++)
            store(quat[k] + i, count, d.quat[k]);
    }
}

gbt_status footprint_forward(const footprint_view *view, float variance, const float *pixel_min,
                             const gaussians *g, gaussians *out, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_pad(out);
    widen_job job = {view, (double)variance, pixel_min, g, out};
    parallel_blocks(g->count, WIDEN_BLOCK, widen_block, &job);
    return GBT_OK;
}

void footprint_backward(const footprint_view *view, float variance, const float *pixel_min,
                        const gaussians *g, gaussians *d)
{
    widen_job job = {view, (double)variance, pixel_min, g, d};
    parallel_blocks(g->count, WIDEN_BLOCK, adjoint_block, &job);
}
