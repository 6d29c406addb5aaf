/* SPDX-License-Identifier: Apache-2.0 */
/* eval/scores.c -- paths of the images of a scored view. */
#include "eval/scores.h"

#include <stdio.h>

#include "base/fail.h"
#include "base/file.h"

gbt_status view_score_paths(view_score *score, const char *folder, gbt_error *err)
{
    char file[FILE_NAME_SIZE + 16];
    const struct {
        const char *suffix;
        char *path;
    } outputs[] = {
        {".png", score->render_path}, {".photo.png", score->photo_path}, {".flip.png", score->error_path}};
    for (int i = 0; i < 3; i++) {
        snprintf(file, sizeof file, "%s%s", score->file, outputs[i].suffix);
        GBT_TRY(file_join(outputs[i].path, VIEW_PATH_SIZE, folder, file, err));
    }
    return GBT_OK;
}
