/* SPDX-License-Identifier: Apache-2.0 */
/* base/file.h -- whole files to bytes and back; folders, locks and paths. Images: base/image.h. */
#ifndef GBT_BASE_FILE_H
#define GBT_BASE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

/** Read a regular file whole. `*bytes` has one extra zero byte at the end (not counted). Free with
    mem_free(). */
gbt_status file_read(const char *path, unsigned char **bytes, size_t *byte_count, gbt_error *err);

/**
 * Bytes [at, at + count) of an open file, fewer where it ends.
 *
 * @param failure [out] errno of a read that failed, else 0
 * @return how many were read
 */
size_t file_read_at(int fd, uint64_t at, void *out, size_t count, int *failure);

/** The same where all of them must be there: GBT_ERR_IO, with `path`, the place and the reason, if not. */
gbt_status file_read_all_at(int fd, uint64_t at, void *out, size_t count, const char *path, gbt_error *err);

/**
 * What tells one file from another at little cost: its size as 8 bytes, then its first and its last `count`
 * bytes (all of it when it has fewer than 2 * count).
 *
 * @param out [out] 2 * count + 8 bytes
 * @param used [out] how many are used; 0 for what is no regular file
 * @return GBT_OK; GBT_ERR_IO: it cannot be opened or read
 */
gbt_status file_read_ends(const char *path, size_t count, unsigned char *out, size_t *used, gbt_error *err);

/**
 * Replace a file atomically: temporary name in the same folder, write, fsync, rename, fsync of the folder.
 *
 * After any failure, kill or full disk the old file is whole and no temporary file is left by a failure that
 * we see. A device, a pipe or /dev/stdout is written to as it is. Who may read and write the file stays as it
 * was, but that its owner may write it; a link is replaced, and what it leads to stays.
 */
gbt_status file_write_atomic(const char *path, const void *bytes, size_t byte_count, gbt_error *err);

/** Before the process ends while other threads are at work: files that file_write_atomic() writes are brought
   to their end, for at most five seconds, and it begins no other. */
void file_writes_end(void);

/** Before work whose result goes there: GBT_ERR_IO when a file cannot be created or replaced, because its
    folder is not there or cannot be written, or it is a folder itself. Nothing is written. */
gbt_status file_check_creatable(const char *path, gbt_error *err);

/** The same for file_make_folder() and what goes into the folder. */
gbt_status file_check_folder_creatable(const char *path, gbt_error *err);

/** fsync of the folder that `path` is in, as far as its file system knows that. */
void file_sync_folder_of(const char *path);

/** Create a folder and its parents; an existing folder is fine. */
gbt_status file_make_folder(const char *path, gbt_error *err);

/**
 * Hold a folder against other processes that hold it by this function, until file_unlock_folder() or the end
 * of the process, however it ends. Nothing is written. Where a file system knows no locks this does nothing.
 *
 * @param lock [out] for file_unlock_folder(); unchanged after a failure
 * @return GBT_OK; GBT_ERR_IO: somebody else holds it, or it cannot be opened
 */
gbt_status file_lock_folder(const char *path, int *lock, gbt_error *err);

void file_unlock_folder(int lock);

struct stat;

/** stat(), where a failed look-up is no absence: GBT_ERR_IO when it cannot be told whether the path exists.
    `out` is set when it does. */
gbt_status file_stat(const char *path, struct stat *out, bool *exists, gbt_error *err);

typedef enum file_kind { FILE_NONE, FILE_FOLDER, FILE_OTHER } file_kind;

/** Devices, pipes and names of open files (/dev/stdout): they are written to as they are, for a file renamed
   to /dev/null would take its place. */
bool file_is_stream(const char *path);

/** What is at a path; errors as of file_stat(). */
gbt_status file_look(const char *path, file_kind *out, gbt_error *err);

/** Also what cannot be told: who opens it then says why. */
bool file_exists(const char *path);
bool file_is_folder(const char *path);

/** Whether both are there, and are one file or folder, whatever they are called. */
bool file_is_same(const char *a, const char *b);

/** Bytes of the UTF-8 byte order mark that a text of `count` bytes begins with: 3 or 0. */
size_t file_mark_bytes(const void *text, size_t count);

/** Whether both name one file: the same path, or one file that is there. */
bool file_is_one(const char *a, const char *b);

/** The largest N of the entries PREFIXN of a folder, N in decimal digits: false when there is none. */
bool file_largest_number(const char *folder, const char *prefix, unsigned long *out);

/** Whether more stands before `ending` (".ply", in either case) at the end of a path. */
bool file_ends_with(const char *path, const char *ending);

/** "folder/name" in a buffer of `size` bytes; GBT_ERR_ARGUMENT when it does not fit. */
gbt_status file_join(char *out, size_t size, const char *folder, const char *name, gbt_error *err);

#endif
