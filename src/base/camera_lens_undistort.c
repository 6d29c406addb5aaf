/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_undistort.c -- invert lens distortion by Newton's method, several points at a time. */
#include "base/camera_lens_undistort.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/clones.h"
#include "base/vec.h"

/* Accepted reprojection error of an inversion: absolute part in pixels, and a relative one for points far
   outside the image. */
static const double converged_px = 1e-10, converged_relative = 1e-14;

/* 256 bits: GCC splits wider vectors into single values on processors without them. */
enum { LANES = UNDISTORT_LANES };
typedef double lanes4 __attribute__((vector_size(32)));
typedef int64_t mask4 __attribute__((vector_size(32)));
#define PICK(mask, yes, no) ((lanes4)(((mask) & (mask4)(yes)) | (~(mask) & (mask4)(no))))
#define INTO static inline __attribute__((always_inline)) /* inlined into each clone */

#define NUMBER lanes4
#define TERMS(name) name##_of_lanes
#include "base/camera_lens_terms.inc.h"

INTO bool any(mask4 mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

INTO lanes4 absolute(lanes4 a) { return PICK(a < 0, -a, a); }

INTO lanes4 length2(lanes4 x, lanes4 y)
{
    lanes4 out;
    for (int l = 0; l < LANES; l++)
        out[l] = dvec_length2(x[l], y[l]);
    return out;
}

/* Accepted distance between the wanted distorted point and the one reached, in units of the image plane at
   depth 1. */
INTO lanes4 tolerance_of(const camera_lens *lens, lanes4 radius)
{
    return converged_px / fmax(lens->fx, lens->fy) + converged_relative * radius;
}

/* Solve r f(r^2) = wanted in [0, radius_max], where the left side increases: Newton's method inside a
   shrinking bracket. With `enough` > 0 it ends after a step of at most `enough` times the radius, without
   checking the residual. -1 where there is no solution. */
INTO lanes4 invert_radius(const camera_lens *lens, lanes4 wanted, double enough)
{
    const lanes4 zero = {0}, most = zero + lens->radius_max;
    lanes4 lo = zero, hi = most, residual = zero;
    const mask4 within = wanted <= lens->distorted_max;
    mask4 active = within;
    lanes4 r = PICK(wanted < most, wanted, most);
    for (int i = 0; i < 200 && any(active); i++) {
        lanes4 d_factor;
        const lanes4 factor = radial_of_lanes(lens, r * r, &d_factor);
        residual = PICK(active, r * factor - wanted, residual);
        const lanes4 step = residual / (factor + 2 * r * r * d_factor);
        active &= ~((absolute(step) <= 2e-16 * r) | (residual == 0));
        const mask4 last = absolute(step) <= enough * r;
        hi = PICK(active & (residual > 0), r, hi);
        lo = PICK(active & ~(residual > 0), r, lo);
        const lanes4 next = r - step;
        r = PICK(active, PICK((next > lo) & (next < hi), next, 0.5 * (lo + hi)), r);
        active &= ~last;
    }
    const mask4 near = absolute(residual) <= tolerance_of(lens, wanted);
    return PICK(enough > 0 ? within : within & near, r, zero - 1);
}

/* Invert the radial part alone. True where that succeeded; elsewhere `p` is unchanged. */
INTO mask4 invert_radial(const camera_lens *lens, double enough, lanes4 p[2])
{
    const lanes4 one = {1, 1, 1, 1}, wanted = length2(p[0], p[1]),
                 radius = invert_radius(lens, wanted, enough);
    const mask4 found = radius >= 0;
    const lanes4 scale = PICK(found & (wanted > 0), radius / wanted, one);
    p[0] *= scale;
    p[1] *= scale;
    return found;
}

/* Newton's method with the 2x2 Jacobian, started at `p`; each step is halved until it reduces the residual,
   and iteration ends when rounding stops all progress. True where it reached `wanted`. */
INTO mask4 invert_mixed(const camera_lens *lens, const lanes4 wanted[2], lanes4 p[2])
{
    lanes4 out[2], j[4];
    mixed_of_lanes(lens, p, out, j);
    lanes4 rx = out[0] - wanted[0], ry = out[1] - wanted[1];
    /* Rounding level of the residual: below it, halving steps cannot improve anything. */
    const lanes4 rounding = 5e-16 * (absolute(wanted[0]) + absolute(wanted[1]));
    mask4 active = absolute(rx) + absolute(ry) > rounding;
    for (int i = 0; i < 50 && any(active); i++) {
        const lanes4 determinant = j[0] * j[3] - j[1] * j[2];
        const lanes4 step_x = (j[3] * rx - j[1] * ry) / determinant,
                     step_y = (j[0] * ry - j[2] * rx) / determinant;
        mask4 farther = active;
        for (double part = 1; part > 1e-3 && any(farther); part *= 0.5) {
            const lanes4 tried[2] = {p[0] - part * step_x, p[1] - part * step_y};
            lanes4 tried_j[4];
            mixed_of_lanes(lens, tried, out, tried_j);
            const lanes4 tx = out[0] - wanted[0], ty = out[1] - wanted[1];
            const mask4 nearer = farther & (tx * tx + ty * ty < rx * rx + ry * ry);
            for (int k = 0; k < 2; k++)
                p[k] = PICK(nearer, tried[k], p[k]);
            for (int k = 0; k < 4; k++)
                j[k] = PICK(nearer, tried_j[k], j[k]);
            rx = PICK(nearer, tx, rx);
            ry = PICK(nearer, ty, ry);
            farther &= ~nearer;
        }
        active &= ~farther & (absolute(rx) + absolute(ry) > rounding);
    }
    /* Both eigenvalues of the Jacobian have a positive real part: the map has not folded over. */
    const mask4 unfolded = (j[0] * j[3] - j[1] * j[2] > 0) & (j[0] + j[3] > 0);
    return unfolded & (length2(rx, ry) <= tolerance_of(lens, length2(wanted[0], wanted[1])));
}

FASTEST_CLONE void camera_lens_undistort(const camera_lens *lens, double x[LANES], double y[LANES])
{
    const lanes4 zero = {0};
    lanes4 p[2];
    memcpy(&p[0], x, sizeof p[0]);
    memcpy(&p[1], y, sizeof p[1]);
    mask4 found = zero == zero;
    if (lens->extra) {
        const lanes4 wanted[2] = {p[0], p[1]};
        if (lens->radial && !lens->extra_last) {
            const mask4 inside = invert_radial(lens, 1e-3, p);
            /* Extra terms may move the point slightly beyond the radial range, so start inside it. */
            const lanes4 scale = 0.9 * lens->radius_max / length2(wanted[0], wanted[1]);
            p[0] = PICK(inside, p[0], wanted[0] * scale);
            p[1] = PICK(inside, p[1], wanted[1] * scale);
        }
        found &= invert_mixed(lens, wanted, p);
    }
    if (lens->radial && (!lens->extra || lens->extra_last))
        found &= invert_radial(lens, 0, p);
    found &= length2(p[0], p[1]) <= lens->radius_max;
    const lanes4 none = zero + (double)NAN;
    p[0] = PICK(found, p[0], none);
    p[1] = PICK(found, p[1], none);
    memcpy(x, &p[0], sizeof p[0]);
    memcpy(y, &p[1], sizeof p[1]);
}
