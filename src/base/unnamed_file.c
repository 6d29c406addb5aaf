/* SPDX-License-Identifier: Apache-2.0 */
/* base/unnamed_file.c -- unnamed temporary files. */
#include "base/unnamed_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"

gbt_status unnamed_file_open(const char *folder, int *descriptor, gbt_error *err)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/.gbtrace-XXXXXX", folder) >= (int)sizeof path)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", folder);
    *descriptor = mkstemp(path);
    if (*descriptor < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create a temporary file: %s", folder, strerror(errno));
    unlink(path);
    return GBT_OK;
}
