/* SPDX-License-Identifier: Apache-2.0 */
/* base/stage.h -- measure the time of a stage: wall time, work of all threads, and span. */
#ifndef GBT_BASE_STAGE_H
#define GBT_BASE_STAGE_H

#include "base/clock.h"
#include "base/parallel.h"

/** Seconds. On p otherwise idle threads a stage takes at least max(work / p, span) and at most (work - span)
    / p + span. */
typedef struct stage_time {
    double wall;
    double work; /* of all threads */
    double span; /* critical path: serial time of the calling thread plus the longest block of each parallel
                    call */
} stage_time;

/** Start of a stage. */
typedef struct stage_clock {
    double wall;
    parallel_account parallel;
} stage_clock;

static inline stage_clock stage_begin(void) { return (stage_clock){clock_wall(), parallel_account_now()}; }

/** Time since the start of the clock, which is restarted. Use a clock on one thread only. */
static inline stage_time stage_lap(stage_clock *since)
{
    const stage_clock now = stage_begin();
    const double wall = now.wall - since->wall, alone = wall - (now.parallel.wall - since->parallel.wall);
    const stage_time passed = {.wall = wall,
                               .work = alone + now.parallel.work - since->parallel.work,
                               .span = alone + now.parallel.span - since->parallel.span};
    *since = now;
    return passed;
}

static inline void stage_add(stage_time *sum, stage_time more)
{
    sum->wall += more.wall;
    sum->work += more.work;
    sum->span += more.span;
}

#endif
