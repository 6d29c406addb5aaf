/* SPDX-License-Identifier: Apache-2.0 */
/* raster/project16.h -- from Gaussians to splats: projection (Kerbl 2023, eq 5) and box of tiles, sixteen at
   a time.

   In double, because a pixel may lie thousands of pixels from a corner and the edge of a Gaussian is a third
   of a pixel wide. The loops over lanes are plain C that compilers vectorise; no operation is fused, so all
   instruction sets give the same bits. Included by kernel.inc.h. */
#ifndef GBT_RASTER_PROJECT16_H
#define GBT_RASTER_PROJECT16_H

#include <math.h>

#include "base/vec.h"
#include "raster/kernel.h"

typedef struct lane_splats {
    double t[3][PIXEL_LANES];    /* mean, camera axes */
    double axis[9][PIXEL_LANES]; /* the axes times their scales, camera axes: row r of axis k at 3 r + k */
    double x[PIXEL_LANES], y[PIXEL_LANES], xx[PIXEL_LANES], xy[PIXEL_LANES], yy[PIXEL_LANES],
        det[PIXEL_LANES], radius[PIXEL_LANES];
} lane_splats;

/* Mean and scaled axes in camera space: row r, axis k at axis[3 r + k]. */
static inline void place_lanes(const raster_view *view, const gaussians *g, size_t first, lane_splats *out)
{
    const double *m = view->rotation, *c = view->center;
    for (int i = 0; i < PIXEL_LANES; i++) {
        const size_t at = first + (size_t)i;
        const double dx = (double)g->mean_x[at] - c[0], dy = (double)g->mean_y[at] - c[1],
                     dz = (double)g->mean_z[at] - c[2];
        const double w = (double)g->quat_w[at], x = (double)g->quat_x[at], y = (double)g->quat_y[at],
                     z = (double)g->quat_z[at];
        const double sx = (double)g->scale_x[at], sy = (double)g->scale_y[at], sz = (double)g->scale_z[at];
        const double a0 = (1 - 2 * (y * y + z * z)) * sx, a1 = 2 * (x * y + w * z) * sx,
                     a2 = 2 * (x * z - w * y) * sx;
        const double b0 = 2 * (x * y - w * z) * sy, b1 = (1 - 2 * (x * x + z * z)) * sy,
                     b2 = 2 * (y * z + w * x) * sy;
        const double c0 = 2 * (x * z + w * y) * sz, c1 = 2 * (y * z - w * x) * sz,
                     c2 = (1 - 2 * (x * x + y * y)) * sz;
        for (int r = 0; r < 3; r++) {
            out->t[r][i] = m[3 * r] * dx + m[3 * r + 1] * dy + m[3 * r + 2] * dz;
            out->axis[3 * r][i] = m[3 * r] * a0 + m[3 * r + 1] * a1 + m[3 * r + 2] * a2;
            out->axis[3 * r + 1][i] = m[3 * r] * b0 + m[3 * r + 1] * b1 + m[3 * r + 2] * b2;
            out->axis[3 * r + 2][i] = m[3 * r] * c0 + m[3 * r + 1] * c1 + m[3 * r + 2] * c2;
        }
    }
}

/* The affine projection at the mean. The determinant is a sum of squares (Cauchy-Binet): thin splats lose no
   digits. */
static inline void project_lanes(const raster_view *view, lane_splats *s)
{
    const double fx = view->fx, fy = view->fy, d = (double)view->settings.dilation;
    const double x_low = view->low[0], x_high = view->high[0], y_low = view->low[1], y_high = view->high[1];
    for (int i = 0; i < PIXEL_LANES; i++) {
        const double inverse = 1 / s->t[2][i], rx = s->t[0][i] * inverse, ry = s->t[1][i] * inverse;
        const double kx = rx < x_low    ? x_low
                          : rx > x_high ? x_high
                                        : rx,
                     ky = ry < y_low    ? y_low
                          : ry > y_high ? y_high
                                        : ry;
        const double gx = fx * inverse, gy = fy * inverse;
        const double x0 = gx * (s->axis[0][i] - kx * s->axis[6][i]),
                     y0 = gy * (s->axis[3][i] - ky * s->axis[6][i]);
        const double x1 = gx * (s->axis[1][i] - kx * s->axis[7][i]),
                     y1 = gy * (s->axis[4][i] - ky * s->axis[7][i]);
        const double x2 = gx * (s->axis[2][i] - kx * s->axis[8][i]),
                     y2 = gy * (s->axis[5][i] - ky * s->axis[8][i]);
        const double xx = x0 * x0 + x1 * x1 + x2 * x2, yy = y0 * y0 + y1 * y1 + y2 * y2;
        const double m0 = x1 * y2 - x2 * y1, m1 = x2 * y0 - x0 * y2, m2 = x0 * y1 - x1 * y0;
        const double det = (m0 * m0 + m1 * m1 + m2 * m2) + d * (xx + yy) + d * d;
        const double a = xx + d, c = yy + d, middle = 0.5 * (a + c), square = middle * middle - det;
        s->x[i] = fx * rx + view->cx;
        s->y[i] = fy * ry + view->cy;
        s->xx[i] = a;
        s->xy[i] = x0 * y0 + x1 * y1 + x2 * y2;
        s->yy[i] = c;
        s->det[i] = det;
        s->radius[i] = middle + sqrt(square > 0.1 ? square : 0.1);
    }
}

/* Whether a Gaussian has finite fields, positive scales, and an opacity that can be seen. */
static inline bool is_drawable(const raster_view *view, const gaussians *g, size_t i)
{
    const float q = g->quat_w[i] + g->quat_x[i] + g->quat_y[i] + g->quat_z[i],
                color = g->red[i] + g->green[i] + g->blue[i];
    const float s = g->scale_x[i] + g->scale_y[i] + g->scale_z[i],
                m = g->mean_x[i] + g->mean_y[i] + g->mean_z[i];
    return g->opacity[i] >= view->settings.alpha_min && isfinite(g->opacity[i]) && isfinite(q) &&
           isfinite(color) && isfinite(s) && isfinite(m) && g->scale_x[i] > 0 && g->scale_y[i] > 0 &&
           g->scale_z[i] > 0;
}

/* Tiles from that of point `low` to before that of point `high`, cut to [0, tiles]. */
static inline void tile_range(double low, double high, int tiles, uint16_t out[2])
{
    const double first = floor(low / TILE_PIXELS), end = floor(high / TILE_PIXELS);
    out[0] = (uint16_t)(first < 0 ? 0 : first > tiles ? tiles : first);
    out[1] = (uint16_t)(end < 0 ? 0 : end > tiles ? tiles : end);
}

/* Sets the centre of a splat and its factor `chol` (kernel.h) for a covariance with xy, yy and this
   determinant; the form is multiplied by `factor`. False when float cannot hold it. */
static inline bool store_ellipse(double x, double y, double xy, double yy, double det, double factor,
                                 splat *out)
{
    const double chol[3] = {sqrt(factor * yy / det), -xy * sqrt(factor / (yy * det)), sqrt(factor / yy)};
    out->center[0] = x;
    out->center[1] = y;
    bool fine = det > 0 && fabs(x) < 1e12 && fabs(y) < 1e12; /* false for NaN too */
    for (int k = 0; k < 3; k++) {
        fine = fine && fabs(chol[k]) < 1e12;
        out->chol[k] = (float)chol[k];
    }
    return fine;
}

/* The d2 at which the response falls to alpha_min, and a little more: only what cannot be seen is left
   out. */
static inline double cut_square(const raster_view *view, float opacity)
{
    return 2 * log((double)opacity / (double)view->settings.alpha_min) * (1 + 1e-5) + 1e-4;
}

static inline bool finish_ewa(const raster_view *view, const lane_splats *s, int lane, splat *out)
{
    const double cut = cut_square(view, out->opacity), x = s->x[lane], y = s->y[lane];
    if (!(s->t[2][lane] > (double)view->settings.near) ||
        !store_ellipse(x, y, s->xy[lane], s->yy[lane], s->det[lane], HALF_LOG2_E, out))
        return false;
    out->reach = (float)(HALF_LOG2_E * cut);
    if (view->settings.exact_cut) {
        const double half_x = sqrt(cut * s->xx[lane]), half_y = sqrt(cut * s->yy[lane]);
        tile_range(x - half_x, x + half_x + TILE_PIXELS, view->tiles_across, out->box);
        tile_range(y - half_y, y + half_y + TILE_PIXELS, view->tiles_down, out->box + 2);
    } else {
        const double radius = ceil(3 * sqrt(s->radius[lane]));
        tile_range(x - radius, x + radius + TILE_PIXELS - 1, view->tiles_across, out->box);
        tile_range(y - radius, y + radius + TILE_PIXELS - 1, view->tiles_down, out->box + 2);
    }
    return out->box[0] < out->box[1] && out->box[2] < out->box[3];
}

/* The exact outline of the proxy ellipsoid at `cut`: with Q its shape in camera space and m the mean, lines l
   of the image plane touch it where l^T (m m^T - Q) l = 0, which is the dual of an ellipse. An ellipsoid that
   reaches behind the eye may be seen anywhere. */
static inline bool store_outline(const raster_view *view, const lane_splats *s, int lane, splat *out)
{
    const double cut = cut_square(view, out->opacity);
    double dual[3][3], m[3];
    for (int r = 0; r < 3; r++)
        m[r] = s->t[r][lane];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            double q = 0;
            for (int k = 0; k < 3; k++)
                q += s->axis[3 * r + k][lane] * s->axis[3 * c + k][lane];
            dual[r][c] = m[r] * m[c] - cut * q;
        }
    const double front = dual[2][2];
    if (m[2] <= 0 && front > 0) /* all of it behind */
        return false;
    out->reach = 1;
    out->box[0] = out->box[2] = 0;
    out->box[1] = (uint16_t)view->tiles_across;
    out->box[3] = (uint16_t)view->tiles_down;
    out->center[0] = out->center[1] = 0;
    out->chol[0] = out->chol[1] = out->chol[2] = 0;
    if (!(front > 1e-6 * m[2] * m[2]))
        return true;
    const double a = dual[0][2] / front, b = dual[1][2] / front, fx = view->fx, fy = view->fy;
    const double xx = fx * fx * (a * a - dual[0][0] / front), yy = fy * fy * (b * b - dual[1][1] / front);
    const double xy = fx * fy * (a * b - dual[0][1] / front);
    /* A hundredth of a pixel more on all sides covers the rounding of rays. Where rounding destroys the
       determinant, the box of all tiles stays. */
    const double wide_xx = xx + 1e-4 + 1e-4 * xx, wide_yy = yy + 1e-4 + 1e-4 * yy,
                 det = wide_xx * wide_yy - xy * xy;
    const double x = fx * a + view->cx, y = fy * b + view->cy, half_x = sqrt(wide_xx), half_y = sqrt(wide_yy);
    splat narrow = *out;
    if (!(det > 0) || !store_ellipse(x, y, xy, wide_yy, det, 1, &narrow))
        return true;
    *out = narrow;
    tile_range(x - half_x, x + half_x + TILE_PIXELS, view->tiles_across, out->box);
    tile_range(y - half_y, y + half_y + TILE_PIXELS, view->tiles_down, out->box + 2);
    return out->box[0] < out->box[1] && out->box[2] < out->box[3];
}

/* See ray_splat. */
static inline bool finish_ray(const raster_view *view, const gaussians *g, const lane_splats *s, int lane,
                              splat *out, ray_splat *ray)
{
    if (!store_outline(view, s, lane, out))
        return false;
    const double scale[3] = {(double)g->scale_x[out->id], (double)g->scale_y[out->id],
                             (double)g->scale_z[out->id]};
    const double sigma = fmin(scale[0], fmin(scale[1], scale[2]));
    double m[3], length = 0;
    for (int r = 0; r < 3; r++) {
        m[r] = s->t[r][lane];
        length += fabs(m[r]);
    }
    const bool front = m[2] > 0.01 * length;
    const double a0 = front ? m[0] / m[2] : 0, b0 = front ? m[1] / m[2] : 0, depth = front ? m[2] : 0;
    *ray = (ray_splat){.a0 = a0,
                       .b0 = b0,
                       .depth = (float)depth,
                       .depth_per_sigma = (float)(depth / sigma),
                       .sigma = (float)sigma,
                       .sigma_inverse = (float)(1 / sigma)};
    for (int k = 0; k < 3; k++) { /* rows of S^-1 R^T: the scaled axes over the squares of their scales */
        const double inverse = 1 / (scale[k] * scale[k]);
        const double row[3] = {s->axis[k][lane] * inverse, s->axis[3 + k][lane] * inverse,
                               s->axis[6 + k][lane] * inverse};
        ray->wa[k] = (float)(row[0] * sigma);
        ray->wb[k] = (float)(row[1] * sigma);
        ray->w0[k] = (float)((row[0] * a0 + row[1] * b0 + row[2]) * sigma);
        ray->y0[k] = front ? 0 : (float)-dvec_dot(row, m);
    }
    return true;
}

static size_t project(const raster_view *view, const gaussians *g, size_t begin, size_t end, splat *out,
                      ray_splat *rays)
{
    size_t count = 0;
    for (size_t first = begin; first < end; first += PIXEL_LANES) {
        lane_splats s;
        place_lanes(view, g, first, &s);
        if (view->settings.form == RASTER_EWA)
            project_lanes(view, &s);
        for (int lane = 0; lane < PIXEL_LANES && first + (size_t)lane < end; lane++) {
            const size_t i = first + (size_t)lane;
            splat *o = &out[count];
            if (!is_drawable(view, g, i))
                continue;
            o->opacity = g->opacity[i];
            o->id = (uint32_t)i;
            o->depth = (float)s.t[2][lane];
            o->color[0] = g->red[i];
            o->color[1] = g->green[i];
            o->color[2] = g->blue[i];
            count += view->settings.form == RASTER_EWA ? finish_ewa(view, &s, lane, o)
                                                       : finish_ray(view, g, &s, lane, o, &rays[count]);
        }
    }
    return count;
}

#endif
