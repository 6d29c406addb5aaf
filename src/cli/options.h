/* SPDX-License-Identifier: Apache-2.0 */
/* cli/options.h -- options by table: a row gives the type, range, variable and help of one option. The
   command line, configuration files, the environment, --help, the manual page and the completion scripts all
   read the same rows. */
#ifndef GBT_CLI_OPTIONS_H
#define GBT_CLI_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "cli/command.h"

typedef enum option_kind {
    OPTION_FLAG,     /* bool: set to true */
    OPTION_FLAG_OFF, /* bool: set to false; for options named no-... */
    OPTION_INT,      /* int, [min, max] */
    OPTION_UINT64,   /* uint64_t, [min, max] with max <= 2^53; both 0: any value */
    OPTION_FLOAT,    /* float, [min, max], finite */
    OPTION_DOUBLE,   /* double, [min, max], finite */
    OPTION_STRING,   /* const char *, not empty */
    OPTION_CHOICE,   /* int or an enum: the index of the value in `choices` */
    OPTION_DURATION, /* double, seconds, [min, max]: 90, 90s, 10m, 10min, 1h, 1h30m */
    OPTION_SIZE,     /* size_t, bytes, [min, max]: 512M, 6G (powers of 1024) */
    OPTION_OPERAND,  /* another name for the first operand, as other programs have it; no `value` */
    OPTION_ELSEWHERE /* an option of other programs that we lack: an error, and `help` says what to use
                        instead. Not listed */
} option_kind;

typedef struct option {
    const char *name; /* without dashes; users may write _ for - */
    char short_name;  /* one-letter name, or 0 */
    option_kind kind;
    void *value;            /* of the kind's type; holds the default, and after parsing the result */
    double min, max;        /* inclusive */
    const char *choices;    /* OPTION_CHOICE: "a|b|c". OPTION_STRING: values offered by completion; others are
                               accepted too */
    bool list;              /* OPTION_STRING: several `choices`, separated by commas */
    const char *value_name; /* placeholder in help and messages: "N", "FILE"; NULL for flags and choices */
    const char *help;
    const char *field;   /* the library's name for it, in its errors and in configurations, if different; for
                            OPTION_FLAG_OFF the setting that it turns off */
    const char *aliases; /* further names, separated by blanks, as in other programs; one-letter ones go with
                            one dash */
    const char *fixed;   /* OPTION_STRING, OPTION_CHOICE: the row takes no value and sets this one */
    const char *of; /* first operands to which the row applies, separated by blanks; with others it is refused
                       on the command line. NULL: all */
    bool required;
    bool rare; /* shown by --help-all only */
} option;

#define LPIPS_HELP "network weights (.safetensors), to compute LPIPS too (docs/metrics.md)"

extern int options_threads; /* --threads, a common option; passed on to the library */

/** --memory, for commands whose data may be larger than memory; main() passes it to gbt_set_memory(). */
#define MEMORY_OPTION                                                                                        \
    {                                                                                                        \
        .name = "memory", .kind = OPTION_SIZE, .value = &options_memory, .min = 0, .max = 0x1p60,            \
        .value_name = "BYTES",                                                                               \
        .help = "upper limit for memory, such as 1G (docs/memory.md); does not change the result; 0: no "    \
                "limit",                                                                                     \
        .rare = true                                                                                         \
    }
extern size_t options_memory;

/** GBT_OK if the peak memory of the process stayed within `limit` bytes, else an error with the excess; 0: no
    limit. */
gbt_status options_memory_kept(size_t limit, gbt_error *err);

/* Rows that several commands share; each is given the variable to set. */
#define DATA_OPTION(place, text)                                                                             \
    {                                                                                                        \
        .name = "data", .kind = OPTION_STRING, .value = (place), .value_name = "DATA", .help = (text),       \
        .aliases = "s source-path"                                                                           \
    }
#define JSON_OPTION(place, text)                                                                             \
    {                                                                                                        \
        .name = "json", .kind = OPTION_STRING, .value = (place), .value_name = "FILE", .help = (text)        \
    }
#define PRESET_OPTION(place)                                                                                 \
    {                                                                                                        \
        .name = "preset", .kind = OPTION_CHOICE, .value = (place), .choices = GBT_PRESET_NAMES,              \
        .help = "cut-off preset (docs/accuracy.md); scores use default"                                      \
    }
#define DOWNSCALE_OPTION(place)                                                                              \
    {                                                                                                        \
        .name = "downscale", .short_name = 'd', .kind = OPTION_DOUBLE, .value = (place), .min = 0,           \
        .max = 64, .value_name = "F",                                                                        \
        .help = "divide the photos' width and height by this; 0: as in training", .aliases = "r resolution"  \
    }
/* The operand RUN under the name that other programs give it. `more`: further such names, or NULL. */
#define RUN_OPTION(more)                                                                                     \
    {                                                                                                        \
        .name = "model-path", .short_name = 'm', .kind = OPTION_OPERAND, .value_name = "RUN",                \
        .help = "the same as RUN", .aliases = (more), .rare = true                                           \
    }

enum {
    OPTIONS_MAX = 80,
    OPTIONS_MAX_OPERANDS = 64,
    OPTIONS_COMMON = 6,
    OPTIONS_WANTED_SIZE = 256,
    HELP_TEXT_SIZE = 1024
};

typedef struct operands {
    int count;
    const char *value[OPTIONS_MAX_OPERANDS]; /* borrowed from argv */
    int argc;                                /* all arguments as typed, after the command's name */
    char **argv;
} operands;

/** The options of a command: its own rows first, then the common ones. */
typedef struct option_table {
    option rows[OPTIONS_MAX + OPTIONS_COMMON];
    int own, count; /* own: number of rows that configuration files may set, its own ones and --threads;
                       count: all rows */
} option_table;

void options_table(const command *self, option_table *out);

/**
 * Parse the arguments of a subcommand into the variables that its table names.
 *
 * Accepts `--name VALUE`, `--name=VALUE`, `-x VALUE`; `--` ends the options. Six options are common to all
 * commands: `--help` and `--help-all` print the help to stdout, `--threads` sets their number, `--progress`
 * and
 * `--quiet` choose how progress is shown, `--config FILE` reads lines `name = value` (a line that starts with
 * # is a comment; flags are true or false). The environment overrides the file (GBTRACE_NAME, and over that
 * GBTRACE_COMMAND_NAME), and the command line overrides both. Strings stay valid until the program ends.
 *
 * @return -1: continue; else the exit code: 0 after --help, 2 for a bad command line or environment (3 and 4
 *         for a bad --config file), after one line on stderr
 */
int options_parse(const command *self, int argc, char **argv, operands *out);

/** Whether the option with this variable was on the last command line parsed, not only in a file or variable.
 */
bool options_typed(const void *place);

/**
 * Replace the field names at the start of the library's messages by option names: "init_count: ..." becomes
 * "--init-count: ...". In a list "a, b: ..." every field must be an option of the last command parsed; any
 * other text is copied unchanged.
 */
void options_name_fields(const char *text, char *out, size_t size);

/** Replace quoted field names anywhere in a message: "go on by `resume`" becomes "go on by --resume". Other
    quoted words stay. */
void options_name_quoted(const char *text, char *out, size_t size);

/** From now on look fields up in `t`, which the caller keeps. */
void options_set_fields(const option_table *t);

/* ---- for the files that implement the above ---- */

/** Parse text into the option's variable. On failure returns false, and `wanted` describes valid values. */
bool options_read_value(const option *o, const char *text, char *wanted, size_t wanted_size);

/** "bad value (wanted ..., got ...; did you mean ...?)" */
void options_bad_value(const option *o, const char *wanted, const char *text, char *out, size_t size);

/** The row with a name (`length` bytes, without dashes), or -1. A single letter matches short names and
    one-letter aliases. */
int options_find(const option *options, int option_count, const char *name, size_t length);

/** Whether `typed`, in which _ may stand for -, is one of the words of a blank-separated list (NULL: empty).
 */
bool options_has_word(const char *words, const char *typed, size_t length);

/** Whether this is the library's name for the option. */
bool options_is_field(const option *o, const char *name, size_t length);

bool options_takes_value(const option *o);

/** The placeholder for its value in a list of options: the choices, a name, or "". */
const char *options_value_name(const option *o);

/** The help text, preceded by the operands to which the row applies: "speed, rate: ...". Returns `out`. */
const char *options_help_text(const option *o, char *out, size_t size);

/** "(default 2)", "(needed)" or ""; with `names` also the alternative names. */
void options_notes(const option *o, bool names, char *out, size_t size);

/** @param all [in] include rare options and alternative names */
void options_print_help(const command *self, const option_table *t, bool all);

/** Read values from a file of lines `name = value`, or from the environment, for the rows that allow it. Sets
    given[i] for each one found; `given` is [option_count]. Returns -1 or an exit code. */
int options_read_config(const char *path, const option *options, int option_count, bool *given);
int options_read_environment(const command *self, const option *options, int option_count, bool *given);

/** Whether an environment variable may set this option. */
bool options_in_environment(const option *o);

/** The name of the variable: GBTRACE_NAME, or with a command GBTRACE_COMMAND_NAME. */
void options_variable(const char *command_name, const char *option_name, char *out, size_t size);

#endif
