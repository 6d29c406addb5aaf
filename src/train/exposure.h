/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure.h -- a colour matrix per training photo, learned beside the scene: exposure and white
   balance that differ.

   The scene and the matrices can be traded against each other (a darker scene under brighter matrices), so
   their mean over the photos is held at the identity: the scene has the photos' mean exposure. */
#ifndef GBT_TRAIN_EXPOSURE_H
#define GBT_TRAIN_EXPOSURE_H

#include <stdint.h>

#include "image/affine.h"

/** Start from {0}; free with exposures_free(). */
typedef struct exposures {
    size_t count;                      /* training photos; 0: exposure is not learned */
    float *matrix, *moment1, *moment2; /* [count][AFFINE_NUMBERS] */
    uint64_t *visits;                  /* [count] Adam steps of each */
} exposures;

/** `count` identities. */
gbt_status exposures_make(exposures *e, size_t count, gbt_error *err);
void exposures_free(exposures *e);

/** One Adam step of photo `index`, then the mean of all back to the identity. `gradient` is finite. */
void exposures_step(exposures *e, size_t index, const double gradient[AFFINE_NUMBERS], double rate);

/**
 * The learning rate: a photo is seen 1 / (count * step) times in a run, and must come from the identity to an
 * exposure two stops away.
 *
 * @param progress [in] [0, 1]
 * @param step     [in] progress that one step makes
 */
double exposures_rate(size_t count, double progress, double step);

/** RUN/exposure.json: the matrix of every photo, by name. */
gbt_status exposures_write(const exposures *e, const char *const *names, const char *path, gbt_error *err);

#endif
