/* SPDX-License-Identifier: Apache-2.0 */
/* study/model.h -- the models given to a study: their names, and the cameras of plain Gaussians. */
#ifndef GBT_STUDY_MODEL_H
#define GBT_STUDY_MODEL_H

#include <stddef.h>

#include "gbtrace/status.h"

/** The name of a model: "b/scene.ply" for "a/b/scene.ply" and "b/run1" for "a/b/run1/". Short, but different
    for models in the same layout of folders. Truncated to `size`. */
void study_model_name(const char *path, char *out, size_t size);

/** Make a name usable in file names: letters, digits, '.' and '-' stay, all else becomes '_'. */
void study_model_letters(char *name);

/** GBT_ERR_ARGUMENT if two models would get the same name, or files of the same name. */
gbt_status study_models_differ(const char *const *paths, size_t count, gbt_error *err);

/** The camera for a file of plain Gaussians: `given` if not NULL, else camera.json in the same folder. GBT_OK
    or GBT_ERR_ARGUMENT (there is none, or its path exceeds `size`). */
gbt_status study_model_camera(const char *path, const char *given, char *out, size_t size, gbt_error *err);

#endif
