/* SPDX-License-Identifier: Apache-2.0 */
/* frame/screen.c -- the reference's visibility test by projected splats (Kerbl 2023, eq 5; docs/crosscheck.md
   has its constants). */
#include "frame/screen.h"

#include <math.h>

#include "base/vec.h"
#include "raster/raster.h"

enum { TILE = 16 };
static const double radius_sigmas = 3, difference_min = 0.1;

screen_view screen_of(const gbt_camera *camera, double near)
{
    screen_view s = {.near = near};
    const int side[2] = {camera->width, camera->height};
    const bool one = camera->model == GBT_CAMERA_SIMPLE_PINHOLE;
    for (int i = 0; i < 9; i++)
        s.rotation[i] = camera->rotation[i];
    for (int k = 0; k < 3; k++)
        s.center[k] = camera->center[k];
    for (int k = 0; k < 2; k++) {
        s.focal[k] = camera->params[one ? 0 : k];
        s.principal[k] = camera->params[one ? 1 + k : 2 + k] - 0.5;
        s.tiles[k] = (side[k] + TILE - 1) / TILE;
    }
    raster_limits(camera, s.low, s.high);
    return s;
}

/* One row of J R M, where M is the Gaussian's axes times its scales; products of two rows are the entries of
   its image covariance. */
static void project_axis(const screen_view *s, int k, const double t[3], const double axes[9], double row[3])
{
    const double ratio = fmax(s->low[k], fmin(s->high[k], t[k] / t[2])), scale = s->focal[k] / t[2];
    for (int i = 0; i < 3; i++)
        row[i] = scale * (axes[3 * k + i] - ratio * axes[6 + i]);
}

bool screen_touches(const screen_view *s, const float mean[3], const float quat[4], const float scale[3])
{
    double offset[3], t[3], q[4], turned[9], axes[9], row[2][3];
    for (int k = 0; k < 3; k++)
        offset[k] = (double)mean[k] - s->center[k];
    dmat_apply(s->rotation, offset, t);
    if (!(t[2] > s->near))
        return false;
    for (int k = 0; k < 4; k++)
        q[k] = (double)quat[k];
    dquat_to_matrix(q, turned);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                sum += s->rotation[3 * r + k] * turned[3 * k + c];
            axes[3 * r + c] = sum * (double)scale[c];
        }
    for (int k = 0; k < 2; k++)
        project_axis(s, k, t, axes, row[k]);
    const double dilation = (double)raster_settings_default().dilation;
    const double xx = dvec_dot(row[0], row[0]) + dilation, yy = dvec_dot(row[1], row[1]) + dilation,
                 xy = dvec_dot(row[0], row[1]);
    const double middle = 0.5 * (xx + yy),
                 largest = middle + sqrt(fmax(difference_min, middle * middle - (xx * yy - xy * xy)));
    const double radius = ceil(radius_sigmas * sqrt(largest));
    if (!isfinite(radius))
        return false;
    for (int k = 0; k < 2; k++) { /* tiles: the first one touched, and the one after the last */
        const double at = s->focal[k] * t[k] / t[2] + s->principal[k];
        const double first = fmax(floor((at - radius) / TILE), 0),
                     end = fmin(floor((at + radius + TILE - 1) / TILE), s->tiles[k]);
        if (!(first < end))
            return false;
    }
    return true;
}
