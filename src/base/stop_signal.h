/* SPDX-License-Identifier: Apache-2.0 */
/* base/stop_signal.h -- SIGINT and SIGTERM while loops run: the first one asks all of them to stop, as do
   others within a second of it; a later one goes to who handled it before, which mostly ends the process. */
#ifndef GBT_BASE_STOP_SIGNAL_H
#define GBT_BASE_STOP_SIGNAL_H

#include <stdbool.h>

/** Catch both signals until as many stop_signal_release(). Threads: any, also at once. */
void stop_signal_catch(void);

/** The last one forgets the signal; who handled them before does again. */
void stop_signal_release(void);

/** Whether to stop; between stop_signal_catch() and stop_signal_release(). Threads: any. */
bool stop_signal_seen(void);

/**
 * What else the first signal does, for one loop of the process.
 *
 * @param wake [in] called with `context` in the handler, in any thread; async-signal-safe. NULL: nothing
 */
void stop_signal_wake(void (*wake)(void *context), void *context);

#endif
