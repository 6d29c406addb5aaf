/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/version.h -- the version of gbtrace. The build reads the number from this file. */
#ifndef GBTRACE_VERSION_H
#define GBTRACE_VERSION_H

#include "gbtrace/api.h"

/**
 * The version of these headers. When the first number changes, programs must be compiled again; it is also
 * the number in the name of the shared library (soname), libgbtrace.so.1.
 */
#define GBT_VERSION "1.0.0"

GBT_API_BEGIN

/** The version of the loaded library, in the form of GBT_VERSION. Static string. */
const char *gbt_version(void);

GBT_API_END
#endif
