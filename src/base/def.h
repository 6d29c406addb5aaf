/* SPDX-License-Identifier: Apache-2.0 */
/* base/def.h -- the cookie that marks a definition struct made by its _default() function. */
#ifndef GBT_BASE_DEF_H
#define GBT_BASE_DEF_H

#include <stdint.h>

#include "base/fail.h"

/* It changes whenever a public definition struct changes, so that programs compiled with other headers are
   refused. */
enum { DEF_COOKIE = 0x67627433 };

/** GBT_OK, or GBT_ERR_ARGUMENT for a struct that did not come from its _default() function, such as a zeroed
    one. */
static inline gbt_status def_check(uint32_t cookie, const char *maker, gbt_error *err)
{
    return cookie == DEF_COOKIE
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT, "the def was not made by %s() of this version", maker);
}

#endif
