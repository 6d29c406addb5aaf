/* SPDX-License-Identifier: Apache-2.0 */
/* base/beside.h -- run one job, such as writing files, on a background thread while the caller continues.
   Computation uses base/parallel.h. */
#ifndef GBT_BASE_BESIDE_H
#define GBT_BASE_BESIDE_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

/** Start from {0}. */
typedef struct beside {
    void (*run)(void *context);
    void *context;
    bool started;
    atomic_bool over;
    pthread_t thread;
} beside;

/** Start `run(context)` in the background; the thread blocks all signals. If no thread can be created, the
    job runs before this returns. Call beside_wait() before the next start. */
void beside_start(beside *b, void (*run)(void *context), void *context);

/** Whether a started job has finished. */
bool beside_is_over(beside *b);

/** Wait until the job has finished; returns at once when none was started. */
void beside_wait(beside *b);

#endif
