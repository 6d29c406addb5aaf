/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure.h -- a colour matrix per training photo, learned together with the scene, for photos that
   differ in exposure and white balance.

   Scene and matrices are ambiguous: a darker scene with brighter matrices gives the same images. So the mean
   of the matrices over the photos is held at the identity, and the scene has the mean exposure of the
   photos. */
#ifndef GBT_TRAIN_EXPOSURE_H
#define GBT_TRAIN_EXPOSURE_H

#include <stdint.h>

#include "image/affine.h"

/** Start from {0}; free with exposures_free(). */
typedef struct exposures {
    size_t count;                      /* training photos; 0: exposure is not learned */
    float *matrix, *moment1, *moment2; /* [count][AFFINE_NUMBERS] */
    uint64_t *visits;                  /* [count] number of Adam steps of each photo */
} exposures;

/** Set `count` matrices to the identity. */
gbt_status exposures_make(exposures *e, size_t count, gbt_error *err);
void exposures_free(exposures *e);

/** One Adam step of photo `index`; then the mean of all matrices is set back to the identity. `gradient` must
    be finite. */
void exposures_step(exposures *e, size_t index, const double gradient[AFFINE_NUMBERS], double rate);

/**
 * The learning rate, such that in a run of any length a matrix can get from the identity to an exposure two
 * stops away. A photo is used 1 / (count * step) times in a run.
 *
 * @param progress [in] [0, 1]
 * @param step     [in] progress per step
 */
double exposures_rate(size_t count, double progress, double step);

/** RUN/exposure.json: the matrix of every photo, by name. */
gbt_status exposures_write(const exposures *e, const char *const *names, const char *path, gbt_error *err);

#endif
