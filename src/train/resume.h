/* SPDX-License-Identifier: Apache-2.0 */
/* train/resume.h -- continue a run: load its settings, data and state, and optionally change its length. */
#ifndef GBT_TRAIN_RESUME_H
#define GBT_TRAIN_RESUME_H

#include "train/config.h"
#include "train/trainer.h"

/** Replace a damaged checkpoint by the intact previous one; otherwise the next save would keep the damaged
    one as the previous one. Called by the first process before any process opens the run. GBT_OK or
    GBT_ERR_IO. */
gbt_status resume_mend(const char *latest, const char *previous, gbt_error *err);

/**
 * Restore `t` to the state of the run's last checkpoint.
 *
 * Settings come from the checkpoint; other settings in `def` cause a warning. Only the length may change: to
 * `def->iterations`, or else to `def->budget_seconds`, if it is neither 0 nor the run's own; a run with a
 * pace keeps it when `def` has a pace, too. The schedule then continues where a run of that length would be
 * after the same number of steps, or after the same time.
 *
 * @param data     [in] the data set; NULL: where the run's files say it is
 * @param latest   [in] the checkpoint; if it is missing, `previous` is used
 * @param def      [in] argument of gbt_train(); its memory limit and checkpoint interval apply
 * @param strings  [out] storage for strings of t->def; must live as long as `t`
 * @return GBT_OK; GBT_ERR_ARGUMENT: a length that the run has passed already; GBT_ERR_IO: no data, no
 *         checkpoint; GBT_ERR_FORMAT: a damaged checkpoint, other data
 */
gbt_status resume_open(trainer *t, const char *data, const char *run, const char *latest,
                       const char *previous, const gbt_train_def *def, config_strings *strings,
                       gbt_error *err);

#endif
