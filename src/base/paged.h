/* SPDX-License-Identifier: Apache-2.0 */
/* base/paged.h -- keep a process within a memory limit: large arrays are mapped from unnamed files, whose
   pages are dropped from memory when it exceeds the limit and read back on access. */
#ifndef GBT_BASE_PAGED_H
#define GBT_BASE_PAGED_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

/** Smallest size, in bytes, of arrays that are mapped from files. */
#define PAGED_LEAST_BYTES ((size_t)1 << 18)

/**
 * Let mem_alloc() map large arrays from files in `folder`, for the whole process, until paged_stop().
 *
 * @param limit [in] bytes of resident memory above which paged_check() drops pages
 * @return GBT_OK, or GBT_ERR_IO when no file can be created there
 */
gbt_status paged_start(const char *folder, size_t limit, gbt_error *err);

/** Use no more files; mapped arrays stay until they are freed. */
void paged_stop(void);

/**
 * Drop the pages of all large arrays from memory if the process is over the limit; their values are kept in
 * the files. Takes some microseconds; does nothing before paged_start().
 *
 * parallel_blocks() calls it before each block; code that touches many pages without blocks should call it
 * regularly.
 * Threads: any, also while others use the arrays.
 */
void paged_check(void);

/** For mem_alloc(): `bytes` of zeros, mapped from a file. `*out` stays NULL before paged_start(), and where
   there are fewer than PAGED_LEAST_BYTES, or more than 32,000 arrays. @return GBT_OK or
   GBT_ERR_NO_MEMORY (a full disk, too)
 */
gbt_status paged_map(size_t bytes, const char *what, void **out, gbt_error *err);

/** For mem_free(): unmap `pointer`; false when it was not mapped. */
bool paged_unmap(void *pointer);

/** Present resident memory of the process, bytes; 0 when the system does not report it. */
size_t mem_resident_bytes(void);

#endif
