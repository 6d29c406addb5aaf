/* SPDX-License-Identifier: Apache-2.0 */
/* train/old_run.h -- what a new run does with the files that are in its folder already. */
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

/**
 * Refuse a folder without a checkpoint and a model that holds a regular file which a run would replace: it is
 * not gbtrace's. With RUN_DATA_NAME, which every run writes first, the files are those of a run that was
 * stopped before its first checkpoint.
 *
 * @return GBT_OK; GBT_ERR_ARGUMENT, naming the file; GBT_ERR_IO when a file cannot be looked up
 */
gbt_status old_run_check_foreign(const char *run, gbt_error *err);

#endif
