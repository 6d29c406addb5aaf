/* SPDX-License-Identifier: Apache-2.0 */
/* base/library_end.h -- the end of the process when a library runs out of memory, or of threads. */
#ifndef GBT_BASE_LIBRARY_END_H
#define GBT_BASE_LIBRARY_END_H

#include <stdbool.h>

/** While `on`, a call of exit() on this thread is taken to mean that memory ran out, and the handler of
    gbt_when_out_of_memory() is called. */
void library_exit_is_failure(bool on);

/** Ends the process by the handler of gbt_when_out_of_memory(), or by SIGABRT if there is none. */
void library_out_of_memory(void);

#endif
