/* SPDX-License-Identifier: Apache-2.0 */
/* base/library_end.h -- libraries that end the process themselves when they have no memory. */
#ifndef GBT_BASE_LIBRARY_END_H
#define GBT_BASE_LIBRARY_END_H

#include <stdbool.h>

/** While `on`, exit() on this thread means that memory ran out: gbt_when_out_of_memory() answers. */
void library_exit_is_failure(bool on);

#endif
