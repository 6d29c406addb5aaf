/* SPDX-License-Identifier: Apache-2.0 */
/* base/file_write.c -- a whole file at once, in the way of large ones. */
#include "base/fail.h"
#include "base/file.h"
#include "base/large_file.h"

gbt_status file_write_atomic(const char *path, const void *bytes, size_t byte_count, gbt_error *err)
{
    large_file file;
    GBT_TRY(large_file_create(path, &file, err));
    const gbt_status status = large_file_put(&file, bytes, byte_count, err),
                     closed = large_file_close(&file, status == GBT_OK, err);
    return status == GBT_OK ? closed : status;
}
