/* SPDX-License-Identifier: Apache-2.0 */
/* base/background.h -- run one job, such as writing files, on a background thread while the caller continues.
   Computation uses base/parallel.h. */
#ifndef GBT_BASE_BACKGROUND_H
#define GBT_BASE_BACKGROUND_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

/** Start from {0}. */
typedef struct background_job {
    void (*run)(void *context);
    void *context;
    bool started;
    atomic_bool over;
    pthread_t thread;
} background_job;

/** Start `run(context)` in the background; the thread blocks all signals. If no thread can be created, the
    job runs before this returns. Call background_wait() before the next start. */
void background_start(background_job *b, void (*run)(void *context), void *context);

/** Whether a started job has finished. */
bool background_is_over(background_job *b);

/** Wait until the job has finished; returns at once when none was started. */
void background_wait(background_job *b);

#endif
