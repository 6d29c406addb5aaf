/* SPDX-License-Identifier: Apache-2.0 */
/* train/old_run.c -- what a new run does with the files that are in its folder already. */
#include "train/old_run.h"

#include <dirent.h>
#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "train/event_records.h"
#include "train/pose_file.h"
#include "train/run_data.h"
#include "train/run_split.h"

enum { OLD_PATH_SIZE = 4096 };

static const char *const left[] = {
    "report.html",    "metrics.json",  "train.json",          EVENTS_TRAIN_NAME,
    EVENTS_EVAL_NAME, "exposure.json", POSE_FILE_NAME,        "checkpoints/last.gbt.prev",
    RUN_SPLIT_NAME,   "model.gbt",     "checkpoints/last.gbt"};

static const char *const replaced[] = {"config", "log.csv"}; /* when a run starts; also data_places, below */

enum { LEFT_COUNT = sizeof left / sizeof *left, REPLACED_COUNT = sizeof replaced / sizeof *replaced };

gbt_status old_run_check_foreign(const char *run, gbt_error *err)
{
    char path[OLD_PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, run, RUN_DATA_NAME, err));
    if (file_exists(path))
        return GBT_OK;
    for (int i = 0; i < LEFT_COUNT + REPLACED_COUNT; i++) {
        file_kind kind;
        GBT_TRY(file_join(path, sizeof path, run, i < LEFT_COUNT ? left[i] : replaced[i - LEFT_COUNT], err));
        GBT_TRY(file_look(path, &kind, err));
        if (kind == FILE_OTHER && !file_is_stream(path))
            return base_fail(
                err, GBT_ERR_ARGUMENT,
                "%.1000s: would be replaced, but its folder holds no run (choose another folder, "
                "or replace such files with `overwrite`)",
                path);
    }
    return GBT_OK;
}

static gbt_status remove_file(const char *folder, const char *name, gbt_error *err)
{
    char path[OLD_PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    if (unlink(path) != 0 && errno != ENOENT && errno != ENOTDIR)
        return base_fail(err, GBT_ERR_IO, "%s: cannot remove it: %s", path, strerror(errno));
    return GBT_OK;
}

static bool is_picture(const char *name)
{
    const size_t length = strlen(name);
    return length > 4 && strcmp(name + length - 4, ".png") == 0;
}

/* Images of held-out views: the new run may hold out other views. */
static gbt_status remove_pictures(const char *run, gbt_error *err)
{
    char folder[OLD_PATH_SIZE];
    GBT_TRY(file_join(folder, sizeof folder, run, "renders/test", err));
    DIR *entries = opendir(folder);
    if (entries == NULL)
        return GBT_OK;
    gbt_status status = GBT_OK;
    for (const struct dirent *entry; status == GBT_OK && (entry = readdir(entries)) != NULL;)
        if (is_picture(entry->d_name))
            status = remove_file(folder, entry->d_name, err);
    closedir(entries);
    return status;
}

gbt_status old_run_remove(const char *run, gbt_error *err)
{
    GBT_TRY(remove_pictures(run, err));
    for (int i = 0; i < LEFT_COUNT; i++)
        GBT_TRY(remove_file(run, left[i], err));
    return GBT_OK;
}
