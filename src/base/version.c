/* SPDX-License-Identifier: Apache-2.0 */
/* base/version.c -- the version compiled into the library. */
#include "gbtrace/version.h"

const char *gbt_version(void) { return GBT_VERSION; }
