/* SPDX-License-Identifier: Apache-2.0 */
/* base/fail.h -- write errors and forward gbt_status. */
#ifndef GBT_BASE_FAIL_H
#define GBT_BASE_FAIL_H

#include "gbtrace/status.h"

/** Write `text` into a clean `err` (the first cause wins; NULL is fine) and return `status`. */
gbt_status base_fail(gbt_error *err, gbt_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** Only where the function owns nothing yet; otherwise `goto done` with `status` preset to the failure. */
#define GBT_TRY(expr)                                                                                        \
    do {                                                                                                     \
        const gbt_status try_status_ = (expr);                                                               \
        if (try_status_ != GBT_OK)                                                                           \
            return try_status_;                                                                              \
    } while (0)

#endif
