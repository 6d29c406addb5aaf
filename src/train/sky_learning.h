/* SPDX-License-Identifier: Apache-2.0 */
/* train/sky_learning.h -- the direction-dependent background, learned together with the scene. */
#ifndef GBT_TRAIN_SKY_LEARNING_H
#define GBT_TRAIN_SKY_LEARNING_H

#include "trace/settings.h"
#include "train/adam.h"

/** Trainable numbers: the constant colour, then the coefficients of the harmonics. */
enum { SKY_NUMBERS = SH_COUNT * 3 };

/** Adam moments of one sky. Start from {0}. */
typedef struct sky_moments {
    float first[SKY_NUMBERS], second[SKY_NUMBERS];
    float packed[SKY_NUMBERS]; /* buffer for sky_pack() */
} sky_moments;

/** Copy all coefficients into one array, and back. */
void sky_pack(const trace_settings *s, float out[SKY_NUMBERS]);
void sky_unpack(const float in[SKY_NUMBERS], trace_settings *s);

/** One Adam step of s->background and s->sky. `gradient` is finite. */
void sky_step(trace_settings *s, sky_moments *m, double gradient[SH_COUNT][3], adam_rates rates);

/** The learning rate at a progress in [0, 1]. */
double sky_rate(double progress);

#endif
