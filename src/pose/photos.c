/* SPDX-License-Identifier: Apache-2.0 */
/* pose/photos.c -- lists the photos of a folder, groups them by camera, and links them into DATA. */
#include "pose/photos.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/image_header.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/raw.h"
#include "data/unposed.h"

enum { DEPTH_MAX = 8, WARNINGS_MAX = 5, LEAST_PIXELS = 64 };

static void leave_out(job *j, const char *why)
{
    if (j->left_out++ < WARNINGS_MAX)
        log_warn("left out: %s", why);
}

/* Add a photo. Damage behind its header is noticed when the whole file is searched for EXIF data. */
static gbt_status take_photo(job *j, const char *path, const char *name, gbt_error *err)
{
    image_header header;
    image_lens lens = {0};
    gbt_error why = {0};
    const bool has_header = image_header_read(path, &header, &why) == GBT_OK;
    if (has_header && (header.width < LEAST_PIXELS || header.height < LEAST_PIXELS))
        base_fail(&why, GBT_ERR_FORMAT, "%s: only %d x %d pixels", path, header.width, header.height);
    else if (has_header && !j->is_film && image_lens_read(path, &lens, &why) != GBT_OK &&
             why.status != GBT_ERR_FORMAT)
        return base_fail(err, why.status, "%s", why.text);
    if (why.status != GBT_OK) {
        leave_out(j, why.text);
        return GBT_OK;
    }
    void *grown = j->photos;
    const gbt_status status = mem_reserve(&grown, &j->photo_capacity, j->photo_count, j->photo_count + 1,
                                          sizeof *j->photos, "photos", err);
    j->photos = grown;
    GBT_TRY(status);
    char *copy = raw_copy_text(name, strlen(name), err);
    if (copy == NULL)
        return GBT_ERR_NO_MEMORY;
    j->photos[j->photo_count++] =
        (job_photo){.name = copy, .width = header.width, .height = header.height, .lens = lens};
    return GBT_OK;
}

/* Add the photos of a folder and its sub-folders. `below`: path of the folder relative to `root`, which
   becomes part of the names; empty, or with a slash at the end. */
static gbt_status walk(job *j, const char *root, const char *below, int depth, gbt_error *err)
{
    char folder[JOB_PATH_SIZE], path[JOB_PATH_SIZE], name[JOB_PATH_SIZE];
    GBT_TRY(file_join(folder, sizeof folder, root, below, err));
    DIR *entries = opendir(folder);
    if (entries == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", folder, strerror(errno));
    gbt_status status = GBT_OK;
    file_kind found;
    for (const struct dirent *entry; status == GBT_OK && (entry = readdir(entries)) != NULL;) {
        if (entry->d_name[0] == '.')
            continue;
        if (snprintf(name, sizeof name, "%s%s", below, entry->d_name) + 1 >= (int)sizeof name) {
            status = base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", folder);
            break;
        }
        status = file_join(path, sizeof path, root, name, err);
        if (status == GBT_OK)
            status = file_look(path, &found, err);
        if (status == GBT_OK && found == FILE_FOLDER) {
            strcat(name, "/");
            if (strcmp(name, "masks/") == 0)
                log_warn("%s: not used to find poses (copy it to %s/masks, where train reads masks)", path,
                         j->data);
            else if (depth < DEPTH_MAX && !file_is_same(path, j->data)) /* not DATA itself, whose photos are
                                                                           links to these */
                status = walk(j, root, name, depth + 1, err);
        } else if (status == GBT_OK && unposed_is_photo(name)) {
            status = take_photo(j, path, name, err);
        } else if (status == GBT_OK && unposed_is_other_photo(name) && j->other_count++ == 0) {
            snprintf(j->other, sizeof j->other, "%s", name);
        }
    }
    closedir(entries);
    return status;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const job_photo *)a)->name, ((const job_photo *)b)->name);
}

gbt_status photos_list(job *j, const char *folder, gbt_error *err)
{
    GBT_TRY(walk(j, folder, "", 0, err));
    if (j->left_out > WARNINGS_MAX)
        log_warn("left out: %zu files more", j->left_out - WARNINGS_MAX);
    if (j->other_count > 0)
        log_warn("left out: %zu photos in formats that are not read, %s for one: convert them to JPEG "
                 "(HEIC: heif-convert, in Debian's libheif-examples)",
                 j->other_count, j->other);
    if (j->photo_count < 3)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %zu photos (wanted 3 or more, PNG or JPEG)", folder,
                         j->photo_count);
    qsort(j->photos, j->photo_count, sizeof *j->photos, by_name);
    return GBT_OK;
}

/* ---- groups that share a camera ---- */

static bool same_camera(const job_photo *a, const job_photo *b)
{
    return a->width == b->width && a->height == b->height && a->lens.focal == b->lens.focal &&
           strcmp(a->lens.camera, b->lens.camera) == 0;
}

void photos_group(job *j)
{
    const job_photo *first[JOB_GROUPS_MAX]; /* the first photo of each group */
    j->groups = 0;
    for (size_t i = 0; i < j->photo_count; i++) {
        job_photo *photo = &j->photos[i];
        for (photo->group = 0; photo->group < j->groups; photo->group++)
            if (same_camera(photo, first[photo->group]))
                break;
        if (photo->group < j->groups)
            continue;
        if (j->groups == JOB_GROUPS_MAX) {
            j->groups++;
            return;
        }
        first[j->groups++] = photo;
    }
}

/* ---- links ---- */

static gbt_status make_folder_of(const char *path, gbt_error *err)
{
    char folder[JOB_PATH_SIZE];
    snprintf(folder, sizeof folder, "%s", path);
    *strrchr(folder, '/') = '\0';
    return file_make_folder(folder, err);
}

gbt_status photos_link(const job *j, gbt_error *err)
{
    for (size_t i = 0; i < j->photo_count; i++) {
        char from[JOB_PATH_SIZE], to[JOB_PATH_SIZE];
        file_kind found;
        GBT_TRY(file_join(from, sizeof from, j->source, j->photos[i].name, err));
        GBT_TRY(file_join(to, sizeof to, j->images, j->photos[i].name, err));
        GBT_TRY(file_look(to, &found, err));
        if (found != FILE_NONE)
            continue;
        GBT_TRY(make_folder_of(to, err));
        if (linkat(AT_FDCWD, from, AT_FDCWD, to, AT_SYMLINK_FOLLOW) == 0)
            continue;
        unsigned char *bytes;
        size_t count;
        GBT_TRY(file_read(from, &bytes, &count, err));
        const gbt_status status = file_write_atomic(to, bytes, count, err);
        mem_free(bytes);
        GBT_TRY(status);
    }
    return GBT_OK;
}

void photos_free(job *j)
{
    for (size_t i = 0; i < j->photo_count; i++)
        mem_free(j->photos[i].name);
    mem_free(j->photos);
    j->photos = NULL;
    j->photo_count = j->photo_capacity = 0;
}
