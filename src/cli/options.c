/* SPDX-License-Identifier: Apache-2.0 */
/* cli/options.c -- parse a command line into the variables that a table of options names.

   Sources, from weak to strong: --config FILE, GBTRACE_NAME, GBTRACE_COMMAND_NAME, the command line. The
   command line is read twice: first for the common options, which include --config, then in full. */
#include "cli/options.h"

#include <stdio.h>
#include <string.h>

#include "cli/progress.h"
#include "gbtrace/train.h"

enum { GO_ON = -1, TABLE_MAX = OPTIONS_MAX + OPTIONS_COMMON };

int options_threads;
size_t options_memory;

gbt_status options_memory_kept(size_t limit, gbt_error *err)
{
    const size_t peak = gbt_peak_memory();
    if (limit == 0 || peak <= limit)
        return GBT_OK;
    err->status = GBT_ERR_NO_MEMORY;
    snprintf(err->text, sizeof err->text,
             "memory: the limit of %zu MiB was exceeded: this took %zu MiB (the output is complete)",
             limit >> 20, (peak >> 20) + 1);
    return err->status;
}

/* ---- the table: a command's own rows, then the common ones ---- */

static const char progress_modes[] = "auto|json|none";
static const char *config_path, *first_operand;
static int wanted_progress;
static bool help_wanted;

void options_table(const command *self, option_table *t)
{
    const option common[OPTIONS_COMMON] = {
        {.name = "threads",
         .kind = OPTION_INT,
         .value = &options_threads,
         .min = 0,
         .max = 1024,
         .value_name = "T",
         .help = "number of threads; 0: all processors, within the container's limit"},
        {.name = "progress",
         .kind = OPTION_CHOICE,
         .value = &wanted_progress,
         .choices = progress_modes,
         .help = "progress on stderr, as text or JSON (docs/command-line.md)"},
        {.name = "quiet",
         .kind = OPTION_CHOICE,
         .value = &wanted_progress,
         .choices = progress_modes,
         .fixed = "none",
         .help = "the same as --progress none"},
        {.name = "config",
         .kind = OPTION_STRING,
         .value = &config_path,
         .value_name = "FILE",
         .help = "read name = value lines; environment and command line override them"},
        {.name = "help",
         .short_name = 'h',
         .kind = OPTION_FLAG,
         .value = &help_wanted,
         .help = "list the options that most people need"},
        {.name = "help-all",
         .kind = OPTION_FLAG,
         .value = &help_wanted,
         .help = "list all options, with their other names"},
    };
    int own = 0;
    const option *rows = self->options != NULL ? self->options(&own) : NULL;
    options_threads = 0;
    options_memory = 0;
    wanted_progress = PROGRESS_AUTO;
    config_path = NULL;
    first_operand = NULL;
    help_wanted = false;
    if (own > 0)
        memcpy(t->rows, rows, (size_t)own * sizeof *rows);
    memcpy(t->rows + own, common, sizeof common);
    t->own = own + 1;
    t->count = own + OPTIONS_COMMON;
    for (int i = 0; i < own; i++)
        if (t->rows[i].kind == OPTION_OPERAND)
            t->rows[i].value = &first_operand;
}

/* ---- arguments ---- */

static int unknown_option(const char *typed, const option_table *t)
{
    const char *names[TABLE_MAX];
    int count = 0;
    for (int i = 0; i < t->count; i++)
        if (t->rows[i].kind != OPTION_ELSEWHERE)
            names[count++] = t->rows[i].name;
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(typed + strspn(typed, "-"), "="),
             typed + strspn(typed, "-"));
    const char *nearest = command_nearest(name, names, count);
    if (nearest != NULL)
        return command_misused("%.100s: unknown option (did you mean --%s?)", typed, nearest);
    return command_misused("%.100s: unknown option (see --help)", typed);
}

/** One argument, split into its parts. */
typedef struct argument {
    int index;         /* row of the option; -1: not an option */
    const char *label; /* as the user typed it, without a value */
    const char *value; /* the text after =, or NULL */
} argument;

static int take_apart(char *text, const option_table *t, argument *out)
{
    static char label[128];
    *out = (argument){.index = -1, .label = label};
    if (text[0] != '-' || text[1] == '\0')
        return GO_ON;
    const size_t dashes = text[1] == '-' ? 2 : 1, length = strcspn(text + dashes, "=");
    if ((dashes == 2) == (length > 1)) /* one letter goes with one dash, longer names with two */
        out->index = options_find(t->rows, t->count, text + dashes, length);
    if (out->index < 0 || (dashes == 1 && text[2] != '\0'))
        return unknown_option(text, t);
    snprintf(label, sizeof label, "%.*s", (int)(dashes + length), text);
    out->value = text[dashes + length] == '=' ? text + dashes + length + 1 : NULL;
    return GO_ON;
}

/** The value of an option: the text after =, or else the next argument, which is consumed. An argument that
    begins with two dashes is not taken as a value, since most likely the value was forgotten. */
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
    char wanted[OPTIONS_WANTED_SIZE], what[2 * OPTIONS_WANTED_SIZE];
    if (o->kind == OPTION_ELSEWHERE)
        return command_misused("%s: not supported; %s", a->label, o->help);
    if (!options_takes_value(o)) {
        if (a->value != NULL)
            return command_misused("%s: takes no value (got %.80s)", a->label, a->value);
        options_read_value(o, o->fixed != NULL ? o->fixed : "true", wanted, sizeof wanted);
        return GO_ON;
    }
    const char *value = take_value(a, argc, argv, i);
    if (value == NULL || value[0] == '\0') {
        options_read_value(o, "", wanted, sizeof wanted);
        return command_misused("%s: value missing (wanted %s)", a->label, wanted);
    }
    if (options_read_value(o, value, wanted, sizeof wanted))
        return GO_ON;
    options_bad_value(o, wanted, value, what, sizeof what);
    return command_misused("%s: %s", a->label, what);
}

/**
 * Go through the arguments once.
 *
 * @param common [in]  true: apply only the common options, which decide how the rest is read; false: apply
 * all
 * @param given  [out] [t->count]
 */
static int walk(const option_table *t, bool common, int argc, char **argv, bool *given, operands *out)
{
    bool options_ended = false;
    for (int i = 0; i < argc; i++) {
        argument a = {.index = -1};
        if (!options_ended && strcmp(argv[i], "--") == 0) {
            options_ended = true;
            continue;
        }
        const int code = options_ended ? GO_ON : take_apart(argv[i], t, &a);
        if (code != GO_ON)
            return code;
        const option *o = &t->rows[a.index < 0 ? 0 : a.index];
        if (a.index >= 0 && o->kind == OPTION_ELSEWHERE) /* its value may look like an option */
            return apply(&a, o, argc, argv, &i);
        if (a.index >= 0 && common && a.index < t->own) {
            if (options_takes_value(o))
                take_value(&a, argc, argv, &i);
        } else if (a.index >= 0) {
            if (given[a.index])
                return command_misused("%s: given twice", a.label);
            for (int k = 0; k < t->count; k++)
                if (given[k] && o->value != NULL && t->rows[k].value == o->value)
                    return command_misused("%s: cannot be combined with --%s", a.label, t->rows[k].name);
            given[a.index] = true;
            const int applied = apply(&a, o, argc, argv, &i);
            if (applied != GO_ON)
                return applied;
        } else if (!common) {
            if (out->count == OPTIONS_MAX_OPERANDS)
                return command_misused("%.100s: one argument too many (at most %d)", argv[i],
                                       OPTIONS_MAX_OPERANDS);
            out->value[out->count++] = argv[i];
        }
    }
    return GO_ON;
}

/* ---- completeness ---- */

static void put_first(operands *out, const char *value)
{
    const int keep = out->count < OPTIONS_MAX_OPERANDS ? out->count : OPTIONS_MAX_OPERANDS - 1;
    memmove(out->value + 1, out->value, (size_t)keep * sizeof *out->value);
    out->value[0] = value;
    out->count = keep + 1;
}

static int check_words(const command *self, const char *typed)
{
    const command_word *words = self->words();
    const char *names[TABLE_MAX];
    char list[512] = "";
    int count = 0;
    for (size_t used = 0; words[count].name != NULL && count < TABLE_MAX; count++) {
        if (strcmp(words[count].name, typed) == 0)
            return GO_ON;
        const char *join = count == 0 ? "" : words[count + 1].name == NULL ? " or " : ", ";
        used += (size_t)snprintf(list + used, used < sizeof list ? sizeof list - used : 0, "%s%s", join,
                                 words[count].name);
        names[count] = words[count].name;
    }
    const char *nearest = command_nearest(typed, names, count);
    return command_misused("%s: \"%.60s\" (wanted %.400s%s%s%s)", self->name, typed, list,
                           nearest != NULL ? "; did you mean " : "", nearest != NULL ? nearest : "",
                           nearest != NULL ? "?" : "");
}

/* Refuse options on the command line that do not apply to the first operand. Files and variables may set
   them, because other calls use these too. */
static int check_belongs(const command *self, const option_table *t, const bool *typed, const operands *out)
{
    for (int i = 0; i < t->own && out->count > 0; i++) {
        const option *o = &t->rows[i];
        if (typed[i] && o->of != NULL && !options_has_word(o->of, out->value[0], strlen(out->value[0])))
            return command_misused("--%s: does not apply to %s %.60s (only to %s)", o->name, self->name,
                                   out->value[0], o->of);
    }
    return GO_ON;
}

static int check_complete(const command *self, const option_table *t, const bool *given, const operands *out)
{
    for (int i = 0; i < out->count; i++)
        if (out->value[i][0] == '\0')
            return command_misused("argument %d is empty (usage: gbtrace %s %s)", i + 1, self->name,
                                   self->usage);
    if (out->count < self->min_operands)
        return command_misused("argument missing (usage: gbtrace %s %s)", self->name, self->usage);
    if (out->count > self->max_operands)
        return command_misused("%.100s: one argument too many (usage: gbtrace %s %s)",
                               out->value[self->max_operands], self->name, self->usage);
    for (int i = 0; i < t->own; i++)
        if (t->rows[i].required && !given[i])
            return command_misused("--%s is missing (usage: gbtrace %s %s)", t->rows[i].name, self->name,
                                   self->usage);
    return self->words != NULL && out->count > 0 ? check_words(self, out->value[0]) : GO_ON;
}

/* ---- entry ---- */

/** The table of the running command, and which of its rows were on the command line. */
static option_table current;
static bool typed[TABLE_MAX];

static const char *help_option(int argc, char **argv)
{
    for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0 ||
            strcmp(argv[i], "--help-all") == 0)
            return argv[i];
    return NULL;
}

int options_parse(const command *self, int argc, char **argv, operands *out)
{
    option_table *t = &current;
    options_set_fields(t);
    bool before[TABLE_MAX] = {false};
    memset(typed, 0, sizeof typed);
    *out = (operands){.argc = argc, .argv = argv};
    options_table(self, t);
    const char *help = help_option(argc, argv);
    if (help != NULL) {
        options_print_help(self, t, strcmp(help, "--help-all") == 0);
        return 0;
    }
    int code = options_read_environment(self, t->rows + t->own, t->count - t->own, before + t->own);
    if (code == GO_ON)
        code = walk(t, true, argc, argv, typed, out);
    if (code == GO_ON)
        progress_start((progress_mode)wanted_progress, self->name);
    if (code == GO_ON && config_path != NULL)
        code = options_read_config(config_path, t->rows, t->own, before);
    const char *configured_operand = first_operand;
    first_operand = NULL;
    if (code == GO_ON)
        code = options_read_environment(self, t->rows, t->own, before);
    memset(typed, 0, sizeof typed);
    if (code == GO_ON)
        code = walk(t, false, argc, argv, typed, out);
    if (code != GO_ON)
        return code;
    if (first_operand != NULL)
        put_first(out, first_operand);
    else if (configured_operand != NULL && out->count < (self->min_operands > 0 ? self->min_operands : 1))
        put_first(out, configured_operand);
    for (int i = 0; i < t->count; i++)
        before[i] = before[i] || typed[i];
    code = check_complete(self, t, before, out);
    return code == GO_ON ? check_belongs(self, t, typed, out) : code;
}

bool options_typed(const void *place)
{
    for (int i = 0; i < current.count; i++)
        if (typed[i] && current.rows[i].value == place)
            return true;
    return false;
}
