/* SPDX-License-Identifier: Apache-2.0 */
/* data/unposed.c -- names of photos and films. */
#include "data/unposed.h"

#include <dirent.h>
#include <string.h>
#include <strings.h>

#include "base/fail.h"
#include "base/file.h"

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

bool unposed_is_film(const char *name)
{
    static const char *const endings[] = {".mp4", ".mov",  ".m4v", ".mkv", ".webm", ".avi",
                                          ".mpg", ".mpeg", ".mts", ".3gp", ".wmv",  ".gif"};
    return ends_as(name, endings, sizeof endings / sizeof *endings);
}

bool unposed_has_photos(const char *folder, int depth)
{
    DIR *entries = opendir(folder);
    bool found = false;
    if (entries == NULL)
        return false;
    for (const struct dirent *entry; !found && (entry = readdir(entries)) != NULL;) {
        char path[PATH_SIZE];
        if (entry->d_name[0] == '.' || file_join(path, sizeof path, folder, entry->d_name, NULL) != GBT_OK)
            continue;
        found = file_is_folder(path) ? depth > 0 && unposed_has_photos(path, depth - 1)
                                     : unposed_is_photo(entry->d_name);
    }
    closedir(entries);
    return found;
}

gbt_status unposed_check(const char *path, gbt_error *err)
{
    const bool is_film = !file_is_folder(path) && unposed_is_film(path);
    if (!is_film && !unposed_has_photos(path, 1))
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: %s without camera poses (find them with: gbtrace pose %s -o DATA)", path,
                     is_film ? "a film" : "photos", path);
}
