/* SPDX-License-Identifier: Apache-2.0 */
/* train/adam.h -- Adam on flat arrays (Kingma 2015, algorithm 1), no weight decay. */
#ifndef GBT_TRAIN_ADAM_H
#define GBT_TRAIN_ADAM_H

#include <stddef.h>
#include <stdint.h>

typedef struct adam_rates {
    float rate;         /* learning rate */
    float correct_m;    /* 1 / (1 - beta1^t) */
    float correct_v;    /* 1 / (1 - beta2^t) */
    float beta1, beta2; /* 0.9 and 0.999 */
    float new1, new2;   /* 1 - beta1, 1 - beta2 */
} adam_rates;

/** Bias corrections for step t >= 1. */
adam_rates adam_rates_at(double rate, uint64_t t);

/** The same for gradients that are means over `views` views: 0.9^views and 0.999^views, so that the moments
    forget as much in a step as in `views` steps of one view (Malladi 2022; Zhao 2025). */
adam_rates adam_rates_of_views(double rate, uint64_t t, int views);

/**
 * One step on `count` numbers: m = beta1 m + (1 - beta1) g; v = beta2 v + (1 - beta2) g^2; p -= rate m' /
 * (sqrt(v') + 1e-15).
 *
 * `gradient` is set to 0 afterwards. Plain arithmetic in a fixed order per element: same bits everywhere.
 */
void adam_step(float *param, float *gradient, float *m, float *v, size_t count, adam_rates rates);

#endif
