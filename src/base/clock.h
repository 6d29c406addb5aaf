/* SPDX-License-Identifier: Apache-2.0 */
/* base/clock.h -- wall time and processor time in seconds. */
#ifndef GBT_BASE_CLOCK_H
#define GBT_BASE_CLOCK_H

#include <time.h>

static inline double clock_seconds_of(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/** Wall time since an arbitrary fixed moment; monotonic. */
static inline double clock_wall(void) { return clock_seconds_of(CLOCK_MONOTONIC); }

/** Processor time of all threads of this process. */
static inline double clock_process(void) { return clock_seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

#endif
