/* SPDX-License-Identifier: Apache-2.0 */
/* study/model.h -- the models that a study is given: what they are called, and where the camera of plain
   Gaussians is. */
#ifndef GBT_STUDY_MODEL_H
#define GBT_STUDY_MODEL_H

#include <stddef.h>

#include "gbtrace/status.h"

/** "a/b/scene.ply" and "a/b/run1/" have names "b/scene.ply" and "b/run1": short, and different for models of
    one layout. Cut to `size`. */
void study_model_name(const char *path, char *out, size_t size);

/** Letters, digits, '.' and '-' stay; others become '_': a part of a file's name. */
void study_model_letters(char *name);

/** GBT_ERR_ARGUMENT where two of the models would have one name, or files of one name. */
gbt_status study_models_differ(const char *const *paths, size_t count, gbt_error *err);

/** The camera of a file of plain Gaussians: what the caller says (not NULL), else camera.json beside it.
    GBT_OK or GBT_ERR_ARGUMENT (there is none, or its path is longer than `size`). */
gbt_status study_model_camera(const char *path, const char *given, char *out, size_t size, gbt_error *err);

#endif
