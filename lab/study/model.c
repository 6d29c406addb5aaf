/* SPDX-License-Identifier: Apache-2.0 */
/* study/model.c -- the models given to a study: their names, and the cameras of plain Gaussians. */
#include "study/model.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"

void study_model_name(const char *path, char *out, size_t size)
{
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        length--;
    size_t start = length;
    for (int parts = 0; start > 0; start--)
        if (path[start - 1] == '/' && ++parts == 2)
            break;
    snprintf(out, size, "%.*s", (int)(length - start), path + start);
}

void study_model_letters(char *name)
{
    for (char *c = name; *c != '\0'; c++)
        if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || *c == '.' ||
              *c == '-'))
            *c = '_';
}

gbt_status study_models_differ(const char *const *paths, size_t count, gbt_error *err)
{
    char name[256], other[256];
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < i; j++) {
            study_model_name(paths[i], name, sizeof name);
            study_model_name(paths[j], other, sizeof other);
            study_model_letters(name);
            study_model_letters(other);
            if (strcmp(name, other) == 0)
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "study: %.200s and %.200s would have one name (wanted paths whose last two "
                                 "parts differ)",
                                 paths[j], paths[i]);
        }
    return GBT_OK;
}

gbt_status study_model_camera(const char *path, const char *given, char *out, size_t size, gbt_error *err)
{
    const char *slash = strrchr(path, '/');
    const int length = given != NULL ? snprintf(out, size, "%s", given)
                                     : snprintf(out, size, "%.*scamera.json",
                                                slash == NULL ? 0 : (int)(slash - path) + 1, path);
    if (length >= (int)size)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", path);
    if (given == NULL && !file_exists(out))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "%.300s: plain Gaussians have no cameras (wanted --camera FILE.json, or camera.json beside it)",
            path);
    return GBT_OK;
}
