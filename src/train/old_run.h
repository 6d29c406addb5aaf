/* SPDX-License-Identifier: Apache-2.0 */
/* train/old_run.h -- what an older run left in the folder of one that starts anew. */
#ifndef GBT_TRAIN_OLD_RUN_H
#define GBT_TRAIN_OLD_RUN_H

#include "gbtrace/status.h"

/**
 * Remove the files of the run in a folder, but those that a new one replaces when it starts (config,
 * data_places, log.csv). Whoever resumes would find the old checkpoint, the new run may have no poses to
 * write over the old ones. The last checkpoint goes last: after a kill meanwhile the old run can still be
 * resumed, which makes the other files again.
 *
 * @return GBT_OK, also where there are none; GBT_ERR_IO: one cannot be removed
 */
gbt_status old_run_remove(const char *run, gbt_error *err);

#endif
