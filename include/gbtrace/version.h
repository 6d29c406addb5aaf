/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/version.h -- which gbtrace this is. The build reads its number here. */
#ifndef GBTRACE_VERSION_H
#define GBTRACE_VERSION_H

#include "gbtrace/api.h"

/**
 * The version of these headers. While the first number is 0, another second number means that programs must
 * be compiled again; after that, another first one. The name of the shared library (soname) says the same:
 * libgbtrace.so.0.2.
 */
#define GBT_VERSION "0.2.0"

GBT_API_BEGIN

/** The version of the library that runs, as GBT_VERSION. Static. */
const char *gbt_version(void);

GBT_API_END
#endif
