/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_radial.h -- the radial factor of a lens and its derivative. */
#ifndef GBT_BASE_CAMERA_LENS_RADIAL_H
#define GBT_BASE_CAMERA_LENS_RADIAL_H

#include "base/camera_lens.h"

/** Radial factor f(x) = N / D at x = squared radius, and df/dx. */
static inline double camera_lens_radial(const camera_lens *lens, double x, double *d_factor)
{
    double n = 0, dn = 0, d = 0, dd = 0;
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
    const double factor = n / d;
    *d_factor = (dn - factor * dd) / d;
    return factor;
}

#endif
