/* SPDX-License-Identifier: Apache-2.0 */
/* train/resume.h -- go on with a run: its settings and data, its state, another length. */
#ifndef GBT_TRAIN_RESUME_H
#define GBT_TRAIN_RESUME_H

#include "train/config.h"
#include "train/trainer.h"

/** A damaged checkpoint makes room for the whole one before it: the next save would put it in the place of
    that. Of the first process, before any opens the run. GBT_OK or GBT_ERR_IO. */
gbt_status resume_mend(const char *latest, const char *previous, gbt_error *err);

/**
 * Make of `t` what it was when the run's last checkpoint was made.
 *
 * Settings come from the checkpoint; what `def` asks for beside is warned of. Only the length may change:
 * `def->iterations`, else `def->budget_seconds`, where it is neither 0 nor the run's own; a run by a pace
 * keeps that when `def` has a pace, too. The schedule then goes on where a run of that length would be after
 * as many steps, or after as much time.
 *
 * @param data     [in] the data set; NULL: where the run has it
 * @param latest   [in] the checkpoint; where it is missing, `previous`
 * @param def      [in] as gbt_train() was given it; says how much memory may be used, and when
 *                      checkpoints are made
 * @param strings  [out] keeps strings of t->def, for as long as `t` lives
 * @return GBT_OK; GBT_ERR_ARGUMENT: a length that the run has passed already; GBT_ERR_IO: no data, no
 *         checkpoint; GBT_ERR_FORMAT: a damaged checkpoint, other data
 */
gbt_status resume_open(trainer *t, const char *data, const char *run, const char *latest,
                       const char *previous, const gbt_train_def *def, config_strings *strings,
                       gbt_error *err);

#endif
