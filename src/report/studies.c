/* SPDX-License-Identifier: Apache-2.0 */
/* report/studies.c -- embed the charts of studies as a section of the page. */
#include "report/studies.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"

enum { CHART_BYTES_MAX = 1000000, CHARTS_MAX = 16, PATH_LIMIT = 4096 };

/* Headings of this program's studies, by the names of their files. */
static const struct {
    const char *name, *title;
} known[] = {{"speed", "Speed against accuracy"}, {"crosscheck", "Tracer against rasterizer"},
             {"rate", "Bytes against quality"},   {"stability", "Where renderers fail"},
             {"paper", "The paper's tables"},     {"time", "Quality against time"}};

bool report_is_chart(const char *name)
{
    const char *slash = strrchr(name, '/');
    name = slash != NULL ? slash + 1 : name;
    const size_t length = strlen(name);
    return length > 4 && name[0] != '.' && strcmp(name + length - 4, ".svg") == 0;
}

static void add_title(text *out, const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    const size_t length = strlen(name) - 4;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strlen(known[i].name) == length && strncmp(known[i].name, name, length) == 0) {
            text_add(out, known[i].title);
            return;
        }
    text_escaped(out, name);
}

static void add_chart(text *out, const char *path, int *count)
{
    unsigned char *bytes;
    size_t size;
    gbt_error why = {0};
    if (*count == CHARTS_MAX) {
        log_warn("%s: not in the report (at most %d charts)", path, (int)CHARTS_MAX);
        return;
    }
    if (file_read(path, &bytes, &size, &why) != GBT_OK) {
        log_warn("%s", why.text);
        return;
    }
    if (size > 0 && size <= CHART_BYTES_MAX) {
        if ((*count)++ == 0)
            text_add(out, "<section id=\"studies\"><h2>Studies</h2>\n<div class=\"studies\">\n");
        text_add(out, "<figure class=\"study card\"><h3>");
        add_title(out, path);
        text_add(out, "</h3><img alt=\"");
        add_title(out, path);
        text_add(out, "\" src=\"data:image/svg+xml;base64,");
        text_base64(out, bytes, size);
        text_add(out, "\"></figure>\n");
    } else {
        log_warn("%s: %zu bytes: not in the report (wanted 1 to %d)", path, size, (int)CHART_BYTES_MAX);
    }
    mem_free(bytes);
}

static int only_charts(const struct dirent *entry) { return report_is_chart(entry->d_name); }

/** Add the charts of a folder, sorted by name: the order of a directory listing is not defined. */
static void add_folder(text *out, const char *folder, int *count)
{
    struct dirent **entries = NULL;
    const int found = scandir(folder, &entries, only_charts, alphasort);
    for (int i = 0; i < found; i++) {
        char path[PATH_LIMIT];
        gbt_error ignored = {0};
        if (file_join(path, sizeof path, folder, entries[i]->d_name, &ignored) == GBT_OK)
            add_chart(out, path, count);
        free(entries[i]);
    }
    free(entries);
}

void report_studies(text *out, const char *run, const char *const *studies, size_t study_count)
{
    char path[PATH_LIMIT];
    gbt_error ignored = {0};
    int count = 0;
    add_folder(out, run, &count);
    if (file_join(path, sizeof path, run, "studies", &ignored) == GBT_OK)
        add_folder(out, path, &count);
    for (size_t i = 0; i < study_count; i++) {
        const int before = count;
        if (report_is_chart(studies[i]))
            add_chart(out, studies[i], &count);
        else
            add_folder(out, studies[i], &count);
        if (count == before && count < CHARTS_MAX && file_is_folder(studies[i]))
            log_warn("%s: no charts in it", studies[i]);
    }
    if (count > 0)
        text_add(out, "</div></section>\n");
}
