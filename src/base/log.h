/* SPDX-License-Identifier: Apache-2.0 */
/* base/log.h -- messages, warnings and progress: to whoever gbt_listen() names, else one line to stderr.
   Results never go through here. */
#ifndef GBT_BASE_LOG_H
#define GBT_BASE_LOG_H

#include <stdbool.h>

#include "gbtrace/progress.h"

/** A warning; "warning: ..." on stderr. Threads: any. */
void log_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** A message. Threads: any. */
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Whether so much time has passed since the last progress that more is wanted. The first call starts the
    time. Threads: any. */
bool log_progress_due(void);

/** Progress, as the caller fills it in; `kind` is set here. Ask log_progress_due() before, but for the end of
    a stage. Threads: any. */
void log_progress(const gbt_event *event);

/**
 * The same for stages that count: "STAGE: DONE of TOTAL", when due and at the end. `done` from 0 or 1 on: a
 * stage starts when its name is new, or when `done` is not larger than before.
 *
 * @param total [in] at least `done`; 0: not known, "STAGE: DONE"
 * @param psnr  [in] of what was just done; NaN: none
 * Threads: any; what two of them count at once has no time left that is right.
 */
void log_count(const char *stage, uint64_t done, uint64_t total, double psnr);

#endif
