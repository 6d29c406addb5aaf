/* SPDX-License-Identifier: Apache-2.0 */
/* train/adam.c -- Adam on flat arrays. */
#include "train/adam.h"

#include <math.h>

#include "base/clones.h"

adam_rates adam_rates_at(double rate, uint64_t t) { return adam_rates_of_views(rate, t, 1); }

adam_rates adam_rates_of_views(double rate, uint64_t t, int views)
{
    const double beta1 = pow(0.9, views), beta2 = pow(0.999, views), n = (double)t * views;
    return (adam_rates){.rate = (float)rate,
                        .correct_m = (float)(1 / (1 - pow(0.9, n))),
                        .correct_v = (float)(1 / (1 - pow(0.999, n))),
                        .beta1 = (float)beta1,
                        .beta2 = (float)beta2,
                        .new1 = (float)(1 - beta1),
                        .new2 = (float)(1 - beta2)};
}

FASTEST_CLONE void adam_step(float *restrict param, float *restrict gradient, float *restrict m,
                             float *restrict v, size_t count, adam_rates rates)
{
    for (size_t i = 0; i < count; i++) {
        const float g = gradient[i];
        m[i] = rates.beta1 * m[i] + rates.new1 * g;
        v[i] = rates.beta2 * v[i] + rates.new2 * (g * g);
        param[i] -= rates.rate * (m[i] * rates.correct_m) / (sqrtf(v[i] * rates.correct_v) + 1e-15f);
        gradient[i] = 0;
    }
}
