/* SPDX-License-Identifier: Apache-2.0 */
/* base/sky.c -- evaluate a background whose colour depends on direction. */
#include "base/sky.h"

#include "base/clones.h"

static const float horizon_steepness = 10;

/* The share of the sky in the colour: 1 without a horizon. */
static inline float share_of_sky(const sky *s, const float dir[3])
{
    if (!s->has_horizon)
        return 1;
    const float q = horizon_steepness * (s->up[0] * dir[0] + s->up[1] * dir[1] + s->up[2] * dir[2]);
    return q < 0 ? 0 : q > 1 ? 1 : q;
}

void sky_basis(const sky *s, const float dir[3], float y[SH_COUNT])
{
    const float share = share_of_sky(s, dir);
    sh_basis(dir, y);
    y[0] = 1;
    for (int k = 0; k < SH_COUNT; k++)
        y[k] *= share;
}

void sky_color(const sky *s, const float color[3], const float dir[3], float out[3])
{
    float dirs[3][SKY_LANES], colors[3][SKY_LANES];
    for (int k = 0; k < 3; k++)
        for (int lane = 0; lane < SKY_LANES; lane++)
            dirs[k][lane] = dir[k];
    sky_colors(s, color, dirs, colors);
    for (int c = 0; c < 3; c++)
        out[c] = colors[c][0];
}

FASTEST_CLONE static void varying_colors(const sky *s, const float color[3], float dir[3][SKY_LANES],
                                         float out[3][SKY_LANES])
{
    float basis[SH_COUNT][SKY_LANES], share[SKY_LANES];
    for (int lane = 0; lane < SKY_LANES; lane++) {
        const float d[3] = {dir[0][lane], dir[1][lane], dir[2][lane]};
        float y[SH_COUNT];
        sh_basis(d, y);
        share[lane] = share_of_sky(s, d);
        for (int k = 0; k < SH_COUNT; k++)
            basis[k][lane] = y[k];
    }
    for (int c = 0; c < 3; c++)
        for (int lane = 0; lane < SKY_LANES; lane++) {
            float sum = color[c];
            for (int k = 1; k < SH_COUNT; k++)
                sum += s->harmonic[k - 1][c] * basis[k][lane];
            sum = sum < 0 ? 0 : sum; /* NaN stays NaN */
            sum = sum > 1 ? 1 : sum;
            out[c][lane] = s->has_horizon ? s->ground[c] + share[lane] * (sum - s->ground[c]) : sum;
        }
}

void sky_colors(const sky *s, const float color[3], float dir[3][SKY_LANES], float out[3][SKY_LANES])
{
    if (s->varies) {
        varying_colors(s, color, dir, out);
        return;
    }
    for (int c = 0; c < 3; c++)
        for (int lane = 0; lane < SKY_LANES; lane++)
            out[c][lane] = color[c];
}

void sky_color_exact(const sky *s, const float color[3], const double dir[3], double out[3])
{
    double y[SH_COUNT], share = 0;
    sh_basis_exact(dir, y);
    for (int k = 0; k < 3; k++)
        share += (double)horizon_steepness * (double)s->up[k] * dir[k];
    share = share < 0 ? 0 : share > 1 ? 1 : share;
    for (int c = 0; c < 3; c++) {
        out[c] = (double)color[c];
        for (int k = 1; k < SH_COUNT && s->varies; k++)
            out[c] += (double)s->harmonic[k - 1][c] * y[k];
        if (s->varies)
            out[c] = out[c] < 0 ? 0 : out[c] > 1 ? 1 : out[c];
        if (s->varies && s->has_horizon)
            out[c] = (double)s->ground[c] + share * (out[c] - (double)s->ground[c]);
    }
}
