/* SPDX-License-Identifier: Apache-2.0 */
/* pose/job.c -- paths and marks of finished stages in DATA/colmap. */
#include "pose/job.h"

#include <dirent.h>
#include <stdio.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"

gbt_status job_path(const job *j, const char *name, char out[JOB_PATH_SIZE], gbt_error *err)
{
    return file_join(out, JOB_PATH_SIZE, j->work, name, err);
}

bool job_is_done(const job *j, const char *stage)
{
    char name[32], path[JOB_PATH_SIZE];
    file_kind kind;
    snprintf(name, sizeof name, "%s.done", stage);
    return job_path(j, name, path, NULL) == GBT_OK && file_look(path, &kind, NULL) == GBT_OK &&
           kind != FILE_NONE; /* if unsure, the stage is repeated */
}

gbt_status job_set_done(const job *j, const char *stage, gbt_error *err)
{
    char name[32], path[JOB_PATH_SIZE];
    snprintf(name, sizeof name, "%s.done", stage);
    GBT_TRY(job_path(j, name, path, err));
    return file_write_atomic(path, "", 0, err);
}

void job_set_undone(const job *j, const char *stage)
{
    char name[32], path[JOB_PATH_SIZE];
    snprintf(name, sizeof name, "%s.done", stage);
    if (job_path(j, name, path, NULL) == GBT_OK)
        unlink(path);
}

void job_remove_folder(const char *folder)
{
    DIR *entries = opendir(folder);
    if (entries == NULL)
        return;
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        char path[JOB_PATH_SIZE];
        if (file_join(path, sizeof path, folder, entry->d_name, NULL) == GBT_OK)
            unlink(path);
    }
    closedir(entries);
    rmdir(folder);
}
