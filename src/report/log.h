/* SPDX-License-Identifier: Apache-2.0 */
/* report/log.h -- log.csv of a run as arrays. */
#ifndef GBT_REPORT_LOG_H
#define GBT_REPORT_LOG_H

#include <stddef.h>

#include "gbtrace/status.h"

typedef enum log_column {
    LOG_STEP,
    LOG_SECONDS,
    LOG_LOSS,
    LOG_TRAIN_PSNR,
    LOG_ANCHORS,
    LOG_GAUSSIANS,
    LOG_RAYS_PER_SECOND,
    LOG_BLENDED,
    LOG_MEMORY,
    LOG_PHOTO_MS, /* from here on: stages of a step, in order of execution */
    LOG_RAYS_MS,
    LOG_VISIBLE_MS,
    LOG_DECODE_MS,
    LOG_BUILD_MS,
    LOG_TRACE_MS,
    LOG_LOSS_MS,
    LOG_ADJOINT_MS,
    LOG_DECODE_ADJOINT_MS,
    LOG_OPTIMIZER_MS,
    LOG_ADJUST_MS,
    LOG_COLUMNS
} log_column;

typedef struct training_log {
    size_t count;
    double *column[LOG_COLUMNS]; /* [count]; NaN: missing. One block, owned by column[0]. Steps and seconds
                                    never decrease. */
} training_log;

/**
 * Read log.csv. Columns are found by their names in the first line. Lines that are torn, have too few fields
 * or have no time are skipped. If the run was resumed from an earlier step, rows of the repeated steps
 * replace the first ones.
 *
 * @param out [out] free with training_log_free(); no rows if the file does not exist
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status training_log_read(const char *path, training_log *out, gbt_error *err);
void training_log_free(training_log *log);

/** Moving average: the mean of the finite values within `reach_seconds` on both sides; NaN if there are none.
 */
void training_log_smooth(const training_log *log, log_column column, double reach_seconds, double *out);

#endif
