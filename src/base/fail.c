/* SPDX-License-Identifier: Apache-2.0 */
/* base/fail.c -- write errors. */
#include "base/fail.h"

#include <stdarg.h>
#include <stdio.h>

gbt_status base_fail(gbt_error *err, gbt_status status, const char *format, ...)
{
    if (err != NULL && err->status == GBT_OK) {
        va_list args;
        va_start(args, format);
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        /* A newline in a user's file name must not break the guarantee of one line. */
        for (char *c = err->text; *c != '\0'; c++)
            if ((unsigned char)*c < 0x20)
                *c = '?';
        err->status = status;
    }
    return status;
}

int gbt_status_exit_code(gbt_status status)
{
    switch (status) {
    case GBT_OK:
        return 0;
    case GBT_ERR_ARGUMENT:
        return 2;
    case GBT_ERR_FORMAT:
        return 3;
    case GBT_ERR_IO:
        return 4;
    case GBT_ERR_NO_MEMORY:
        return 5;
    case GBT_ERR_INTERRUPTED:
        return 130;
    case GBT_ERR_INTERNAL:
        return 1;
    }
    return 1;
}
