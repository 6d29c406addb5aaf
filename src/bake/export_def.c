/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export_def.c -- what an export is asked for: defaults, and whether it can be made, before anything is
   read or written. */
#include "bake/export_def.h"

#include <string.h>

#include "bake/export_folder.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "data/gaussian_file.h"
#include "data/result_folder.h"

gbt_export_def gbt_export_def_default(void)
{
    return (gbt_export_def){.sh_degree = 3, .refine_steps = 500, .backdrop = true, .cookie_ = DEF_COOKIE};
}

/* Check that a file can be written at `path`. A file in the result folder is not checked, because that folder
   is created first and checked itself. */
static gbt_status check_place(const char *path, const char *folder, gbt_error *err)
{
    const size_t length = folder != NULL ? strlen(folder) : 0;
    if (path == NULL ||
        (length > 0 && strncmp(path, folder, length) == 0 && strchr(path + length, '/') == NULL))
        return GBT_OK;
    return file_check_creatable(path, err);
}

/* The file that an input is read from when it is a folder: a run's model, or the Gaussians of a result. */
static gbt_status find_source(const char *input, char out[RESULT_PATH_SIZE], gbt_error *err)
{
    result_folder result;
    bool found;
    GBT_TRY(result_folder_find(input, &result, &found, err));
    if (!found)
        return file_join(out, RESULT_PATH_SIZE, input, "model.gbt", err);
    memcpy(out, result.ply, sizeof result.ply);
    return GBT_OK;
}

static gbt_status check_places(const char *input, const char *json, const char *const *outputs,
                               size_t output_count, gbt_error *err)
{
    const char *folder = NULL;
    for (size_t i = 0; i < output_count; i++)
        for (size_t k = 0; k <= i; k++) {
            const char *other = k < i ? outputs[k] : json;
            if (other != NULL && file_is_one(other, outputs[i]))
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "%s: would be written twice (each output must be another file)", other);
        }
    char source[RESULT_PATH_SIZE];
    GBT_TRY(find_source(input, source, err));
    for (size_t i = 0; i <= output_count; i++) {
        const char *out = i < output_count ? outputs[i] : json;
        if (out != NULL && !file_is_folder(out) && (file_is_same(out, input) || file_is_same(out, source)))
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (%s must be another file)", out,
                             i < output_count ? "the output" : "`json`");
    }
    for (size_t i = 0; i < output_count; i++)
        folder = export_folder_is(outputs[i]) ? outputs[i] : folder;
    if (folder != NULL)
        GBT_TRY(file_check_folder_creatable(folder, err));
    for (size_t i = 0; i < output_count; i++)
        GBT_TRY(check_place(outputs[i], folder, err));
    return check_place(json, folder, err);
}

/* Reject options that have no meaning for plain Gaussians, which are only converted. */
static gbt_status check_plain(const char *input, const gbt_export_def *def, gbt_error *err)
{
    const gbt_export_def usual = gbt_export_def_default();
    const char *const field = def->gaussians != 0                       ? "gaussians"
                              : def->refine_steps != usual.refine_steps ? "refine_steps"
                              : def->backdrop != usual.backdrop         ? "backdrop"
                              : def->data != NULL                       ? "data"
                                                                        : NULL;
    if (field != NULL)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%s: does not apply to plain Gaussians, as in %s (wanted a trained model)", field,
                         input);
    return GBT_OK;
}

gbt_status export_check(const char *input, const gbt_export_def *def, const char *const *outputs,
                        size_t output_count, gbt_error *err)
{
    if (def->sh_degree < 0 || def->sh_degree > 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "sh_degree: %d (wanted 0 to 3)", def->sh_degree);
    if (def->refine_steps < 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "refine_steps: %d (wanted 0 or more)", def->refine_steps);
    if (def->gaussians < 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "gaussians: %d (wanted 0 or more)", def->gaussians);
    if (gaussian_file_readable(input))
        GBT_TRY(check_plain(input, def, err));
    if (output_count < 1 || output_count > EXPORT_OUTPUTS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %zu files to write (wanted 1 to %d)", input,
                         output_count, (int)EXPORT_OUTPUTS_MAX);
    size_t folders = 0;
    for (size_t i = 0; i < output_count; i++)
        if (export_folder_is(outputs[i]))
            folders++;
        else
            GBT_TRY(gaussian_file_check_writable(outputs[i], err));
    if (folders > 1 || (folders == 1 && gaussian_file_readable(input)))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: wanted a run as input, and one result folder at most",
                         input);
    return check_places(input, def->json, outputs, output_count, err);
}
