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
    LOG_PHOTO_MS, /* from here on: stages of a step, in the order in which they happen */
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
    double *column[LOG_COLUMNS]; /* [count]; NaN: absent. Owned as one block, column[0]. Steps and seconds
                                    never fall. */
} training_log;

/**
 * Columns are found by their names in the first line. A line without its end, with too few fields or without
 * a time is left out. Where a resumed run went back, what it repeated replaces the first try.
 *
 * @param out [out] free with training_log_free(); no rows when there is no such file
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status training_log_read(const char *path, training_log *out, gbt_error *err);
void training_log_free(training_log *log);

/** The mean of what is finite within `reach_seconds` on both sides; NaN where there is nothing. */
void training_log_smooth(const training_log *log, log_column column, double reach_seconds, double *out);

#endif
