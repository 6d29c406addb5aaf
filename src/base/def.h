/* SPDX-License-Identifier: Apache-2.0 */
/* base/def.h -- the mark of a def that its default function made. */
#ifndef GBT_BASE_DEF_H
#define GBT_BASE_DEF_H

#include <stdint.h>

#include "base/fail.h"

/* Another one whenever a public def changes: a program that was compiled with other headers is refused. */
enum { DEF_COOKIE = 0x67627433 };

/** GBT_OK, or GBT_ERR_ARGUMENT: a zeroed def has no defaults. */
static inline gbt_status def_check(uint32_t cookie, const char *maker, gbt_error *err)
{
    return cookie == DEF_COOKIE
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT, "the def was not made by %s() of this version", maker);
}

#endif
