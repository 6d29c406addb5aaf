/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/version.h -- which gbtrace this is. The build reads its number here. */
#ifndef GBTRACE_VERSION_H
#define GBTRACE_VERSION_H

#include "gbtrace/api.h"

/**
 * The version of these headers. Another first number means that programs must be compiled again. The name of
 * the shared library (soname) says the same: libgbtrace.so.1.
 */
#define GBT_VERSION "1.0.0"

GBT_API_BEGIN

/** The version of the library that runs, as GBT_VERSION. Static. */
const char *gbt_version(void);

GBT_API_END
#endif
