/* SPDX-License-Identifier: Apache-2.0 */
/* data/unposed.c -- recognises photos and films by the endings of their names. */
#include "data/unposed.h"

#include <dirent.h>
#include <string.h>
#include <strings.h>

#include "base/fail.h"
#include "base/file.h"
#include "gbtrace/progress.h"

enum { PATH_SIZE = 4096 };

static bool ends_as(const char *name, const char *const *endings, size_t count)
{
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot != NULL && dot > name && i < count; i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return true;
    return false;
}

bool unposed_is_photo(const char *name)
{
    static const char *const endings[] = {".jpg", ".jpeg", ".png"};
    return ends_as(name, endings, sizeof endings / sizeof *endings);
}

bool unposed_is_other_photo(const char *name)
{
    static const char *const endings[] = {".heic", ".heif", ".avif", ".webp", ".tif", ".tiff",
                                          ".bmp",  ".jxl",  ".dng",  ".cr2",  ".cr3", ".nef",
                                          ".arw",  ".raf",  ".orf",  ".rw2"};
    return ends_as(name, endings, sizeof endings / sizeof *endings);
}

static bool is_film(const char *name)
{
    static const char *const endings[] = {".mp4", ".mov",  ".m4v", ".mkv", ".webm", ".avi",
                                          ".mpg", ".mpeg", ".mts", ".3gp", ".wmv",  ".gif"};
    return ends_as(name, endings, sizeof endings / sizeof *endings);
}

static bool has_files(const char *folder, int depth, bool (*wanted)(const char *name))
{
    DIR *entries = opendir(folder);
    bool found = false;
    if (entries == NULL)
        return false;
    for (const struct dirent *entry; !found && (entry = readdir(entries)) != NULL;) {
        char path[PATH_SIZE];
        if (entry->d_name[0] == '.' || file_join(path, sizeof path, folder, entry->d_name, NULL) != GBT_OK)
            continue;
        found =
            file_is_folder(path) ? depth > 0 && has_files(path, depth - 1, wanted) : wanted(entry->d_name);
    }
    closedir(entries);
    return found;
}

bool unposed_has_photos(const char *folder, int depth) { return has_files(folder, depth, unposed_is_photo); }

gbt_status unposed_check(const char *path, gbt_error *err)
{
    const bool film = !file_is_folder(path) && is_film(path);
    if (!film && !unposed_has_photos(path, 1) && !has_files(path, 1, unposed_is_other_photo))
        return GBT_OK;
    char word[PATH_SIZE];
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: %s without camera poses (find them with: gbtrace pose %s -o DATA)", path,
                     film ? "a film" : "photos", gbt_shell_word(path, word, sizeof word));
}
