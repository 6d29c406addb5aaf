/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/rows.h -- float arrays that have one row per anchor and grow together. */
#ifndef GBT_ANCHOR_ROWS_H
#define GBT_ANCHOR_ROWS_H

#include <stddef.h>

#include "gbtrace/status.h"

enum { ROWS_FIELDS = 4 };

/**
 * Make every field hold `count` rows: the first min(used, count) are kept, the others are zero.
 *
 * @param fields   [in,out] the arrays, owned by the caller, from base/memory.h; NULL at the start
 * @param widths   [in] floats per row of each field
 * @param capacity [in,out] rows allocated; grows by half at least
 * @return GBT_OK or GBT_ERR_NO_MEMORY: then nothing has changed
 */
gbt_status rows_resize(float **const fields[ROWS_FIELDS], const size_t widths[ROWS_FIELDS], size_t *capacity,
                       size_t used, size_t count, const char *what, gbt_error *err);

#endif
