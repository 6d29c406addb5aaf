/* SPDX-License-Identifier: Apache-2.0 */
/* base/log.h -- messages, warnings and progress, sent to the listener of gbt_listen(), or else as lines to
   stderr. Results never go through here. */
#ifndef GBT_BASE_LOG_H
#define GBT_BASE_LOG_H

#include <stdbool.h>

#include "gbtrace/progress.h"

/** A warning; "warning: ..." on stderr. Threads: any. */
void log_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** A message. Threads: any. */
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Whether enough time has passed since the last progress event for another. The first call starts the clock.
    Threads: any. */
bool log_progress_due(void);

/** Send a progress event filled in by the caller; `kind` is set here. Except at the end of a stage, call it
    only when log_progress_due(). Threads: any. */
void log_progress(const gbt_event *event);

/**
 * Progress of stages that count: "STAGE: DONE of TOTAL", sent when due and at the end. `done` starts at 0 or
 * 1; a new stage starts when the name changes, or when `done` is not larger than before.
 *
 * @param total [in] at least `done`; 0: unknown, "STAGE: DONE"
 * @param psnr  [in] PSNR of the item just done; NaN: none
 * Threads: any; when two of them count at the same time, the estimated time left is wrong.
 */
void log_count(const char *stage, uint64_t done, uint64_t total, double psnr);

#endif
