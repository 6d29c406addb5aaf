/* SPDX-License-Identifier: Apache-2.0 */
/* base/beside.h -- one job on a thread of its own, beside what the caller goes on with: writing files. What
   is to be computed goes by base/parallel.h. */
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

/** Begin `run(context)`; signals go to other threads. Where there is no thread to have it is done at once.
   None may be started before beside_wait(). */
void beside_start(beside *b, void (*run)(void *context), void *context);

/** Has one been started and is it done? */
bool beside_is_over(beside *b);

/** Until it is done; nothing when none was started. */
void beside_wait(beside *b);

#endif
