/* SPDX-License-Identifier: Apache-2.0 */
/* train/adam.c -- Adam on flat arrays. */
#include "train/adam.h"

#include <math.h>

#include "base/clones.h"

adam_rates adam_rates_at(double rate, uint64_t t)
{
    return (adam_rates){.rate = (float)rate,
                        .correct_m = (float)(1 / (1 - pow(0.9, (double)t))),
                        .correct_v = (float)(1 / (1 - pow(0.999, (double)t)))};
}

FASTEST_CLONE void adam_step(float *restrict param, float *restrict gradient, float *restrict m,
                             float *restrict v, size_t count, adam_rates rates)
{
    for (size_t i = 0; i < count; i++) {
        const float g = gradient[i];
        m[i] = 0.9f * m[i] + 0.1f * g;
        v[i] = 0.999f * v[i] + 0.001f * (g * g);
        param[i] -= rates.rate * (m[i] * rates.correct_m) / (sqrtf(v[i] * rates.correct_v) + 1e-15f);
        gradient[i] = 0;
    }
}
