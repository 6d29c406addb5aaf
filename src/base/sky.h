/* SPDX-License-Identifier: Apache-2.0 */
/* base/sky.h -- a background whose colour depends on the direction of a ray alone: what is infinitely far. */
#ifndef GBT_BASE_SKY_H
#define GBT_BASE_SKY_H

#include <stdbool.h>

#include "base/sh.h"

enum { SKY_HARMONICS = SH_COUNT - 1, SKY_LANES = 16 };

/**
 * Seen in the unit direction d: a colour, and the sum over k of harmonic[k] times the real spherical harmonic
 * k + 1 at d, cut to [0, 1]. In the order of base/sh.h. Without `varies` it is
 * the one colour, not cut.
 */
typedef struct sky {
    bool varies;
    float harmonic[SKY_HARMONICS][3];
} sky;

/** The harmonics at a unit direction, the constant one, with the value 1, first. */
void sky_basis(const float dir[3], float y[SH_COUNT]);

/** The colour in one direction. */
void sky_color(const sky *s, const float color[3], const float dir[3], float out[3]);

/** In sixteen directions, to the same bits. */
void sky_colors(const sky *s, const float color[3], float dir[3][SKY_LANES], float out[3][SKY_LANES]);

/** In double, from the same coefficients. */
void sky_color_exact(const sky *s, const float color[3], const double dir[3], double out[3]);

#endif
