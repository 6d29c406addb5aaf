/* SPDX-License-Identifier: Apache-2.0 */
/* train/sky_learning.c -- Adam over the coefficients of the background. */
#include "train/sky_learning.h"

#include <math.h>
#include <string.h>

#include "train/adam.h"

void sky_pack(const trace_settings *s, float out[SKY_NUMBERS])
{
    memcpy(out, s->background, sizeof s->background);
    memcpy(out + 3, s->sky.harmonic, sizeof s->sky.harmonic);
}

void sky_unpack(const float in[SKY_NUMBERS], trace_settings *s)
{
    memcpy(s->background, in, sizeof s->background);
    memcpy(s->sky.harmonic, in + 3, sizeof s->sky.harmonic);
}

void sky_step(trace_settings *s, sky_moments *m, double gradient[SH_COUNT][3], adam_rates rates)
{
    float values[SKY_NUMBERS], g[SKY_NUMBERS];
    for (int k = 0; k < SKY_NUMBERS; k++)
        g[k] = (float)gradient[k / 3][k % 3];
    sky_pack(s, values);
    adam_step(values, g, m->first, m->second, SKY_NUMBERS, rates);
    sky_unpack(values, s);
}

double sky_rate(double progress)
{
    const double first = 0.01, last = 0.02; /* as a fraction of first */
    return first * exp(progress * log(last));
}
