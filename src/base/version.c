/* SPDX-License-Identifier: Apache-2.0 */
/* base/version.c -- the version that was compiled in. */
#include "gbtrace/version.h"

const char *gbt_version(void) { return GBT_VERSION; }
