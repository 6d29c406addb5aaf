/* SPDX-License-Identifier: Apache-2.0 */
/* study/model.c -- the models that a study is given: what they are called, and where the camera of plain
   Gaussians is. */
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
            "%.300s: plain Gaussians know no cameras (wanted --camera FILE.json, or camera.json beside it)",
            path);
    return GBT_OK;
}
