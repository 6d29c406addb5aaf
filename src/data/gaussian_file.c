/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_file.c -- formats by the ending of a name. */
#include "data/gaussian_file.h"

#include <string.h>
#include <strings.h>

#include "base/file.h"
#include "data/glb_file.h"
#include "data/gaussian_ply.h"
#include "data/result_folder.h"
#include "data/splat_file.h"
#include "data/spz_file.h"

static const struct {
    const char *ending;
    int degree; /* of the colours it keeps */
    gbt_status (*read)(const source_file *file, gaussian_cloud *out, gbt_error *err); /* NULL: cannot */
    gbt_status (*write)(const char *path, const gaussian_cloud *cloud, const double origin[3],
                        gbt_error *err);
} formats[] = {
    {".ply", 3, gaussian_ply_read, gaussian_ply_write},
    {".splat", 0, splat_file_read, splat_file_write},
    {".spz", 3, spz_file_read, spz_file_write},
    {".glb", 3, NULL, glb_file_write},
};

enum { FORMAT_COUNT = sizeof formats / sizeof *formats };

static int format_of(const char *path)
{
    const size_t length = strlen(path);
    for (int i = 0; i < FORMAT_COUNT; i++) {
        const size_t ending = strlen(formats[i].ending);
        if (length > ending && strcasecmp(path + length - ending, formats[i].ending) == 0)
            return i;
    }
    return -1;
}

/* The file itself, or the newest one of a result folder; NULL when there is none that can be read. */
static const char *find_file(const char *path, result_folder *folder)
{
    bool found;
    if (file_is_folder(path))
        return result_folder_find(path, folder, &found, NULL) == GBT_OK && found ? folder->ply : NULL;
    const int format = format_of(path);
    return format >= 0 && formats[format].read != NULL ? path : NULL;
}

bool gaussian_file_readable(const char *path)
{
    result_folder folder;
    return find_file(path, &folder) != NULL;
}

gbt_status gaussian_file_check_readable(const char *path, gbt_error *err)
{
    const int format = format_of(path);
    return format < 0 || formats[format].read != NULL || file_is_folder(path)
               ? GBT_OK
               : base_fail(
                     err, GBT_ERR_ARGUMENT,
                     "%s: %s is written for other programs, not read (wanted .ply, .splat, .spz, or a run)",
                     path, formats[format].ending);
}

bool gaussian_file_has_gaussians(const char *given)
{
    result_folder folder;
    const char *path = find_file(given, &folder);
    if (path == NULL || formats[format_of(path)].read != gaussian_ply_read)
        return path != NULL;
    source_file file = {.name = path};
    unsigned char *bytes;
    if (file_read(path, &bytes, &file.size, NULL) != GBT_OK)
        return false;
    file.bytes = bytes;
    const bool has = gaussian_ply_has_gaussians(&file);
    mem_free(bytes);
    return has;
}

gbt_status gaussian_file_read(const char *given, gaussian_cloud *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    result_folder folder;
    const char *path = find_file(given, &folder);
    if (path == NULL)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "%s: cannot be read as Gaussians (wanted .ply, .splat, .spz or a 3DGS result folder)", given);
    source_file file = {.name = path};
    unsigned char *bytes;
    GBT_TRY(file_read(path, &bytes, &file.size, err));
    file.bytes = bytes;
    const gbt_status status = formats[format_of(path)].read(&file, out, err);
    mem_free(bytes);
    return status;
}

gbt_status gaussian_file_check_writable(const char *path, gbt_error *err)
{
    return format_of(path) >= 0 ? GBT_OK
                                : base_fail(err, GBT_ERR_ARGUMENT,
                                            "%s: which format? (wanted .ply, .splat, .spz or .glb)", path);
}

int gaussian_file_degree(const char *path)
{
    const int format = format_of(path);
    return format >= 0 ? formats[format].degree : 3;
}

gbt_status gaussian_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                               gbt_error *err)
{
    GBT_TRY(gaussian_file_check_writable(path, err));
    return formats[format_of(path)].write(path, cloud, origin, err);
}
