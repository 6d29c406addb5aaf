/* SPDX-License-Identifier: Apache-2.0 */
/* train/adam.h -- Adam on flat arrays (Kingma 2015, algorithm 1), no weight decay. */
#ifndef GBT_TRAIN_ADAM_H
#define GBT_TRAIN_ADAM_H

#include <stddef.h>
#include <stdint.h>

typedef struct adam_rates {
    float rate;      /* learning rate */
    float correct_m; /* 1 / (1 - beta1^t) */
    float correct_v; /* 1 / (1 - beta2^t) */
} adam_rates;

/** Bias corrections for step t >= 1. */
adam_rates adam_rates_at(double rate, uint64_t t);

/**
 * One step on `count` numbers: m = 0.9 m + 0.1 g; v = 0.999 v + 0.001 g^2; p -= rate m' / (sqrt(v') + 1e-15).
 *
 * `gradient` is set to 0 afterwards. Plain arithmetic in a fixed order per element: same bits everywhere.
 */
void adam_step(float *param, float *gradient, float *m, float *v, size_t count, adam_rates rates);

#endif
