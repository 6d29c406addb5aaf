/* SPDX-License-Identifier: Apache-2.0 */
/* base/file_write.c -- write a whole file atomically. */
#include "base/file.h"

#include <poll.h>
#include <stdatomic.h>

#include "base/fail.h"
#include "base/large_file.h"

static atomic_int files_at_work;
static atomic_bool ends;

static gbt_status write_whole(const char *path, const void *bytes, size_t byte_count, gbt_error *err)
{
    large_file file;
    GBT_TRY(large_file_create(path, &file, err));
    const gbt_status status = large_file_put(&file, bytes, byte_count, err),
                     closed = large_file_close(&file, status == GBT_OK, err);
    return status == GBT_OK ? closed : status;
}

gbt_status file_write_atomic(const char *path, const void *bytes, size_t byte_count, gbt_error *err)
{
    atomic_fetch_add(&files_at_work, 1);
    const gbt_status status =
        atomic_load(&ends) ? base_fail(err, GBT_ERR_NO_MEMORY, "%s: not written: the program ends", path)
                           : write_whole(path, bytes, byte_count, err);
    atomic_fetch_sub(&files_at_work, 1);
    return status;
}

void file_writes_end(void)
{
    atomic_store(&ends, true);
    for (int i = 0; i < 500 && atomic_load(&files_at_work) > 0; i++)
        poll(NULL, 0, 10);
}
