/* SPDX-License-Identifier: Apache-2.0 */
/* base/large_file.h -- files written and read piece by piece, so that they may be larger than memory. */
#ifndef GBT_BASE_LARGE_FILE_H
#define GBT_BASE_LARGE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum { LARGE_FILE_NAME = 4096 };

/** An open file. Start from {0}; end with large_file_close(). */
typedef struct large_file {
    bool open;
    int descriptor;
    uint64_t size;                   /* when it was opened, and of what has been put */
    char name[LARGE_FILE_NAME];      /* what messages call it */
    char temporary[LARGE_FILE_NAME]; /* of one that is being made; empty: none */
} large_file;

/** Open a regular file for large_file_read(). */
gbt_status large_file_open(const char *path, large_file *out, gbt_error *err);

/** Start a file for large_file_put(): under a temporary name beside `path`, until it is closed. */
gbt_status large_file_create(const char *path, large_file *out, gbt_error *err);

/** A file without a name in `folder`, for both; it is gone when it is closed, however the process ends. */
gbt_status large_file_scratch(const char *folder, large_file *out, gbt_error *err);

/** Append. */
gbt_status large_file_put(large_file *file, const void *bytes, size_t count, gbt_error *err);

/** All of [at, at + count), or GBT_ERR_IO. Threads: any. */
gbt_status large_file_read(const large_file *file, uint64_t at, void *bytes, size_t count, gbt_error *err);

/** Close it, if it is open. One from large_file_create() becomes `path` when `keep` is set and all is well,
    as file_write_atomic() does it; else it is removed. */
gbt_status large_file_close(large_file *file, bool keep, gbt_error *err);

#endif
