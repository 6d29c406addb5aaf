/* SPDX-License-Identifier: Apache-2.0 */
/* base/stop_signal.h -- SIGINT and SIGTERM while loops run. The first signal asks all loops to stop; others
   within a second are ignored; a later one goes to the previous handler, which usually ends the process. */
#ifndef GBT_BASE_STOP_SIGNAL_H
#define GBT_BASE_STOP_SIGNAL_H

#include <stdbool.h>

/** Catch both signals until stop_signal_release() has been called as often as this. Threads: any, also
    concurrently. */
void stop_signal_catch(void);

/** The last release clears the signal and restores the previous handlers. */
void stop_signal_release(void);

/** Whether a signal has asked to stop; call between stop_signal_catch() and stop_signal_release(). Threads:
    any. */
bool stop_signal_seen(void);

/**
 * Set what the first signal does in addition, for one loop of the process.
 *
 * @param wake [in] called with `context` in the handler, in any thread; async-signal-safe. NULL: nothing
 */
void stop_signal_wake(void (*wake)(void *context), void *context);

#endif
