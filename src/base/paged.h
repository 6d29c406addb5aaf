/* SPDX-License-Identifier: Apache-2.0 */
/* base/paged.h -- large arrays that need not be in memory all the time: mapped from an unnamed file, whose
   pages are let go of when the process takes more than it may, and come back when they are touched. */
#ifndef GBT_BASE_PAGED_H
#define GBT_BASE_PAGED_H

#include <stddef.h>

#include "gbtrace/status.h"

/**
 * From now on paged_alloc() maps files in `folder`; until paged_stop(). For the whole process.
 *
 * @param limit [in] bytes of resident memory above which paged_check() lets go
 * @return GBT_OK, or GBT_ERR_IO when no file can be made there
 */
gbt_status paged_start(const char *folder, size_t limit, gbt_error *err);

/** No more files; those that are mapped stay until they are freed. */
void paged_stop(void);

/** As mem_alloc(); the bytes are zero when they are mapped. */
void *paged_alloc(size_t count, size_t size, const char *what, gbt_error *err);

void paged_free(void *pointer); /* NULL is fine */

/** Let go of all pages of the arrays when the process is over the limit. Their values stay. Some
   microseconds. Threads: any, also while others use the arrays. */
void paged_check(void);

/** Resident memory of the process now, bytes; 0 where nobody says. */
size_t mem_resident_bytes(void);

#endif
