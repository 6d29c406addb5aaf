/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens.c -- the lens of all models as one pipeline: direction to pixel, pixel to direction.

   direction --[kind: X/Z | theta | closed form]--> plane point
        --[radial N/D, tangential, prism]--> distorted --[f, c]--> pixel

   A model is a row that says where that one pipeline takes its parameters (base/camera_model.c), so the
   inversion is written once. The radial part is only used up to the first radius where it stops increasing:
   beyond it the formula folds back into the image, and a point there would be drawn on top of others.
   docs/cameras.md has the formulas. */
#include "base/camera_lens.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/camera_lens_radial.h"
#include "base/clones.h"
#include "base/vec.h"

/* Accepted reprojection error of an inversion: absolute part in pixels, and a relative one for points far
   outside the image. */
static const double converged_px = 1e-10, converged_relative = 1e-14;

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

/* Tangential and prism terms at (x, y), and I + their Jacobian (row-major), which is what is missing for the
   map p + extra(p). */
static void extra_terms(const camera_lens *lens, double x, double y, double out[2], double jacobian[4])
{
    const double r2 = x * x + y * y, tx = lens->tangent_x, ty = lens->tangent_y, *s = lens->prism;
    out[0] = tx * (r2 + 2 * x * x) + 2 * ty * x * y + (s[0] + s[1] * r2) * r2;
    out[1] = ty * (r2 + 2 * y * y) + 2 * tx * x * y + (s[2] + s[3] * r2) * r2;
    const double px = 2 * (s[0] + 2 * s[1] * r2), py = 2 * (s[2] + 2 * s[3] * r2);
    jacobian[0] = 1 + 6 * tx * x + 2 * ty * y + px * x;
    jacobian[1] = 2 * tx * y + 2 * ty * x + px * y;
    jacobian[2] = 2 * ty * x + 2 * tx * y + py * x;
    jacobian[3] = 1 + 6 * ty * y + 2 * tx * x + py * y;
}

/* One stage that mixes x and y: p f(|p|^2) + extra(p), with f = 1 when the radial part is a stage of its
   own. */
static void mixed_stage(const camera_lens *lens, const double p[2], double out[2], double jacobian[4])
{
    double d_factor = 0, factor = 1;
    if (!lens->extra_last)
        factor = camera_lens_radial(lens, p[0] * p[0] + p[1] * p[1], &d_factor);
    extra_terms(lens, p[0], p[1], out, jacobian);
    out[0] += p[0] * factor;
    out[1] += p[1] * factor;
    jacobian[0] += factor - 1 + 2 * d_factor * p[0] * p[0];
    jacobian[1] += 2 * d_factor * p[0] * p[1];
    jacobian[2] += 2 * d_factor * p[0] * p[1];
    jacobian[3] += factor - 1 + 2 * d_factor * p[1] * p[1];
}

/* Both eigenvalues have a positive real part: the map has not folded over. */
static bool unfolded(const double j[4]) { return j[0] * j[3] - j[1] * j[2] > 0 && j[0] + j[3] > 0; }

static bool distort(const camera_lens *lens, double p[2])
{
    double d_factor, jacobian[4], out[2];
    const double r2 = p[0] * p[0] + p[1] * p[1];
    if (!(sqrt(r2) <= lens->radius_max))
        return false;
    if (lens->radial && (!lens->extra || lens->extra_last)) {
        const double factor = camera_lens_radial(lens, r2, &d_factor);
        p[0] *= factor;
        p[1] *= factor;
    }
    if (!lens->extra)
        return true;
    mixed_stage(lens, p, out, jacobian);
    p[0] = out[0];
    p[1] = out[1];
    return unfolded(jacobian);
}

/* Accepted distance between a wanted distorted point and the one reached, in units of the plane. */
static double tolerance_of(const camera_lens *lens, double radius)
{
    return converged_px / fmax(lens->fx, lens->fy) + converged_relative * radius;
}

/* Solve r f(r^2) = wanted in [0, radius_max], where the left side increases: Newton, kept inside a shrinking
   bracket. Ends after a step that is at most `enough` of the radius, which 0 never is; then how near it came
   is not asked. */
static bool invert_radius(const camera_lens *lens, double wanted, double enough, double *radius)
{
    if (!(wanted <= lens->distorted_max))
        return false;
    double lo = 0, hi = lens->radius_max, r = wanted < hi ? wanted : hi, residual = 0;
    for (int i = 0; i < 200; i++) {
        double d_factor;
        const double factor = camera_lens_radial(lens, r * r, &d_factor);
        residual = r * factor - wanted;
        const double step = residual / (factor + 2 * r * r * d_factor);
        if (fabs(step) <= 2e-16 * r || residual == 0)
            break;
        if (residual > 0)
            hi = r;
        else
            lo = r;
        const bool last = fabs(step) <= enough * r;
        r = r - step > lo && r - step < hi ? r - step : 0.5 * (lo + hi);
        if (last)
            break;
    }
    *radius = r;
    return enough > 0 || fabs(residual) <= tolerance_of(lens, wanted);
}

/* 256 bits: GCC takes wider vectors apart value by value where the processor has none. */
enum { LANES = 4 };
typedef double lanes4 __attribute__((vector_size(32)));
typedef int64_t mask4 __attribute__((vector_size(32)));
#define PICK(mask, yes, no) ((lanes4)(((mask) & (mask4)(yes)) | (~(mask) & (mask4)(no))))

/* invert_radius() with `enough` 0 of several at a time, the same operations on each; -1 where it fails. */
FASTEST_CLONE static void invert_radii(const camera_lens *lens, const double wanted_radii[LANES],
                                       double radii[LANES])
{
    const lanes4 zero = {0}, most = zero + lens->radius_max;
    lanes4 wanted, lo = zero, hi = most, residual = zero;
    memcpy(&wanted, wanted_radii, sizeof wanted);
    const mask4 within = wanted <= lens->distorted_max;
    mask4 active = within;
    lanes4 r = PICK(wanted < most, wanted, most);
    for (int i = 0; i < 200 && (active[0] | active[1] | active[2] | active[3]) != 0; i++) {
        const lanes4 x = r * r;
        lanes4 n = zero, dn = zero, d = zero, dd = zero;
        for (int k = lens->numerator_count - 1; k >= 0; k--) {
            dn = dn * x + n;
            n = n * x + lens->numerator[k];
        }
        lanes4 factor = n, d_factor = dn;
        if (lens->denominator_count > 1) {
            for (int k = lens->denominator_count - 1; k >= 0; k--) {
                dd = dd * x + d;
                d = d * x + lens->denominator[k];
            }
            factor = n / d;
            d_factor = (dn - factor * dd) / d;
        }
        residual = PICK(active, r * factor - wanted, residual);
        const lanes4 step = residual / (factor + 2 * r * r * d_factor);
        active &= ~((PICK(step < 0, -step, step) <= 2e-16 * r) | (residual == 0));
        hi = PICK(active & (residual > 0), r, hi);
        lo = PICK(active & ~(residual > 0), r, lo);
        const lanes4 next = r - step;
        r = PICK(active, PICK((next > lo) & (next < hi), next, 0.5 * (lo + hi)), r);
    }
    const lanes4 tolerance = tolerance_of(lens, 0) + converged_relative * wanted;
    r = PICK(within & (PICK(residual < 0, -residual, residual) <= tolerance), r, zero - 1);
    memcpy(radii, &r, sizeof r);
}

static bool invert_radial(const camera_lens *lens, double enough, double p[2])
{
    const double wanted = dvec_length2(p[0], p[1]);
    double radius;
    if (!invert_radius(lens, wanted, enough, &radius))
        return false;
    if (wanted > 0) {
        p[0] *= radius / wanted;
        p[1] *= radius / wanted;
    }
    return true;
}

/* Newton on the 2x2 Jacobian from `p`, each step halved until it comes nearer; ends when rounding stops all
   progress. */
static bool invert_mixed(const camera_lens *lens, const double wanted[2], double p[2])
{
    double out[2], j[4];
    mixed_stage(lens, p, out, j);
    double rx = out[0] - wanted[0], ry = out[1] - wanted[1];
    /* No step comes nearer than this, so none need be halved in search of one. */
    const double rounding = 5e-16 * (fabs(wanted[0]) + fabs(wanted[1]));
    for (int i = 0; i < 50 && fabs(rx) + fabs(ry) > rounding; i++) {
        const double determinant = j[0] * j[3] - j[1] * j[2];
        const double step_x = (j[3] * rx - j[1] * ry) / determinant,
                     step_y = (j[0] * ry - j[2] * rx) / determinant;
        bool nearer = false;
        for (double part = 1; part > 1e-3 && !nearer; part *= 0.5) {
            const double tried[2] = {p[0] - part * step_x, p[1] - part * step_y};
            double tried_j[4];
            mixed_stage(lens, tried, out, tried_j);
            const double tx = out[0] - wanted[0], ty = out[1] - wanted[1];
            nearer = tx * tx + ty * ty < rx * rx + ry * ry;
            if (nearer) {
                p[0] = tried[0];
                p[1] = tried[1];
                rx = tx;
                ry = ty;
                memcpy(j, tried_j, sizeof j);
            }
        }
        if (!nearer)
            break;
    }
    return dvec_length2(rx, ry) <= tolerance_of(lens, dvec_length2(wanted[0], wanted[1])) && unfolded(j);
}

static bool undistort(const camera_lens *lens, double p[2])
{
    if (lens->extra) {
        const double wanted[2] = {p[0], p[1]};
        if (lens->radial && !lens->extra_last && !invert_radial(lens, 1e-3, p)) {
            /* The extra terms may reach a little beyond the radial range: start inside it. */
            const double scale = 0.9 * lens->radius_max / dvec_length2(wanted[0], wanted[1]);
            p[0] = wanted[0] * scale;
            p[1] = wanted[1] * scale;
        }
        if (!invert_mixed(lens, wanted, p))
            return false;
    }
    if (lens->radial && (!lens->extra || lens->extra_last) && !invert_radial(lens, 0, p))
        return false;
    return dvec_length2(p[0], p[1]) <= lens->radius_max;
}

/* A coordinate that is not a number, or whose square is not, has no ray. */
static bool is_usable(const double p[2]) { return fabs(p[0]) < 1e100 && fabs(p[1]) < 1e100; }

/* Towards (p, z), or, by a fisheye, at the angle |p|. */
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

/* Z from X = x, Y = y and alpha sqrt(beta (X^2 + Y^2) + Z^2) + (1 - alpha) Z = 1. */
static bool unproject_eucm(const camera_lens *lens, const double p[2], double *z)
{
    const double alpha = lens->shape[0], b = lens->shape[1] * (p[0] * p[0] + p[1] * p[1]);
    const double under = 1 - (2 * alpha - 1) * b;
    if (!(under >= 0))
        return false;
    const double below = alpha * sqrt(under) + 1 - alpha;
    *z = below > 0 ? (1 - alpha * alpha * b) / below
                   : 0; /* 0 / 0 only for alpha = 1 on the rim, at 90 degrees */
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
        if ((lens->radial || lens->extra) && !undistort(lens, p))
            return false;
        break;
    case LENS_FOV:
        if (!unproject_fov(lens, p))
            return false;
        break;
    case LENS_DIVISION: {
        const double bend = lens->shape[0] * (p[0] * p[0] + p[1] * p[1]);
        if (bend > 1) /* the same directions again, in reverse */
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
    if (!lens->radial || lens->extra) {
        for (int i = 0; i < count; i++, dir += 3)
            if (!camera_lens_unproject(lens, i + 0.5, py, dir))
                memset(dir, 0, 3 * sizeof *dir);
        return;
    }
    for (int first = 0; first < count; first += LANES) {
        double p[LANES][2], wanted[LANES], radius[LANES];
        for (int l = 0; l < LANES; l++) {
            p[l][0] = (first + l + 0.5 - lens->cx) / lens->fx;
            p[l][1] = (py - lens->cy) / lens->fy;
            wanted[l] = is_usable(p[l]) ? dvec_length2(p[l][0], p[l][1]) : (double)NAN;
        }
        invert_radii(lens, wanted, radius);
        for (int l = 0; l < LANES && first + l < count; l++, dir += 3) {
            const double scale = wanted[l] > 0 ? radius[l] / wanted[l] : 1;
            const double q[2] = {p[l][0] * scale, p[l][1] * scale};
            if (!(radius[l] >= 0 && dvec_length2(q[0], q[1]) <= lens->radius_max &&
                  unit_direction(lens, q, 1, dir)))
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

/* (X, Y) times the returned scale is the distorted point; false where the lens does not see. */
static bool project_closed(const camera_lens *lens, const double point[3], double *scale)
{
    const double x = point[0], y = point[1], z = point[2], rho2 = x * x + y * y;
    if (lens->kind == LENS_DIVISION) {
        const double k = lens->shape[0], under = z * z - 4 * rho2 * k;
        if (!(under >= 0) || (z <= 0 && (k > 0 || rho2 == 0)))
            return false;
        /* Behind the camera the usual form cancels; the other root of the same quadratic does not. */
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
        if (rho == 0 && z < 0) /* exactly behind: every direction of the image border is equally right */
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
