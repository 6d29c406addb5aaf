/* SPDX-License-Identifier: Apache-2.0 */
/* base/library_end.h -- libraries that end the process themselves when memory runs out. */
#ifndef GBT_BASE_LIBRARY_END_H
#define GBT_BASE_LIBRARY_END_H

#include <stdbool.h>

/** While `on`, a call of exit() on this thread is taken to mean that memory ran out, and the handler of
    gbt_when_out_of_memory() is called. */
void library_exit_is_failure(bool on);

#endif
