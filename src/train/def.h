/* SPDX-License-Identifier: Apache-2.0 */
/* train/def.h -- the definition struct of training: checks, and the values that 0 stands for. */
#ifndef GBT_TRAIN_DEF_H
#define GBT_TRAIN_DEF_H

#include "gbtrace/train.h"

/** Initial scales of anchors, in units of their spacing. Smaller Gaussians leave holes that more anchors must
    fill. Larger ones cover detail that they cannot represent where anchors are sparse, and they stay large
    (docs/training.md). */
#define TRAIN_SPACING_SCALE 0.7

/** Budget of a run that is given neither a budget nor iterations. */
#define TRAIN_BUDGET_SECONDS 600.0

/** GBT_OK, or GBT_ERR_ARGUMENT with the name of the field that is out of range. */
gbt_status train_def_check(const gbt_train_def *d, gbt_error *err);

/** Replace each 0 that stands for a choice of the program, and each field that `compat` fixes, by its value.
    A second call changes nothing. */
void train_def_settle(gbt_train_def *d);

/** Warn about settings that were given but that compat, the initial anchors or the renderer do not use. */
void train_def_warn_unused(const gbt_train_def *d);

#endif
