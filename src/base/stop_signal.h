/* SPDX-License-Identifier: Apache-2.0 */
/* base/stop_signal.h -- SIGINT and SIGTERM while a loop runs: the first one asks it to stop, a second one
   ends the process. */
#ifndef GBT_BASE_STOP_SIGNAL_H
#define GBT_BASE_STOP_SIGNAL_H

#include <signal.h>
#include <stdbool.h>

typedef struct stop_signal_guard {
    struct sigaction old_int, old_term;
} stop_signal_guard;

/**
 * Catch both signals until stop_signal_release(), one loop of the process at a time.
 *
 * @param wake [in] optional (NULL): called with `context` in the handler at the first signal, in any thread;
 *                  async-signal-safe
 */
void stop_signal_catch(stop_signal_guard *guard, void (*wake)(void *context), void *context);
void stop_signal_release(const stop_signal_guard *guard); /* who handled them before does again */

bool stop_signal_seen(void); /* between stop_signal_catch() and stop_signal_release(); any thread */

#endif
