/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_data.c -- where the data set of a run is. */
#include "train/run_data.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

/* Relative path from one absolute folder to another; false when it does not fit into `out`. */
static bool relative_path(const char *from, const char *to, char *out, size_t size)
{
    size_t same = 0, used = 0; /* `same`: length of the common parent path */
    for (size_t i = 0;; i++) {
        const bool from_ends = from[i] == '\0' || from[i] == '/', to_ends = to[i] == '\0' || to[i] == '/';
        if (from_ends && to_ends)
            same = i;
        if (from[i] != to[i] || from[i] == '\0')
            break;
    }
    out[0] = '\0';
    for (const char *c = from + same; *c != '\0'; c++)
        if (*c == '/' && c[1] != '\0')
            used += (size_t)snprintf(out + used, used < size ? size - used : 0, "../");
    const char *rest = to + same + (to[same] == '/');
    return used < size && snprintf(out + used, size - used, "%s", used == 0 && *rest == '\0' ? "." : rest) <
                              (int)(size - used);
}

gbt_status run_data_save(const char *run, const char *data, gbt_error *err)
{
    char path[RUN_DATA_PATH_SIZE], relative[RUN_DATA_PATH_SIZE], text[3 * RUN_DATA_PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, run, RUN_DATA_NAME, err));
    char *run_place = realpath(run, NULL), *data_place = realpath(data, NULL);
    gbt_status status = GBT_OK;
    if (run_place != NULL && data_place != NULL &&
        relative_path(run_place, data_place, relative, sizeof relative)) {
        const int length = snprintf(text, sizeof text, "%s\n%s\n%s\n", data, data_place, relative);
        status = length < (int)sizeof text
                     ? file_write_atomic(path, text, (size_t)length, err)
                     : base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", data);
    }
    free(run_place);
    free(data_place);
    return status;
}

static void try_place(const char *place, run_data *out)
{
    const size_t used = strlen(out->tried);
    snprintf(out->tried + used, sizeof out->tried - used, "%s%s", used > 0 ? ", " : "", place);
    if (out->place[0] == '\0' && file_exists(place))
        snprintf(out->place, sizeof out->place, "%s", place);
}

/* The next line of `*rest`, ended in place. */
static char *take_line(char **rest)
{
    char *line = *rest, *end = strchr(line, '\n');
    *rest = end != NULL ? end + 1 : line + strlen(line);
    if (end != NULL)
        *end = '\0';
    return line;
}

void run_data_find(const char *run, const char *named, run_data *out)
{
    *out = (run_data){0};
    char path[RUN_DATA_PATH_SIZE], near_run[RUN_DATA_PATH_SIZE];
    unsigned char *bytes = NULL;
    size_t byte_count;
    char *folder = out->folder;
    snprintf(folder, sizeof out->folder, "%s", run);
    if (!file_is_folder(run)) {
        char *slash = strrchr(folder, '/');
        snprintf(slash != NULL ? slash + 1 : folder, 2, "%s", slash != NULL ? "" : ".");
    }
    if (file_join(path, sizeof path, folder, RUN_DATA_NAME, NULL) == GBT_OK && file_exists(path) &&
        file_read(path, &bytes, &byte_count, NULL) == GBT_OK) {
        char *rest = (char *)bytes;
        const char *saved = take_line(&rest), *absolute = take_line(&rest), *relative = take_line(&rest);
        if (strcmp(saved, named) == 0 && absolute[0] == '/' && relative[0] != '\0') {
            try_place(absolute, out);
            const bool there = out->place[0] != '\0';
            if (file_join(near_run, sizeof near_run, folder, relative, NULL) == GBT_OK)
                try_place(near_run, out);
            out->moved = !there && out->place[0] != '\0';
        }
    }
    mem_free(bytes);
    if (named[0] != '\0')
        try_place(named, out);
}
