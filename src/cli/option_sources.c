/* SPDX-License-Identifier: Apache-2.0 */
/* cli/option_sources.c -- options from persistent sources: a configuration file, the environment. */
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "cli/options.h"

enum { GO_ON = -1, CONFIG_LIMIT = 1 << 20 };

/* Not allowed are rows that only explain options of other programs, and rows with a fixed value, which are
   alternative spellings for the command line. */
static bool may_stand_here(const option *o) { return o->kind != OPTION_ELSEWHERE && o->fixed == NULL; }

/* ---- the configuration file ---- */

static int config_failed(gbt_status status, const char *path, int line, const char *what, const char *detail)
{
    gbt_error err = {.status = status};
    if (line > 0)
        snprintf(err.text, sizeof err.text, "%.150s:%d: %.60s%.250s", path, line, detail, what);
    else
        snprintf(err.text, sizeof err.text, "%.200s: %.100s%.100s", path, what, detail);
    return command_failed(status, &err);
}

/** Read the file as a zero-terminated string. It is never freed, because options point into it. */
static int read_config_file(const char *path, char **text)
{
    static char buffer[CONFIG_LIMIT + 1];
    struct stat info;
    if (stat(path, &info) != 0)
        return config_failed(GBT_ERR_IO, path, 0, "cannot open: ", strerror(errno));
    if (!S_ISREG(info.st_mode))
        return config_failed(GBT_ERR_IO, path, 0, "not a regular file", "");
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return config_failed(GBT_ERR_IO, path, 0, "cannot open: ", strerror(errno));
    const size_t length = fread(buffer, 1, sizeof buffer, file);
    const bool failed = ferror(file) != 0;
    fclose(file);
    if (failed)
        return config_failed(GBT_ERR_IO, path, 0, "read failed", "");
    if (length == sizeof buffer || memchr(buffer, 0, length) != NULL)
        return config_failed(GBT_ERR_FORMAT, path, 0,
                             "not a configuration file (wanted name = value lines, at most 1 MiB)", "");
    buffer[length] = '\0';
    *text = buffer;
    return GO_ON;
}

/** Strip blanks from both ends, in place. */
static char *trim(char *text)
{
    text += strspn(text, " \t\r");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r", text[length - 1]) != NULL)
        text[--length] = '\0';
    return text;
}

/** The option that a line names, or -1. Also finds --no-grow by its field `grow`, whose value is the inverse.
 */
static int find_configured(const option *options, int option_count, const char *name, bool *is_inverse)
{
    const size_t length = strlen(name);
    const int found = length > 1 ? options_find(options, option_count, name, length) : -1;
    for (int i = 0; i < option_count && found < 0; i++)
        if (options[i].kind == OPTION_FLAG_OFF && options[i].field != NULL &&
            options_is_field(&options[i], name, length)) {
            *is_inverse = true;
            return i;
        }
    return found;
}

int options_read_config(const char *path, const option *options, int option_count, bool *given)
{
    char *text;
    const int code = read_config_file(path, &text);
    if (code != GO_ON)
        return code;
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0)
        text += 3; /* the byte order mark that some editors write */
    for (int line = 1; text != NULL; line++) {
        char *next = strchr(text, '\n');
        if (next != NULL)
            *next++ = '\0';
        char *name = trim(text);
        text = next;
        if (name[0] == '\0' || name[0] == '#')
            continue;
        char *value = strchr(name, '=');
        if (value == NULL)
            return config_failed(GBT_ERR_FORMAT, path, line, ": not a name = value line", name);
        *value++ = '\0';
        name = trim(name);
        value = trim(value);
        bool is_inverse = false;
        const int i = find_configured(options, option_count, name, &is_inverse);
        if (i < 0 || !may_stand_here(&options[i]))
            return config_failed(GBT_ERR_FORMAT, path, line, ": unknown option", name);
        if (given[i])
            return config_failed(GBT_ERR_FORMAT, path, line, ": given twice", name);
        if (value[0] == '\0' && options[i].kind == OPTION_STRING)
            continue; /* an empty string: how RUN/config records an option that was not given */
        given[i] = true;
        char wanted[OPTIONS_WANTED_SIZE], what[2 * OPTIONS_WANTED_SIZE] = ": ";
        option row = options[i];
        if (is_inverse)
            row.kind = OPTION_FLAG;
        if (!options_read_value(&row, value, wanted, sizeof wanted)) {
            options_bad_value(&row, wanted, value, what + 2, sizeof what - 2);
            return config_failed(GBT_ERR_FORMAT, path, line, what, name);
        }
    }
    return GO_ON;
}

/* ---- the environment ---- */

bool options_in_environment(const option *o)
{
    return may_stand_here(o) && o->kind != OPTION_OPERAND && strncmp(o->name, "help", 4) != 0;
}

void options_variable(const char *command_name, const char *option_name, char *out, size_t size)
{
    snprintf(out, size, "GBTRACE_%s%s%s", command_name != NULL ? command_name : "",
             command_name != NULL ? "_" : "", option_name);
    for (char *c = out; *c != '\0'; c++)
        *c = *c == '-' ? '_' : (char)toupper((unsigned char)*c);
}

int options_read_environment(const command *self, const option *options, int option_count, bool *given)
{
    for (int i = 0; i < option_count; i++) {
        const option *o = &options[i];
        if (!options_in_environment(o))
            continue;
        char variable[128], wanted[OPTIONS_WANTED_SIZE], what[2 * OPTIONS_WANTED_SIZE];
        options_variable(self->name, o->name, variable, sizeof variable);
        const char *value = getenv(variable);
        if (value == NULL || value[0] == '\0') {
            options_variable(NULL, o->name, variable, sizeof variable);
            value = getenv(variable);
        }
        if (value == NULL || value[0] == '\0')
            continue;
        given[i] = true;
        if (!options_read_value(o, value, wanted, sizeof wanted)) {
            options_bad_value(o, wanted, value, what, sizeof what);
            return command_misused("%s: %s", variable, what);
        }
    }
    return GO_ON;
}
