/* SPDX-License-Identifier: Apache-2.0 */
/* base/unnamed_file.h -- files that are gone when they are closed, however the process ends. */
#ifndef GBT_BASE_UNNAMED_FILE_H
#define GBT_BASE_UNNAMED_FILE_H

#include "gbtrace/status.h"

/** A new one in `folder`, for reading and writing; close() it. @return GBT_OK, or GBT_ERR_IO */
gbt_status unnamed_file_open(const char *folder, int *descriptor, gbt_error *err);

#endif
