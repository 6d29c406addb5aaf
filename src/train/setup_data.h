/* SPDX-License-Identifier: Apache-2.0 */
/* train/setup_data.h -- the data of a run: photos to train on and held out, their size, exposure and memory,
   and the points that anchors start from. */
#ifndef GBT_TRAIN_SETUP_DATA_H
#define GBT_TRAIN_SETUP_DATA_H

#include "train/trainer.h"

/**
 * Open a data set for a run, by t->def and t->rules, which are set.
 *
 * Sets the scene, its views, the photos (in memory as far as they may be), points by photo consistency if the
 * data set has none or few, the extent of the cameras, and v; in t->def the downscale and the exposure, if
 * they were left open. Each decision is logged in one line.
 *
 * @param t [in,out] free with trainer_free(), also on failure
 * @return GBT_OK, GBT_ERR_FORMAT (nothing to train on), GBT_ERR_NO_MEMORY (also for a memory limit that
 * cannot be kept), or what reading the data set returns
 */
gbt_status setup_data(trainer *t, const char *data, gbt_error *err);

#endif
