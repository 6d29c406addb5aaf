/* cli/options.c -- command line and configuration file to the places that a table of options names; help from the same table. */
#include "cli/options.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { GO_ON = -1, WANTED_SIZE = 256, CONFIG_LIMIT = 1 << 20 };

/* ---- help --------------------------------------------------------------------------------------------------------------------- */

static void print_default(const option *o)
{
    switch (o->kind) {
    case OPTION_FLAG:
    case OPTION_FLAG_OFF: return;
    case OPTION_INT: printf(" (default %d)", *(const int *)o->value); return;
    case OPTION_UINT64: printf(" (default %llu)", (unsigned long long)*(const uint64_t *)o->value); return;
    case OPTION_FLOAT: printf(" (default %g)", (double)*(const float *)o->value); return;
    case OPTION_DOUBLE: printf(" (default %g)", *(const double *)o->value); return;
    case OPTION_DURATION: {
        const double seconds = *(const double *)o->value;
        if (seconds >= 60 && seconds / 60 == (double)(long)(seconds / 60))
            printf(" (default %gm)", seconds / 60);
        else
            printf(" (default %gs)", seconds);
        return;
    }
    case OPTION_SIZE: {
        double size = (double)*(const size_t *)o->value;
        int unit = 0;
        while (unit < 4 && size >= 1024)
            size /= 1024, unit++;
        if (size > 0 && size <= 0x1p30) /* 0: no default; beyond: no limit */
            printf(" (default %g%.*s)", size, unit > 0, unit > 0 ? &"KMGT"[unit - 1] : "");
        return;
    }
    case OPTION_STRING:
    case OPTION_CHOICE: {
        const char *text = *(const char *const *)o->value;
        if (text != NULL && text[0] != '\0')
            printf(" (default %s)", text);
        return;
    }
    }
}

static void print_help_row(char short_name, const char *name, const char *value_name)
{
    char left[128], short_text[8] = "    ";
    if (short_name != 0)
        snprintf(short_text, sizeof short_text, "-%c, ", short_name);
    const int used = snprintf(left, sizeof left, "  %s--%s%s%s", short_text, name, value_name[0] != '\0' ? " " : "", value_name);
    printf(used > 30 ? "%s\n%32s" : "%-32s%s", left, "");
}

static void print_help(const command *self, const option *options, int option_count)
{
    printf("usage: gbtrace %s %s%s[options]\n\n%s\n\noptions:\n", self->name, self->usage, self->usage[0] != '\0' ? " " : "", self->summary);
    for (int i = 0; i < option_count; i++) {
        const option *o = &options[i];
        const bool is_flag = o->kind == OPTION_FLAG || o->kind == OPTION_FLAG_OFF;
        print_help_row(o->short_name, o->name, is_flag ? "" : o->kind == OPTION_CHOICE ? o->choices : o->value_name);
        fputs(o->help, stdout);
        if (o->required)
            fputs(" (needed)", stdout);
        else
            print_default(o);
        putchar('\n');
    }
    print_help_row(0, "config", "FILE");
    puts("read name = value lines first, then the command line");
    print_help_row('h', "help", "");
    puts("print this");
}

/* ---- the configuration file ---------------------------------------------------------------------------------------------------- */

static int find_option(const option *options, int option_count, const char *name, size_t length)
{
    for (int i = 0; i < option_count; i++)
        if (strlen(options[i].name) == length && strncmp(options[i].name, name, length) == 0)
            return i;
    return -1;
}

static int config_failed(gbt_status status, const char *path, int line, const char *what, const char *detail)
{
    gbt_error err = {.status = status};
    if (line > 0)
        snprintf(err.text, sizeof err.text, "%.150s:%d: %.60s%.250s", path, line, detail, what);
    else
        snprintf(err.text, sizeof err.text, "%.200s: %.100s%.100s", path, what, detail);
    return command_failed(status, &err);
}

/** The file's text, zero-terminated; kept to the end of the program, because options point into it. */
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
        return config_failed(GBT_ERR_FORMAT, path, 0, "not a configuration file (wanted name = value lines, at most 1 MiB)", "");
    buffer[length] = '\0';
    *text = buffer;
    return GO_ON;
}

/** Blanks off both ends, in place. */
static char *trim(char *text)
{
    text += strspn(text, " \t\r");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r", text[length - 1]) != NULL)
        text[--length] = '\0';
    return text;
}

static int read_config(const char *path, const option *options, int option_count, bool *given)
{
    char *text;
    const int code = read_config_file(path, &text);
    if (code != GO_ON)
        return code;
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
        name = trim(name), value = trim(value);
        const int i = find_option(options, option_count, name, strlen(name));
        if (i < 0)
            return config_failed(GBT_ERR_FORMAT, path, line, ": unknown option", name);
        if (given[i])
            return config_failed(GBT_ERR_FORMAT, path, line, ": given twice", name);
        given[i] = true;
        char wanted[WANTED_SIZE], what[WANTED_SIZE + 256];
        if (!options_read_value(&options[i], value, wanted, sizeof wanted)) {
            snprintf(what, sizeof what, ": bad value (wanted %s, got %.80s)", wanted, value[0] != '\0' ? value : "nothing");
            return config_failed(GBT_ERR_FORMAT, path, line, what, name);
        }
    }
    return GO_ON;
}

/* ---- the command line ---------------------------------------------------------------------------------------------------------- */

static int unknown_option(const char *typed, const option *options, int option_count)
{
    const char *names[OPTIONS_MAX + 2];
    int count = 0;
    for (; count < option_count; count++)
        names[count] = options[count].name;
    names[count++] = "config";
    names[count++] = "help";
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(typed + strspn(typed, "-"), "="), typed + strspn(typed, "-"));
    const char *nearest = command_nearest(name, names, count);
    if (nearest != NULL)
        return command_misused("%.100s: unknown option (did you mean --%s?)", typed, nearest);
    return command_misused("%.100s: unknown option (see --help)", typed);
}

/** One argument taken apart. */
typedef struct argument {
    int index;         /* of the option; option_count: --config; -1: not an option */
    const char *label; /* as the user wrote it, without a value */
    const char *value; /* behind =, or NULL */
} argument;

static int take_apart(char *text, const option *options, int option_count, argument *out)
{
    static char label[128];
    *out = (argument){.index = -1, .label = label};
    if (text[0] != '-' || text[1] == '\0')
        return GO_ON;
    if (text[1] == '-') {
        const size_t length = strcspn(text + 2, "=");
        snprintf(label, sizeof label, "%.*s", (int)length + 2, text);
        out->value = text[2 + length] == '=' ? text + 3 + length : NULL;
        out->index = find_option(options, option_count, text + 2, length);
        if (out->index < 0 && length == 6 && strncmp(text + 2, "config", 6) == 0)
            out->index = option_count;
    } else if (text[2] == '\0') {
        snprintf(label, sizeof label, "%s", text);
        for (int i = 0; i < option_count; i++)
            if (options[i].short_name == text[1])
                out->index = i;
    }
    return out->index < 0 ? unknown_option(text, options, option_count) : GO_ON;
}

/** The value of an argument: behind =, or the next argument, which it then takes. Two dashes do not start a value: one was forgotten. */
static const char *take_value(const argument *a, int argc, char **argv, int *i)
{
    if (a->value != NULL)
        return a->value;
    if (*i + 1 >= argc || strncmp(argv[*i + 1], "--", 2) == 0)
        return NULL;
    return argv[++*i];
}

static int apply(const argument *a, const option *o, int argc, char **argv, int *i)
{
    if (o->kind == OPTION_FLAG || o->kind == OPTION_FLAG_OFF) {
        if (a->value != NULL)
            return command_misused("%s: takes no value (got %.80s)", a->label, a->value);
        *(bool *)o->value = o->kind == OPTION_FLAG;
        return GO_ON;
    }
    const char *value = take_value(a, argc, argv, i);
    char wanted[WANTED_SIZE];
    if (value == NULL || value[0] == '\0') {
        options_read_value(o, "", wanted, sizeof wanted);
        return command_misused("%s: value missing (wanted %s)", a->label, wanted);
    }
    if (!options_read_value(o, value, wanted, sizeof wanted))
        return command_misused("%s: bad value (wanted %s, got %.80s)", a->label, wanted, value);
    return GO_ON;
}

/** Find --config before anything else, so that the command line can override it. */
static int apply_config(const option *options, int option_count, int argc, char **argv, bool *given)
{
    const char *path = NULL;
    for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++) {
        argument a;
        const int code = take_apart(argv[i], options, option_count, &a);
        if (code != GO_ON)
            return code;
        if (a.index < 0)
            continue;
        if (a.index < option_count) {
            if (options[a.index].kind != OPTION_FLAG && options[a.index].kind != OPTION_FLAG_OFF)
                take_value(&a, argc, argv, &i);
            continue;
        }
        if (path != NULL)
            return command_misused("--config: given twice");
        path = take_value(&a, argc, argv, &i);
        if (path == NULL || path[0] == '\0')
            return command_misused("--config: value missing (wanted a file)");
    }
    return path != NULL ? read_config(path, options, option_count, given) : GO_ON;
}

static bool wants_help(int argc, char **argv)
{
    for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0)
            return true;
    return false;
}

static int check_complete(const command *self, const option *options, int option_count, const bool *given, int min_operands, int max_operands,
                          const operands *out)
{
    for (int i = 0; i < out->count; i++)
        if (out->value[i][0] == '\0')
            return command_misused("argument %d is empty (usage: gbtrace %s %s)", i + 1, self->name, self->usage);
    if (out->count < min_operands)
        return command_misused("argument missing (usage: gbtrace %s %s)", self->name, self->usage);
    if (out->count > max_operands)
        return command_misused("%.100s: one argument too many (usage: gbtrace %s %s)", out->value[max_operands], self->name, self->usage);
    for (int i = 0; i < option_count; i++)
        if (options[i].required && !given[i])
            return command_misused("--%s is missing (usage: gbtrace %s %s)", options[i].name, self->name, self->usage);
    return GO_ON;
}

int options_parse(const command *self, const option *options, int option_count, int min_operands, int max_operands, int argc, char **argv,
                  operands *out)
{
    bool in_config[OPTIONS_MAX] = {false}, given[OPTIONS_MAX] = {false};
    out->count = 0;
    if (wants_help(argc, argv)) {
        print_help(self, options, option_count);
        return 0;
    }
    int code = apply_config(options, option_count, argc, argv, in_config);
    bool options_ended = false;
    for (int i = 0; i < argc && code == GO_ON; i++) {
        argument a = {.index = -1};
        if (!options_ended && strcmp(argv[i], "--") == 0) {
            options_ended = true;
            continue;
        }
        if (!options_ended)
            code = take_apart(argv[i], options, option_count, &a);
        if (code != GO_ON)
            break;
        if (a.index < 0) {
            if (out->count == OPTIONS_MAX_OPERANDS)
                return command_misused("%.100s: one argument too many (at most %d)", argv[i], OPTIONS_MAX_OPERANDS);
            out->value[out->count++] = argv[i];
        } else if (a.index == option_count) {
            take_value(&a, argc, argv, &i); /* already read */
        } else if (given[a.index]) {
            code = command_misused("%s: given twice", a.label);
        } else {
            given[a.index] = true;
            code = apply(&a, &options[a.index], argc, argv, &i);
        }
    }
    if (code != GO_ON)
        return code;
    for (int i = 0; i < option_count; i++)
        given[i] = given[i] || in_config[i];
    return check_complete(self, options, option_count, given, min_operands, max_operands, out);
}
