/* SPDX-License-Identifier: Apache-2.0 */
/* base/large_file.c -- files written and read in pieces, and the atomic replacement of files. */
#include "base/large_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/unnamed_file.h"

static gbt_status set_name(large_file *out, const char *path, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (snprintf(out->name, sizeof out->name, "%s", path) >= (int)sizeof out->name)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", path);
    return GBT_OK;
}

gbt_status large_file_open(const char *path, large_file *out, gbt_error *err)
{
    struct stat info;
    GBT_TRY(set_name(out, path, err));
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        close(fd);
        return base_fail(err, GBT_ERR_IO, "%s: not a regular file", path);
    }
    out->open = true;
    out->descriptor = fd;
    out->size = (uint64_t)info.st_size;
    return GBT_OK;
}

gbt_status large_file_create(const char *path, large_file *out, gbt_error *err)
{
    struct stat old;
    const bool stream = file_is_stream(path);
    GBT_TRY(set_name(out, path, err));
    const char *slash = strrchr(path, '/');
    const int folder_length = slash == NULL ? 0 : (int)(slash - path) + 1;
    if (!stream && snprintf(out->temporary, sizeof out->temporary, "%.*s.%s.tmp", folder_length, path,
                            path + folder_length) >= (int)sizeof out->temporary)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", path);
    const int fd = stream ? open(path, O_WRONLY | O_APPEND | O_CLOEXEC)
                          : open(out->temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", path, strerror(errno));
    if (!stream && stat(path, &old) == 0) /* keep the permissions of the old file, with write permission for
                                             the owner, who may append later, as to log.csv */
        fchmod(fd, (old.st_mode & 0777) | S_IWUSR);
    out->open = true;
    out->descriptor = fd;
    return GBT_OK;
}

gbt_status large_file_scratch(const char *folder, large_file *out, gbt_error *err)
{
    GBT_TRY(set_name(out, folder, err));
    GBT_TRY(unnamed_file_open(folder, &out->descriptor, err));
    out->open = true;
    return GBT_OK;
}

gbt_status large_file_put(large_file *file, const void *bytes, size_t count, gbt_error *err)
{
    const unsigned char *from = bytes;
    for (size_t done = 0; done < count;) {
        const ssize_t put = write(file->descriptor, from + done, count - done);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return base_fail(err, GBT_ERR_IO, "%s: write failed: %s", file->name,
                             strerror(put < 0 ? errno : ENOSPC));
        done += (size_t)put;
        file->size += (uint64_t)put;
    }
    return GBT_OK;
}

gbt_status large_file_read(const large_file *file, uint64_t at, void *bytes, size_t count, gbt_error *err)
{
    return file_read_all_at(file->descriptor, at, bytes, count, file->name, err);
}

gbt_status large_file_close(large_file *file, bool keep, gbt_error *err)
{
    if (!file->open)
        return GBT_OK;
    const bool made = file->temporary[0] != '\0';
    gbt_status status = GBT_OK;
    if (made && keep && fsync(file->descriptor) != 0)
        status = base_fail(err, GBT_ERR_IO, "%s: fsync failed: %s", file->name, strerror(errno));
    if (close(file->descriptor) != 0 && made && keep && status == GBT_OK)
        status = base_fail(err, GBT_ERR_IO, "%s: close failed: %s", file->name, strerror(errno));
    if (made && keep && status == GBT_OK && rename(file->temporary, file->name) != 0)
        status = base_fail(err, GBT_ERR_IO, "%s: cannot replace: %s", file->name, strerror(errno));
    if (made && keep && status == GBT_OK)
        file_sync_folder_of(file->name);
    else if (made)
        unlink(file->temporary);
    memset(file, 0, sizeof *file);
    return status;
}
