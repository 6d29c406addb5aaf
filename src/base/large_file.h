/* SPDX-License-Identifier: Apache-2.0 */
/* base/large_file.h -- files written and read in pieces, which may be larger than memory. */
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
    uint64_t size;                   /* size when it was opened, plus the bytes put */
    char name[LARGE_FILE_NAME];      /* name in messages */
    char temporary[LARGE_FILE_NAME]; /* temporary name of a file being created; empty: none */
} large_file;

/** Open a regular file for large_file_read(). */
gbt_status large_file_open(const char *path, large_file *out, gbt_error *err);

/** Create a file for large_file_put(), under a temporary name beside `path` until it is closed. */
gbt_status large_file_create(const char *path, large_file *out, gbt_error *err);

/** An unnamed temporary file in `folder`, for reading and writing; it disappears when it is closed, or when
    the process ends. */
gbt_status large_file_scratch(const char *folder, large_file *out, gbt_error *err);

/** Append. */
gbt_status large_file_put(large_file *file, const void *bytes, size_t count, gbt_error *err);

/** All of [at, at + count), or GBT_ERR_IO. Threads: any. */
gbt_status large_file_read(const large_file *file, uint64_t at, void *bytes, size_t count, gbt_error *err);

/** Close it, if it is open. A file from large_file_create() is renamed to `path` if `keep` is set and nothing
    failed, as in file_write_atomic(); otherwise it is removed. */
gbt_status large_file_close(large_file *file, bool keep, gbt_error *err);

#endif
