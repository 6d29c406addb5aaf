/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/rows.c -- memory of the arrays that have one row per anchor. */
#include "anchor/rows.h"

#include <string.h>

#include "base/memory.h"

gbt_status rows_resize(float **const fields[ROWS_FIELDS], const size_t widths[ROWS_FIELDS], size_t *capacity,
                       size_t used, size_t count, const char *what, gbt_error *err)
{
    const size_t kept = count < used ? count : used;
    if (count > *capacity || *fields[0] == NULL) {
        size_t wanted = *capacity + *capacity / 2;
        if (wanted < count)
            wanted = count;
        float *bigger[ROWS_FIELDS] = {NULL};
        for (int f = 0; f < ROWS_FIELDS; f++) {
            bigger[f] = mem_alloc(wanted, widths[f] * sizeof(float), what, err);
            if (bigger[f] == NULL) {
                while (f-- > 0)
                    mem_free(bigger[f]);
                return GBT_ERR_NO_MEMORY;
            }
        }
        for (int f = 0; f < ROWS_FIELDS; f++) {
            if (kept > 0)
                memcpy(bigger[f], *fields[f], kept * widths[f] * sizeof(float));
            mem_free(*fields[f]);
            *fields[f] = bigger[f];
        }
        *capacity = wanted;
    }
    for (int f = 0; f < ROWS_FIELDS; f++)
        memset(*fields[f] + kept * widths[f], 0, (count - kept) * widths[f] * sizeof(float));
    return GBT_OK;
}
