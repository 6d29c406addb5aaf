/* SPDX-License-Identifier: Apache-2.0 */
/* base/file.c -- read files, whole or in part; folders, locks and paths. */
#include "base/file.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/paged.h"

enum { PATH_LIMIT = 4096, READ_BYTES = 1 << 22 };

gbt_status file_read(const char *path, unsigned char **bytes, size_t *byte_count, gbt_error *err)
{
    *bytes = NULL;
    *byte_count = 0;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* O_NONBLOCK: opening a FIFO without a
                                                                     writer must not hang */
    if (fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    gbt_status status = GBT_OK;
    struct stat info;
    unsigned char *buffer = NULL;
    if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        status = base_fail(err, GBT_ERR_IO, "%s: not a regular file", path);
        goto done;
    }
    const size_t size = (size_t)info.st_size;
    buffer = mem_alloc(size + 1, 1, path, err);
    if (buffer == NULL) {
        status = GBT_ERR_NO_MEMORY;
        goto done;
    }
    size_t have = 0;
    while (have < size) {
        const ssize_t got = read(fd, buffer + have, size - have < READ_BYTES ? size - have : READ_BYTES);
        paged_check();
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            status = base_fail(err, GBT_ERR_IO, "%s@%zu: read failed: %s", path, have,
                               got < 0 ? strerror(errno) : "file became shorter");
            goto done;
        }
        have += (size_t)got;
    }
    buffer[size] = 0;
    *bytes = buffer;
    *byte_count = size;
    buffer = NULL;
done:
    mem_free(buffer);
    close(fd);
    return status;
}

size_t file_read_at(int fd, uint64_t at, void *out, size_t count, int *failure)
{
    size_t have = 0;
    *failure = 0;
    while (have < count) {
        const ssize_t got = pread(fd, (char *)out + have, count - have, (off_t)(at + have));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            *failure = errno;
        if (got <= 0)
            break;
        have += (size_t)got;
    }
    return have;
}

gbt_status file_read_all_at(int fd, uint64_t at, void *out, size_t count, const char *path, gbt_error *err)
{
    int failure;
    const size_t have = file_read_at(fd, at, out, count, &failure);
    return have == count
               ? GBT_OK
               : base_fail(err, GBT_ERR_IO, "%s@%llu: read failed: %s", path, (unsigned long long)(at + have),
                           failure != 0 ? strerror(failure) : "file became shorter");
}

gbt_status file_read_ends(const char *path, size_t count, unsigned char *out, size_t *used, gbt_error *err)
{
    *used = 0;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    gbt_status status = GBT_OK;
    struct stat info;
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode)) {
        const uint64_t size = (uint64_t)info.st_size, first = size < count ? size : count,
                       last = size - first < count ? size - first : count;
        for (int i = 0; i < 8; i++)
            out[i] = (unsigned char)(size >> (8 * i));
        *used = (size_t)(8 + first + last);
        status = file_read_all_at(fd, 0, out + 8, (size_t)first, path, err);
        if (status == GBT_OK)
            status = file_read_all_at(fd, size - last, out + 8 + first, (size_t)last, path, err);
    }
    close(fd);
    return status;
}

/* The folder of a path: "a" for both "a/b" and "a/". */
static void folder_of(const char *path, char folder[PATH_LIMIT])
{
    const char *slash = strrchr(path, '/');
    if (slash == NULL)
        snprintf(folder, PATH_LIMIT, ".");
    else
        snprintf(folder, PATH_LIMIT, "%.*s", (int)(slash == path ? 1 : slash - path), path);
}

/* Can `path` be created in `folder`? */
static gbt_status check_folder(const char *folder, const char *path, gbt_error *err)
{
    char inside[PATH_LIMIT];
    GBT_TRY(file_join(inside, sizeof inside, folder, ".", err)); /* fails if `folder` is a file */
    return access(inside, W_OK | X_OK) == 0
               ? GBT_OK
               : base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", path, strerror(errno));
}

gbt_status file_check_creatable(const char *path, gbt_error *err)
{
    char folder[PATH_LIMIT];
    if (file_is_stream(path))
        return access(path, W_OK) == 0
                   ? GBT_OK
                   : base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    folder_of(path, folder);
    GBT_TRY(check_folder(folder, path, err));
    return file_is_folder(path) ? base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", path, strerror(EISDIR))
                                : GBT_OK;
}

gbt_status file_check_folder_creatable(const char *path, gbt_error *err)
{
    char folder[PATH_LIMIT];
    snprintf(folder, sizeof folder, "%s", path);
    while (!file_exists(folder)) { /* ends at "/" or "." */
        char above[PATH_LIMIT];
        folder_of(folder, above);
        memcpy(folder, above, sizeof folder);
    }
    return check_folder(folder, path, err);
}

void file_sync_folder_of(const char *path)
{
    char folder[PATH_LIMIT];
    folder_of(path, folder);
    const int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd); /* some file systems refuse this on folders; the rename itself has already succeeded */
        close(fd);
    }
}

gbt_status file_make_folder(const char *path, gbt_error *err)
{
    char part[PATH_LIMIT];
    if (path[0] == '\0' || strlen(path) >= sizeof part)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s: not a usable folder name", path);
    for (size_t i = 1;; i++) {
        if (path[i] != '/' && path[i] != '\0')
            continue;
        memcpy(part, path, i);
        part[i] = '\0';
        if (mkdir(part, 0777) != 0 && errno != EEXIST)
            return base_fail(err, GBT_ERR_IO, "%s: cannot create folder: %s", part, strerror(errno));
        if (path[i] == '\0')
            break;
    }
    if (!file_is_folder(path))
        return base_fail(err, GBT_ERR_IO, "%s: exists and is not a folder", path);
    return GBT_OK;
}

gbt_status file_lock_folder(const char *path, int *lock, gbt_error *err)
{
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    if (flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        close(fd);
        return base_fail(
            err, GBT_ERR_IO,
            "%s: another process is writing a run there (wait for its end, or name another folder)", path);
    }
    *lock = fd;
    return GBT_OK;
}

void file_unlock_folder(int lock) { close(lock); }

gbt_status file_stat(const char *path, struct stat *out, bool *exists, gbt_error *err)
{
    *exists = stat(path, out) == 0;
    if (!*exists && errno != ENOENT && errno != ENOTDIR && errno != ENAMETOOLONG && errno != ELOOP)
        return base_fail(err, GBT_ERR_IO, "%s: cannot look it up: %s", path, strerror(errno));
    return GBT_OK;
}

gbt_status file_look(const char *path, file_kind *out, gbt_error *err)
{
    struct stat info;
    bool exists;
    const gbt_status status = file_stat(path, &info, &exists, err);
    *out = !exists ? FILE_NONE : S_ISDIR(info.st_mode) ? FILE_FOLDER : FILE_OTHER;
    return status;
}

bool file_exists(const char *path)
{
    file_kind kind;
    return file_look(path, &kind, NULL) != GBT_OK || kind != FILE_NONE;
}

bool file_is_folder(const char *path)
{
    file_kind kind;
    return file_look(path, &kind, NULL) == GBT_OK && kind == FILE_FOLDER;
}

bool file_is_stream(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && !S_ISDIR(info.st_mode) &&
           (!S_ISREG(info.st_mode) || strncmp(path, "/dev/std", 8) == 0 || strncmp(path, "/dev/fd/", 8) == 0);
}

bool file_is_same(const char *a, const char *b)
{
    struct stat first, second;
    return stat(a, &first) == 0 && stat(b, &second) == 0 && first.st_dev == second.st_dev &&
           first.st_ino == second.st_ino;
}

size_t file_mark_bytes(const void *text, size_t count)
{
    return count >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
}

static const char *name_in_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

bool file_is_in(const char *path, const char *folder)
{
    char own[4096];
    const int length = (int)(name_in_folder(path) - path);
    return snprintf(own, sizeof own, "%.*s./", length, path) < (int)sizeof own && file_is_same(own, folder);
}

bool file_is_one(const char *a, const char *b)
{
    char folder[4096];
    const char *name = name_in_folder(a);
    return strcmp(a, b) == 0 || file_is_same(a, b) ||
           (strcmp(name, name_in_folder(b)) == 0 &&
            snprintf(folder, sizeof folder, "%.*s./", (int)(name - a), a) < (int)sizeof folder &&
            file_is_in(b, folder));
}

bool file_ends_with(const char *path, const char *ending)
{
    const size_t length = strlen(path), end = strlen(ending);
    return length > end && strcasecmp(path + length - end, ending) == 0;
}

bool file_largest_number(const char *folder, const char *prefix, unsigned long *out)
{
    DIR *entries = opendir(folder);
    if (entries == NULL)
        return false;
    const size_t length = strlen(prefix);
    bool found = false;
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        const char *digits = entry->d_name + length;
        if (strncmp(entry->d_name, prefix, length) != 0 || !isdigit((unsigned char)digits[0]) ||
            digits[strspn(digits, "0123456789")] != '\0')
            continue;
        const unsigned long number = strtoul(digits, NULL, 10);
        *out = found && number < *out ? *out : number;
        found = true;
    }
    closedir(entries);
    return found;
}

gbt_status file_join(char *out, size_t size, const char *folder, const char *name, gbt_error *err)
{
    const size_t length = strlen(folder);
    const char *separator = length > 0 && folder[length - 1] == '/' ? "" : "/";
    const int wanted = snprintf(out, size, "%s%s%s", folder, separator, name);
    if (wanted < 0 || (size_t)wanted >= size)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", folder);
    return GBT_OK;
}
