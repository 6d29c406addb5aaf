/* SPDX-License-Identifier: Apache-2.0 */
/* base/memory.h -- the only allocator: checked sizes, 64-byte alignment, injected failures for tests, peak
   memory.

   Every array of the library is owned by the object that allocated it here and is freed with mem_free(). With
   a memory limit large arrays are mapped from files (base/paged.h). */
#ifndef GBT_BASE_MEMORY_H
#define GBT_BASE_MEMORY_H

#include <stddef.h>

#include "gbtrace/status.h"

enum { MEM_ALIGN = 64 };

/**
 * `count * size` bytes, uninitialised, 64-byte aligned; NULL with a message naming `what` on overflow or
 * exhaustion. count 0 gives a valid pointer.
 */
void *mem_alloc(size_t count, size_t size, const char *what, gbt_error *err);

/** The same, filled with zeros. */
void *mem_calloc(size_t count, size_t size, const char *what, gbt_error *err);

/** Check whether another library could allocate `count * size` bytes now; never uses a file. @return GBT_OK
    or GBT_ERR_NO_MEMORY, with the message of mem_alloc() */
gbt_status mem_check(size_t count, size_t size, const char *what, gbt_error *err);

/**
 * Make `*array` hold at least `count` elements, keeping the first `used`.
 *
 * `*capacity` grows by half at least, so that repeated calls cost O(1) per element. On failure nothing
 * changes.
 */
gbt_status mem_reserve(void **array, size_t *capacity, size_t used, size_t count, size_t size,
                       const char *what, gbt_error *err);

/** Shrink `*array` to its `used` elements: for code that keeps hundreds of arrays, whose spare room would add
    up. On failure nothing changes. */
gbt_status mem_trim(void **array, size_t *capacity, size_t used, size_t size, const char *what,
                    gbt_error *err);

/** memcpy() for arrays that may be as large as the memory limit: calls paged_check() in between. */
void mem_copy(void *to, const void *from, size_t bytes);

void mem_free(void *pointer); /* NULL is fine */

/** Test only: the n-th allocation from now fails (0 = the next one); a negative n switches this off. */
void mem_fail_after(long n);

/** Peak resident memory of the process since its program started, bytes. Takes some 20 microseconds. Threads:
    any. */
size_t mem_peak_bytes(void);

#endif
