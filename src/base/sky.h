/* SPDX-License-Identifier: Apache-2.0 */
/* base/sky.h -- a background at infinity, whose colour depends only on the direction of a ray. */
#ifndef GBT_BASE_SKY_H
#define GBT_BASE_SKY_H

#include <stdbool.h>

#include "base/sh.h"

enum { SKY_HARMONICS = SH_COUNT - 1, SKY_LANES = 16 };

/**
 * The colour in the unit direction d is a constant colour plus the sum over k of harmonic[k] times the real
 * spherical harmonic k + 1 at d (in the order of base/sh.h), clamped to [0, 1]. Without `varies` it is the
 * constant colour, not clamped.
 *
 * Below a horizon there is no sky: with `has_horizon` the colour is q times that plus 1 - q times `ground`,
 * where q = 10 d . up, clamped to [0, 1]. So the sky begins at the horizon and is whole 5.7 degrees above it.
 */
typedef struct sky {
    bool varies, has_horizon;
    float up[3];     /* unit */
    float ground[3]; /* in [0, 1] */
    float harmonic[SKY_HARMONICS][3];
} sky;

/** What the colour at a unit direction is linear in, clamping aside: first the coefficient of the constant
    colour, then those of the harmonics. */
void sky_basis(const sky *s, const float dir[3], float y[SH_COUNT]);

/** The colour in one direction. */
void sky_color(const sky *s, const float color[3], const float dir[3], float out[3]);

/** The colours in sixteen directions, with the same bits. */
void sky_colors(const sky *s, const float color[3], float dir[3][SKY_LANES], float out[3][SKY_LANES]);

/** The colour in double, from the same coefficients. */
void sky_color_exact(const sky *s, const float color[3], const double dir[3], double out[3]);

#endif
