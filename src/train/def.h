/* SPDX-License-Identifier: Apache-2.0 */
/* train/def.h -- the def of training: checked, and what 0 stands for in it. */
#ifndef GBT_TRAIN_DEF_H
#define GBT_TRAIN_DEF_H

#include "gbtrace/train.h"

/** First scales of anchors, in units of their spacing. Smaller Gaussians leave holes that more anchors must
    fill; larger ones, where a few anchors stand far apart, cover what they cannot show, and stay large
    (docs/training.md). */
#define TRAIN_SPACING_SCALE 0.7

/** Of a run that is given neither a budget nor iterations. */
#define TRAIN_BUDGET_SECONDS 600.0

/** GBT_OK, or GBT_ERR_ARGUMENT and the field that is out of its range. */
gbt_status train_def_check(const gbt_train_def *d, gbt_error *err);

/** Values for what 0 leaves to us, and for what `compat` decides. A second call changes nothing. */
void train_def_settle(gbt_train_def *d);

/** A warning when something is given that compat does not use. */
void train_def_warn_unused(const gbt_train_def *d);

#endif
