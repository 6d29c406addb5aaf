/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens.c -- the lens of all models as one pipeline: direction to pixel, pixel to direction.

   direction --[kind: X/Z | theta | closed form]--> plane point
        --[radial N/D, tangential, prism]--> distorted --[f, c]--> pixel

   A model is a table row that maps its parameters to this pipeline (base/camera_model.c), so the inversion is
   written once. The radial part is used only up to the first radius at which it stops increasing: beyond it
   the formula folds back into the image, and points there would be drawn over others. docs/cameras.md has the
   formulas. */
#include "base/camera_lens.h"

#include <math.h>
#include <string.h>

#include "base/camera_lens_undistort.h"
#include "base/vec.h"

#define NUMBER double
#define TERMS(name) lens_##name
#include "base/camera_lens_terms.inc.h"

void camera_lens_half_fov_tan(const camera_lens *lens, int width, int height, double tan_half[2])
{
    tan_half[0] = tan_half[1] = 0;
    if (lens->kind == LENS_ORTHOGRAPHIC)
        return;
    /* The full turn of an equirectangular image has, at its centre, w / (2 pi) pixels per radian. */
    const bool turn = lens->kind == LENS_EQUIRECTANGULAR;
    tan_half[0] = width / (2 * (turn ? lens->fx / (2 * PI) : lens->fx));
    tan_half[1] = height / (2 * (turn ? lens->fy / PI : lens->fy));
}

/* Both eigenvalues of the Jacobian have a positive real part: the map has not folded over. */
static bool unfolded(const double j[4]) { return j[0] * j[3] - j[1] * j[2] > 0 && j[0] + j[3] > 0; }

static bool distort(const camera_lens *lens, double p[2])
{
    double d_factor, jacobian[4], out[2];
    const double r2 = p[0] * p[0] + p[1] * p[1];
    if (!(sqrt(r2) <= lens->radius_max))
        return false;
    if (lens->radial && (!lens->extra || lens->extra_last)) {
        const double factor = lens_radial(lens, r2, &d_factor);
        p[0] *= factor;
        p[1] *= factor;
    }
    if (!lens->extra)
        return true;
    lens_mixed(lens, p, out, jacobian);
    p[0] = out[0];
    p[1] = out[1];
    return unfolded(jacobian);
}

/* A coordinate that is NaN, or whose square overflows, has no ray. */
static bool is_usable(const double p[2]) { return fabs(p[0]) < 1e100 && fabs(p[1]) < 1e100; }

/* Unit vector towards (p, z), or, for a fisheye lens, at the angle |p| from the axis. */
static bool unit_direction(const camera_lens *lens, const double p[2], double z, double dir[3])
{
    if (lens->kind == LENS_FISHEYE) {
        const double theta = dvec_length2(p[0], p[1]);
        if (!(theta <= PI))
            return false;
        const double scale = theta > 0 ? sin(theta) / theta : 1;
        dir[0] = p[0] * scale;
        dir[1] = p[1] * scale;
        dir[2] = cos(theta);
    } else {
        const double length = sqrt(p[0] * p[0] + p[1] * p[1] + z * z);
        dir[0] = p[0] / length;
        dir[1] = p[1] / length;
        dir[2] = z / length;
    }
    return true;
}

static bool unproject_fov(const camera_lens *lens, double p[2])
{
    const double omega = fabs(lens->shape[0]), wanted = dvec_length2(p[0], p[1]);
    if (!(wanted * omega < 0.5 * PI))
        return false;
    const double scale = wanted > 0 ? tan(wanted * omega) / (2 * tan(0.5 * omega) * wanted) : 1;
    p[0] *= scale;
    p[1] *= scale;
    return true;
}

/* Solve for Z, with X = x, Y = y and alpha sqrt(beta (X^2 + Y^2) + Z^2) + (1 - alpha) Z = 1. */
static bool unproject_eucm(const camera_lens *lens, const double p[2], double *z)
{
    const double alpha = lens->shape[0], b = lens->shape[1] * (p[0] * p[0] + p[1] * p[1]);
    const double under = 1 - (2 * alpha - 1) * b;
    if (!(under >= 0))
        return false;
    const double below = alpha * sqrt(under) + 1 - alpha;
    *z = below > 0 ? (1 - alpha * alpha * b) / below
                   : 0; /* avoids 0 / 0, for alpha = 1 on the rim, at 90 degrees */
    return true;
}

bool camera_lens_unproject(const camera_lens *lens, double px, double py, double dir_cam[3])
{
    double p[2];
    if (lens->kind == LENS_EQUIRECTANGULAR) {
        const double x = px - lens->cx, y = py - lens->cy;
        if (!(x >= 0 && x <= lens->fx && y >= 0 && y <= lens->fy))
            return false;
        const double longitude = (x / lens->fx - 0.5) * (2 * PI), down = (y / lens->fy - 0.5) * PI;
        dir_cam[0] = cos(down) * sin(longitude);
        dir_cam[1] = sin(down);
        dir_cam[2] = cos(down) * cos(longitude);
        return true;
    }
    p[0] = (px - lens->cx) / lens->fx;
    p[1] = (py - lens->cy) / lens->fy;
    if (!is_usable(p))
        return false;
    double z = 1;
    switch (lens->kind) {
    case LENS_ORTHOGRAPHIC:
        p[0] = p[1] = 0;
        break;
    case LENS_PERSPECTIVE:
    case LENS_FISHEYE:
        if (lens->radial || lens->extra) {
            double x[UNDISTORT_LANES] = {p[0]}, y[UNDISTORT_LANES] = {p[1]};
            camera_lens_undistort(lens, x, y);
            p[0] = x[0];
            p[1] = y[0];
            if (isnan(p[0]))
                return false;
        }
        break;
    case LENS_FOV:
        if (!unproject_fov(lens, p))
            return false;
        break;
    case LENS_DIVISION: {
        const double bend = lens->shape[0] * (p[0] * p[0] + p[1] * p[1]);
        if (bend > 1) /* beyond it the same directions repeat in reverse */
            return false;
        z = 1 + bend;
        break;
    }
    case LENS_EUCM:
        if (!unproject_eucm(lens, p, &z))
            return false;
        break;
    case LENS_EQUIRECTANGULAR:
        return false;
    }
    return unit_direction(lens, p, z, dir_cam);
}

void camera_lens_unproject_row(const camera_lens *lens, double py, int count, double *dir)
{
    if (!lens->radial && !lens->extra) {
        for (int i = 0; i < count; i++, dir += 3)
            if (!camera_lens_unproject(lens, i + 0.5, py, dir))
                memset(dir, 0, 3 * sizeof *dir);
        return;
    }
    for (int first = 0; first < count; first += UNDISTORT_LANES) {
        double x[UNDISTORT_LANES], y[UNDISTORT_LANES];
        for (int l = 0; l < UNDISTORT_LANES; l++) {
            const double p[2] = {(first + l + 0.5 - lens->cx) / lens->fx, (py - lens->cy) / lens->fy};
            x[l] = is_usable(p) ? p[0] : (double)NAN;
            y[l] = p[1];
        }
        camera_lens_undistort(lens, x, y);
        for (int l = 0; l < UNDISTORT_LANES && first + l < count; l++, dir += 3) {
            const double q[2] = {x[l], y[l]};
            if (isnan(q[0]) || !unit_direction(lens, q, 1, dir))
                memset(dir, 0, 3 * sizeof *dir);
        }
    }
}

void camera_lens_origin(const camera_lens *lens, double px, double py, double origin_cam[3])
{
    const bool plane = lens->kind == LENS_ORTHOGRAPHIC;
    origin_cam[0] = plane ? (px - lens->cx) / lens->fx : 0;
    origin_cam[1] = plane ? (py - lens->cy) / lens->fy : 0;
    origin_cam[2] = 0;
}

/* Scale such that (X, Y) times it is the distorted point; false where the lens does not see the point. */
static bool project_closed(const camera_lens *lens, const double point[3], double *scale)
{
    const double x = point[0], y = point[1], z = point[2], rho2 = x * x + y * y;
    if (lens->kind == LENS_DIVISION) {
        const double k = lens->shape[0], under = z * z - 4 * rho2 * k;
        if (!(under >= 0) || (z <= 0 && (k > 0 || rho2 == 0)))
            return false;
        /* Behind the camera the usual formula suffers from cancellation; the equivalent form of the same root
           does not. */
        *scale = z > 0 ? 2 / (z + sqrt(under)) : (z - sqrt(under)) / (2 * rho2 * k);
        return true;
    }
    const double alpha = lens->shape[0], rho = sqrt(lens->shape[1] * rho2 + z * z);
    const double below = alpha * rho + (1 - alpha) * z;
    *scale = 1 / below;
    /* For alpha > 1/2 the image radius is largest where alpha z = -(1 - alpha) rho, and shrinks behind
       that. */
    return below > 0 && (alpha <= 0.5 || alpha * z >= -(1 - alpha) * rho);
}

bool camera_lens_project(const camera_lens *lens, const double point_cam[3], double pixel[2])
{
    const double x = point_cam[0], y = point_cam[1], z = point_cam[2];
    const double rho = dvec_length2(x, y);
    if (!(isfinite(rho) && isfinite(z)) || (rho == 0 && z == 0))
        return false;
    double p[2] = {0, 0}, scale;
    switch (lens->kind) {
    case LENS_EQUIRECTANGULAR:
        pixel[0] = lens->fx * (atan2(x, z) / (2 * PI) + 0.5) + lens->cx;
        pixel[1] = lens->fy * (atan2(y, dvec_length2(x, z)) / PI + 0.5) + lens->cy;
        return true;
    case LENS_PERSPECTIVE:
    case LENS_FOV:
        if (!(z > 0))
            return false;
        p[0] = x / z;
        p[1] = y / z;
        break;
    case LENS_ORTHOGRAPHIC:
        if (!(z > 0))
            return false;
        p[0] = x;
        p[1] = y;
        break;
    case LENS_FISHEYE:
        if (rho == 0 && z < 0) /* exactly behind the camera the image direction is undetermined */
            return false;
        scale = rho > 0 ? atan2(rho, z) / rho : 0;
        p[0] = x * scale;
        p[1] = y * scale;
        break;
    case LENS_DIVISION:
    case LENS_EUCM:
        if (!project_closed(lens, point_cam, &scale))
            return false;
        p[0] = x * scale;
        p[1] = y * scale;
        break;
    }
    if (lens->kind == LENS_FOV) {
        const double omega = lens->shape[0], r = dvec_length2(p[0], p[1]);
        scale = r > 0 ? atan(2 * r * tan(0.5 * omega)) / (r * omega) : 1;
        p[0] *= scale;
        p[1] *= scale;
    } else if ((lens->radial || lens->extra) && !distort(lens, p)) {
        return false;
    }
    const double found_x = lens->fx * p[0] + lens->cx, found_y = lens->fy * p[1] + lens->cy;
    if (!(isfinite(found_x) && isfinite(found_y)))
        return false;
    pixel[0] = found_x;
    pixel[1] = found_y;
    return true;
}
