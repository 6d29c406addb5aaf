/* SPDX-License-Identifier: Apache-2.0 */
/* cli/report.c -- print errors as one line, and suggest the name that a mistyped one may have meant. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "cli/options.h"
#include "cli/progress.h"

static void print_error(const char *text)
{
    char line[1024];
    snprintf(line, sizeof line, "%s", text);
    for (char *c = line; *c != '\0'; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f)
            *c = '?';
    progress_error(line);
}

int command_failed(gbt_status status, const gbt_error *err)
{
    char text[sizeof err->text + 64], named[sizeof err->text + 128];
    if (status == GBT_OK)
        return 0;
    if (status == GBT_ERR_ARGUMENT)
        options_name_fields(err->text, text, sizeof text);
    else
        snprintf(text, sizeof text, "%s", err->text);
    options_name_quoted(text, named, sizeof named);
    print_error(named[0] != '\0' ? named : "failed without a reason");
    return gbt_status_exit_code(status);
}

int command_misused(const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    print_error(text);
    return gbt_status_exit_code(GBT_ERR_ARGUMENT);
}

enum { NAME_LIMIT = 40 };

static int smaller(int a, int b) { return a < b ? a : b; }

/** Restricted Damerau-Levenshtein distance: insertions, deletions, substitutions and swaps of neighbours that
   turn `a` into `b`. Both are shorter than NAME_LIMIT. */
static int edit_distance(const char *a, const char *b)
{
    const int m = (int)strlen(a), n = (int)strlen(b);
    int d[NAME_LIMIT + 1][NAME_LIMIT + 1];
    for (int i = 0; i <= m; i++)
        d[i][0] = i;
    for (int j = 0; j <= n; j++)
        d[0][j] = j;
    for (int i = 1; i <= m; i++)
        for (int j = 1; j <= n; j++) {
            d[i][j] =
                smaller(smaller(d[i - 1][j], d[i][j - 1]) + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = smaller(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[m][n];
}

const char *command_nearest(const char *typed, const char *const *names, int count)
{
    const int length = (int)strnlen(typed, NAME_LIMIT);
    if (length == 0 || length == NAME_LIMIT)
        return NULL;
    int best = length / 3 + 2; /* beyond this distance a suggestion would be a mere guess */
    const char *nearest = NULL;
    for (int i = 0; i < count; i++) {
        if (strlen(names[i]) >= NAME_LIMIT)
            continue;
        const int distance = edit_distance(typed, names[i]);
        if (distance < best && distance < (int)strlen(names[i])) {
            best = distance;
            nearest = names[i];
        }
    }
    return nearest;
}
