/* SPDX-License-Identifier: Apache-2.0 */
/* data/result_folder.c -- finds the newest iteration in a 3DGS result folder, and reads the settings that
   matter. */
#include "data/result_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

enum { REDUCED_MAX = 8 /* of N in images_N; a larger number is no reduction factor */ };

/* The text between "key='" and the next quote; cfg_args is a Python Namespace(...) printed as text. */
static void find_text(const char *text, const char *key, char *out, size_t size)
{
    const char *at = strstr(text, key), *end = at == NULL ? NULL : strchr(at + strlen(key), '\'');
    if (end != NULL && (size_t)(end - at) - strlen(key) < size)
        snprintf(out, size, "%.*s", (int)((size_t)(end - at) - strlen(key)), at + strlen(key));
}

bool result_resolution_divides(double resolution)
{
    return resolution == 1 || resolution == 2 || resolution == 4 || resolution == 8;
}

static void find_resolution(const char *text, result_folder *out)
{
    static const char key[] = "resolution=";
    const char *at = strstr(text, key);
    const double value = at != NULL ? (double)strtol(at + sizeof key - 1, NULL, 10) : 0;
    out->downscale = result_resolution_divides(value) ? value : 0;
    out->width = out->downscale == 0 && value > 0 && value <= 1 << 20 ? (int)value : 0;
}

/* images='images_N': the photos were first reduced by N, then by the `resolution` factor. If `resolution` is
   a width, it alone decides. */
static void find_reduced_photos(const char *text, result_folder *out)
{
    static const char reduced[] = "images_";
    char name[64] = "";
    find_text(text, "images='", name, sizeof name);
    if (strncmp(name, reduced, strlen(reduced)) != 0 || out->width > 0)
        return;
    const long n = strtol(name + strlen(reduced), NULL, 10);
    if (n < 1 || n > REDUCED_MAX)
        return;
    if (out->downscale > 0)
        out->downscale *= (double)n;
    else
        out->reduced = (int)n;
}

static gbt_status read_settings(const char *folder, result_folder *out, gbt_error *err)
{
    char path[RESULT_PATH_SIZE];
    unsigned char *bytes;
    size_t size;
    GBT_TRY(file_join(path, sizeof path, folder, "cfg_args", err));
    if (!file_exists(path))
        return GBT_OK;
    GBT_TRY(file_read(path, &bytes, &size, err));
    find_text((const char *)bytes, "source_path='", out->source, sizeof out->source);
    out->white_background = strstr((const char *)bytes, "white_background=True") != NULL;
    find_resolution((const char *)bytes, out);
    find_reduced_photos((const char *)bytes, out);
    mem_free(bytes);
    return GBT_OK;
}

gbt_status result_folder_find(const char *folder, result_folder *out, bool *found, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    *found = false;
    char clouds[RESULT_PATH_SIZE], name[64];
    GBT_TRY(file_join(clouds, sizeof clouds, folder, "point_cloud", err));
    if (!file_largest_number(clouds, "iteration_", &out->iteration))
        return GBT_OK;
    snprintf(name, sizeof name, "iteration_%lu/point_cloud.ply", out->iteration);
    GBT_TRY(file_join(out->ply, sizeof out->ply, clouds, name, err));
    GBT_TRY(file_join(clouds, sizeof clouds, folder, "model.gbt", err));
    *found = file_exists(out->ply) &&
             !file_exists(clouds); /* a gbtrace run may contain a point_cloud folder, too */
    return *found ? read_settings(folder, out, err) : GBT_OK;
}
