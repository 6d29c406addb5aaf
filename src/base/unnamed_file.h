/* SPDX-License-Identifier: Apache-2.0 */
/* base/unnamed_file.h -- unnamed temporary files, which disappear when they are closed or the process
   ends. */
#ifndef GBT_BASE_UNNAMED_FILE_H
#define GBT_BASE_UNNAMED_FILE_H

#include "gbtrace/status.h"

/** Open a new one in `folder`, for reading and writing; end with close(). @return GBT_OK, or GBT_ERR_IO */
gbt_status unnamed_file_open(const char *folder, int *descriptor, gbt_error *err);

#endif
