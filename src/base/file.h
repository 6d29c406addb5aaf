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

/** The same, but all bytes must be read: otherwise GBT_ERR_IO, with `path`, the offset and the reason. */
gbt_status file_read_all_at(int fd, uint64_t at, void *out, size_t count, const char *path, gbt_error *err);

/**
 * A cheap fingerprint of a file: its size as 8 bytes, then its first and its last `count` bytes (the whole
 * file when it has fewer than 2 * count).
 *
 * @param out [out] 2 * count + 8 bytes
 * @param used [out] number of bytes used; 0 if it is not a regular file
 * @return GBT_OK; GBT_ERR_IO: it cannot be opened or read
 */
gbt_status file_read_ends(const char *path, size_t count, unsigned char *out, size_t *used, gbt_error *err);

/**
 * Replace a file atomically: temporary name in the same folder, write, fsync, rename, fsync of the folder.
 *
 * After any failure, kill or full disk the old file is intact; after a failure that the function sees, no
 * temporary file is left. A device, a pipe or /dev/stdout is written to directly. Permissions of the old file
 * are kept, with write permission for the owner added. A symbolic link is replaced; its target stays.
 */
gbt_status file_write_atomic(const char *path, const void *bytes, size_t byte_count, gbt_error *err);

/** Call before the process ends while other threads are working: waits, at most five seconds, for running
    file_write_atomic() calls to finish, and prevents new ones. */
void file_writes_end(void);

/** Check, before the work whose result it will hold, that a file can be created or replaced: GBT_ERR_IO when
    its folder is missing or not writable, or the path is a folder. Nothing is written. */
gbt_status file_check_creatable(const char *path, gbt_error *err);

/** The same for file_make_folder() and files in that folder. */
gbt_status file_check_folder_creatable(const char *path, gbt_error *err);

/** fsync the folder of `path`, if its file system supports that. */
void file_sync_folder_of(const char *path);

/** Create a folder and its parents; an existing folder is fine. */
gbt_status file_make_folder(const char *path, gbt_error *err);

/**
 * Lock a folder against other callers of this function, until file_unlock_folder() or the end of the process,
 * however it ends. Nothing is written. On file systems without locks this does nothing.
 *
 * @param lock [out] for file_unlock_folder(); unchanged after a failure
 * @return GBT_OK; GBT_ERR_IO when the folder is already locked or cannot be opened
 */
gbt_status file_lock_folder(const char *path, int *lock, gbt_error *err);

void file_unlock_folder(int lock);

struct stat;

/** stat() that distinguishes a missing file from a failed look-up: GBT_ERR_IO when existence cannot be
    determined. `out` is set if the path exists. */
gbt_status file_stat(const char *path, struct stat *out, bool *exists, gbt_error *err);

typedef enum file_kind { FILE_NONE, FILE_FOLDER, FILE_OTHER } file_kind;

/** Whether a path is a device, a pipe or an open file (/dev/stdout). These are written to directly; replacing
    /dev/null by renaming a file would destroy it. */
bool file_is_stream(const char *path);

/** The kind of entry at a path; errors as in file_stat(). */
gbt_status file_look(const char *path, file_kind *out, gbt_error *err);

/** Whether a path exists; also true when that cannot be determined, so that opening it reports the reason. */
bool file_exists(const char *path);
bool file_is_folder(const char *path);

/** Whether both paths exist and are the same file or folder, under whatever names. */
bool file_is_same(const char *a, const char *b);

/** Size of a UTF-8 byte order mark at the start of a text of `count` bytes: 3 or 0. */
size_t file_mark_bytes(const void *text, size_t count);

/** Whether `folder` exists, and is the folder in which a file of this path is or would be. */
bool file_is_in(const char *path, const char *folder);

/** Whether both name the same file: equal paths, the same existing file, or the same name in one folder. */
bool file_is_one(const char *a, const char *b);

/** The largest N of the entries PREFIX<N> in a folder, with N in decimal digits; false when there is none. */
bool file_largest_number(const char *folder, const char *prefix, unsigned long *out);

/** Whether a path ends with `ending` (".ply", ignoring case) and has more before it. */
bool file_ends_with(const char *path, const char *ending);

/** "folder/name" in a buffer of `size` bytes; GBT_ERR_ARGUMENT when it does not fit. */
gbt_status file_join(char *out, size_t size, const char *folder, const char *name, gbt_error *err);

#endif
