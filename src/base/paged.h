/* SPDX-License-Identifier: Apache-2.0 */
/* base/paged.h -- a process below a limit: its large arrays are mapped from unnamed files, whose pages are
   let go of when it takes more than it may, and come back when they are touched. */
#ifndef GBT_BASE_PAGED_H
#define GBT_BASE_PAGED_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

/** Arrays of at least so many bytes. */
#define PAGED_LEAST_BYTES ((size_t)1 << 18)

/**
 * From now on mem_alloc() maps large arrays from files in `folder`; until paged_stop(). For the whole
 * process.
 *
 * @param limit [in] bytes of resident memory above which paged_check() lets go
 * @return GBT_OK, or GBT_ERR_IO when no file can be made there
 */
gbt_status paged_start(const char *folder, size_t limit, gbt_error *err);

/** No more files; those that are mapped stay until they are freed. */
void paged_stop(void);

/**
 * Let go of the pages of all large arrays when the process is over the limit. Their values stay. Some
 * microseconds; nothing before paged_start().
 *
 * parallel_blocks() does it before each block. What touches many pages without blocks does it now and then.
 * Threads: any, also while others use the arrays.
 */
void paged_check(void);

/** For mem_alloc(): `bytes` of zeros, mapped from a file. `*out` stays NULL before paged_start(), and where
   there are fewer than PAGED_LEAST_BYTES, or more than 32,000 arrays. @return GBT_OK or
   GBT_ERR_NO_MEMORY (a full disk, too)
 */
gbt_status paged_map(size_t bytes, const char *what, void **out, gbt_error *err);

/** For mem_free(): true when `pointer` was mapped; it is no more. */
bool paged_unmap(void *pointer);

/** Resident memory of the process now, bytes; 0 where nobody says. */
size_t mem_resident_bytes(void);

#endif
