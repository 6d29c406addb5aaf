/* SPDX-License-Identifier: Apache-2.0 */
/* train/old_run.h -- remove the files of an older run from the folder of a new one. */
#ifndef GBT_TRAIN_OLD_RUN_H
#define GBT_TRAIN_OLD_RUN_H

#include "gbtrace/status.h"

/**
 * Remove the files of the run in a folder, except those that a new run replaces when it starts (config,
 * data_places, log.csv). Left in place, the old checkpoint would be found by --resume, and old poses would
 * stay when the new run has none. The last checkpoint is removed last: if the process is killed in between,
 * the old run can still be resumed, which writes the other files again.
 *
 * @return GBT_OK, also when there are none; GBT_ERR_IO when a file cannot be removed
 */
gbt_status old_run_remove(const char *run, gbt_error *err);

#endif
