/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_terms.inc.h -- formulas of lens distortion and their derivatives, generic in the number
   type. Before each include, define NUMBER (double, or a vector of doubles) and TERMS(name), which makes the
   function names. */
#include "base/camera_lens.h"

/** Radial factor f(x) = N / D at x = squared radius, and df/dx. */
static inline __attribute__((always_inline)) NUMBER TERMS(radial)(const camera_lens *lens, NUMBER x,
                                                                  NUMBER *d_factor)
{
    NUMBER n = {0}, dn = {0}, d = {0}, dd = {0};
    for (int i = lens->numerator_count - 1; i >= 0; i--) {
        dn = dn * x + n;
        n = n * x + lens->numerator[i];
    }
    if (lens->denominator_count == 1) {
        *d_factor = dn;
        return n;
    }
    for (int i = lens->denominator_count - 1; i >= 0; i--) {
        dd = dd * x + d;
        d = d * x + lens->denominator[i];
    }
    const NUMBER factor = n / d;
    *d_factor = (dn - factor * dd) / d;
    return factor;
}

/** Tangential and prism terms at (x, y), and I + their Jacobian (row-major), which is the Jacobian of p +
    extra(p). */
static inline __attribute__((always_inline)) void TERMS(extra)(const camera_lens *lens, NUMBER x, NUMBER y,
                                                               NUMBER out[2], NUMBER jacobian[4])
{
    const double tx = lens->tangent_x, ty = lens->tangent_y, *s = lens->prism;
    const NUMBER r2 = x * x + y * y;
    out[0] = tx * (r2 + 2 * x * x) + 2 * ty * x * y + (s[0] + s[1] * r2) * r2;
    out[1] = ty * (r2 + 2 * y * y) + 2 * tx * x * y + (s[2] + s[3] * r2) * r2;
    const NUMBER px = 2 * (s[0] + 2 * s[1] * r2), py = 2 * (s[2] + 2 * s[3] * r2);
    jacobian[0] = 1 + 6 * tx * x + 2 * ty * y + px * x;
    jacobian[1] = 2 * tx * y + 2 * ty * x + px * y;
    jacobian[2] = 2 * ty * x + 2 * tx * y + py * x;
    jacobian[3] = 1 + 6 * ty * y + 2 * tx * x + py * y;
}

/** One stage that mixes x and y: p f(|p|^2) + extra(p), with f = 1 when the radial part is a stage of its
    own. */
static inline __attribute__((always_inline)) void TERMS(mixed)(const camera_lens *lens, const NUMBER p[2],
                                                               NUMBER out[2], NUMBER jacobian[4])
{
    NUMBER d_factor = {0}, factor = {0};
    factor = factor + 1;
    if (!lens->extra_last)
        factor = TERMS(radial)(lens, p[0] * p[0] + p[1] * p[1], &d_factor);
    TERMS(extra)(lens, p[0], p[1], out, jacobian);
    out[0] += p[0] * factor;
    out[1] += p[1] * factor;
    jacobian[0] += factor - 1 + 2 * d_factor * p[0] * p[0];
    jacobian[1] += 2 * d_factor * p[0] * p[1];
    jacobian[2] += 2 * d_factor * p[0] * p[1];
    jacobian[3] += factor - 1 + 2 * d_factor * p[1] * p[1];
}

#undef NUMBER
#undef TERMS
