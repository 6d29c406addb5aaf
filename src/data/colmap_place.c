/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_place.c -- finds the folder of a COLMAP model by the names of its files. */
#include "data/colmap_place.h"

#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "data/unposed.h"

enum { PATH_SIZE = 4096, DEPTH = 3 /* how many folder levels are searched: a/b/sparse/0 */ };

/* ---- the usual folders ---- */

/* Count which of the model's three files exist with this ending. */
static gbt_status count_model_files(const char *folder, const char *ending, int *count, gbt_error *err)
{
    static const char *const names[3] = {"cameras", "images", "points3D"};
    *count = 0;
    for (int i = 0; i < 3; i++) {
        char name[32], path[2 * PATH_SIZE];
        snprintf(name, sizeof name, "%s.%s", names[i], ending);
        GBT_TRY(file_join(path, sizeof path, folder, name, err));
        *count += file_exists(path);
    }
    return GBT_OK;
}

gbt_status colmap_place_find(const char *folder, colmap_layout layout, char *model, size_t size,
                             const char **ending, gbt_error *err)
{
    static const char *const places[][3] = {
        [COLMAP_USUAL] = {"sparse/0", "sparse", ""}, [COLMAP_NERFSTUDIO] = {"colmap/sparse/0"}};
    for (int i = 0; i < 3 && places[layout][i] != NULL; i++) {
        int binary, text;
        GBT_TRY(file_join(model, size, folder, places[layout][i], err));
        GBT_TRY(count_model_files(model, "bin", &binary, err));
        GBT_TRY(count_model_files(model, "txt", &text, err));
        /* A complete set wins over an incomplete one, then binary over text. */
        *ending = binary == 3 || (text != 3 && binary > 0) ? "bin" : "txt";
        if (binary > 0 || text == 3 || (text > 0 && places[layout][i][0] != '\0'))
            return GBT_OK;
    }
    model[0] = '\0';
    return GBT_OK;
}

/* ---- other folders, for the error message ---- */

static bool holds_model(const char *folder)
{
    int binary, text;
    return count_model_files(folder, "bin", &binary, NULL) == GBT_OK &&
           count_model_files(folder, "txt", &text, NULL) == GBT_OK && (binary == 3 || text == 3);
}

/* Among all folders named `sparse`, and folders directly inside one, that hold a model: the first by name. */
static void find_elsewhere(const char *folder, bool is_sparse, int depth, char best[PATH_SIZE])
{
    DIR *entries = opendir(folder);
    if (entries == NULL)
        return;
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        char path[PATH_SIZE];
        if (entry->d_name[0] == '.' || file_join(path, sizeof path, folder, entry->d_name, NULL) != GBT_OK ||
            !file_is_folder(path))
            continue;
        const bool now_sparse = strcmp(entry->d_name, "sparse") == 0;
        if ((is_sparse || now_sparse) && holds_model(path)) {
            if (best[0] == '\0' || strcmp(path, best) < 0)
                memcpy(best, path, sizeof path);
        } else if (depth > 0) {
            find_elsewhere(path, now_sparse, depth - 1, best);
        }
    }
    closedir(entries);
}

/* The data set folder that a model folder belongs to; false when that has no photos. */
static bool find_data_set(const char *model, const char *ending, char out[PATH_SIZE])
{
    const size_t length = strlen(model), cut = strlen(ending);
    if (length <= cut || strcmp(model + length - cut, ending) != 0)
        return false;
    snprintf(out, PATH_SIZE, "%.*s", (int)(length - cut), model);
    return unposed_has_photos(out, 2);
}

gbt_status colmap_place_check(const char *folder, gbt_error *err)
{
    char model[PATH_SIZE] = "", data[PATH_SIZE];
    find_elsewhere(folder, false, DEPTH, model);
    if (model[0] == '\0')
        return GBT_OK;
    if ((find_data_set(model, "/colmap/sparse/0", data) || find_data_set(model, "/sparse/0", data) ||
         find_data_set(model, "/sparse", data)) &&
        strlen(data) > strlen(folder))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%.150s: a COLMAP model is in %.150s (wanted the folder %.150s)", folder, model,
                         data);
    return base_fail(err, GBT_ERR_FORMAT,
                     "%.150s: a COLMAP model is in %.150s (wanted: moved to %.150s/sparse/0)", folder, model,
                     folder);
}
