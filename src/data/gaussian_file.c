/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_file.c -- reads and writes plain Gaussians in the format that the file's ending names. */
#include "data/gaussian_file.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/file.h"
#include "base/log.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_order.h"
#include "data/result_folder.h"
#include "gbtrace/export.h"

static const gaussian_format *const formats[] = {
#define X(name) &gaussian_format_##name,
    GAUSSIAN_FORMATS(X)
#undef X
};

enum { FORMAT_COUNT = sizeof formats / sizeof *formats, LIST_SIZE = 128 };

int gbt_export_format_count(void) { return FORMAT_COUNT; }

gbt_export_format gbt_export_format_at(int index)
{
    const gaussian_format *f = formats[index];
    return (gbt_export_format){.ending = f->ending, .what = f->what};
}

/* The readable or writable endings as a sentence: ".ply, .splat or .glb". */
static const char *list(const char *before_last, char out[LIST_SIZE])
{
    size_t used = 0;
    out[0] = '\0';
    for (int i = 0; i < FORMAT_COUNT && used < LIST_SIZE; i++)
        used += (size_t)snprintf(out + used, LIST_SIZE - used, "%s%s",
                                 i == 0                  ? ""
                                 : i == FORMAT_COUNT - 1 ? before_last
                                                         : ", ",
                                 formats[i]->ending);
    return out;
}

/* The longest matching ending wins, because .compressed.ply also ends in .ply. */
static const gaussian_format *format_of(const char *path)
{
    const gaussian_format *found = NULL;
    for (int i = 0; i < FORMAT_COUNT; i++)
        if (file_ends_with(path, formats[i]->ending) &&
            (found == NULL || strlen(formats[i]->ending) > strlen(found->ending)))
            found = formats[i];
    return found;
}

/* .usd and .usdc go to the text reader, which tells a binary file from text and reports it. */
static const gaussian_format *format_read_as(const char *path)
{
    const char *ending = strrchr(path, '.');
    if (ending != NULL && (strcasecmp(ending, ".usd") == 0 || strcasecmp(ending, ".usdc") == 0))
        return &gaussian_format_usda;
    return format_of(path);
}

/* The file itself, or the newest .ply of a result folder. NULL when nothing there can be read. */
static const char *find_file(const char *path, result_folder *folder)
{
    bool found;
    if (file_is_folder(path))
        return result_folder_find(path, folder, &found, NULL) == GBT_OK && found ? folder->ply : NULL;
    return format_read_as(path) != NULL ? path : NULL;
}

bool gaussian_file_readable(const char *path)
{
    result_folder folder;
    return find_file(path, &folder) != NULL;
}

bool gaussian_file_has_gaussians(const char *given)
{
    result_folder folder;
    const char *path = find_file(given, &folder);
    if (path == NULL || format_read_as(path)->holds == NULL)
        return path != NULL;
    source_file file = {.name = path};
    unsigned char *bytes;
    if (file_read(path, &bytes, &file.size, NULL) != GBT_OK)
        return false;
    file.bytes = bytes;
    const bool has = format_read_as(path)->holds(&file);
    mem_free(bytes);
    return has;
}

gbt_status gaussian_file_read(const char *given, gaussian_cloud *out, gbt_error *err)
{
    char all[LIST_SIZE];
    memset(out, 0, sizeof *out);
    result_folder folder;
    const char *path = find_file(given, &folder);
    if (path == NULL)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%s: cannot be read as Gaussians (wanted %s or a 3DGS result folder)", given,
                         list(", ", all));
    source_file file = {.name = path};
    unsigned char *bytes;
    GBT_TRY(file_read(path, &bytes, &file.size, err));
    file.bytes = bytes;
    const gbt_status status = format_read_as(path)->read(&file, out, err);
    mem_free(bytes);
    if (status == GBT_OK)
        gaussian_cloud_warn(out, path);
    return status;
}

gbt_status gaussian_file_check_writable(const char *path, gbt_error *err)
{
    char all[LIST_SIZE];
    return format_of(path) != NULL ? GBT_OK
                                   : base_fail(err, GBT_ERR_ARGUMENT, "%s: unknown file ending (wanted %s)",
                                               path, list(" or ", all));
}

int gaussian_file_degree(const char *path)
{
    const gaussian_format *format = format_of(path);
    return format != NULL ? format->degree : 3;
}

/* Warn when world coordinates as floats have steps that are large compared with the Gaussians. */
static gbt_status check_precision(const char *path, const gaussian_cloud *cloud, const double origin[3],
                                  gbt_error *err)
{
    double farthest = 0, size = 0;
    for (int k = 0; k < 3; k++)
        farthest = fmax(farthest, fabs(origin[k]));
    float *sizes = mem_alloc(cloud->count, sizeof *sizes, "sizes", err);
    if (sizes == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *l = cloud->scale_log + 3 * i;
        sizes[i] = fmaxf(l[0], fmaxf(l[1], l[2]));
    }
    if (cloud->count > 0)
        size = exp((double)gaussian_median(sizes, cloud->count));
    mem_free(sizes);
    if (farthest * (double)FLT_EPSILON > 0.1 * size)
        log_warn(
            "%s: coordinates as far as %g are rounded to %.2g, and half of all Gaussians are smaller than "
            "%.2g (.usda, .usdz and .glb keep the origin apart)",
            path, farthest, farthest * (double)FLT_EPSILON, size);
    return GBT_OK;
}

gbt_status gaussian_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                               gbt_error *err)
{
    double whole[3];
    GBT_TRY(gaussian_file_check_writable(path, err));
    for (int k = 0; k < 3; k++)
        whole[k] = origin[k] + cloud->origin[k];
    if (!format_of(path)->keeps_origin)
        GBT_TRY(check_precision(path, cloud, whole, err));
    return format_of(path)->write(path, cloud, whole, err);
}
