/* SPDX-License-Identifier: Apache-2.0 */
/* cli/options.h -- command lines by table: a row per option says its type, range, place and help.

   The same rows are read by the command line, configuration files, the environment, --help, the manual page
   and the completion scripts. */
#ifndef GBT_CLI_OPTIONS_H
#define GBT_CLI_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "cli/command.h"

typedef enum option_kind {
    OPTION_FLAG,     /* bool: set to true */
    OPTION_FLAG_OFF, /* bool: set to false; for options named no-... */
    OPTION_INT,      /* int, [min, max] */
    OPTION_UINT64,   /* uint64_t, [min, max] with max at most 2^53, or both 0: any */
    OPTION_FLOAT,    /* float, [min, max], finite */
    OPTION_DOUBLE,   /* double, [min, max], finite */
    OPTION_STRING,   /* const char *, not empty */
    OPTION_CHOICE,   /* int or an enum: the place of the value among `choices` */
    OPTION_DURATION, /* double, seconds, [min, max]: 90, 90s, 10m, 10min, 1h, 1h30m */
    OPTION_SIZE,     /* size_t, bytes, [min, max]: 512M, 6G (powers of 1024) */
    OPTION_OPERAND,  /* the first operand by a name that other programs gave it; no `value` */
    OPTION_ELSEWHERE /* other programs have it, we do not: an error, for which `help` says what to use. In no
                        list */
} option_kind;

typedef struct option {
    const char *name; /* without the dashes; _ is taken for - */
    char short_name;  /* a second name of one letter, or 0 */
    option_kind kind;
    void *value;         /* of the kind's type; holds the default before, and the result after */
    double min, max;     /* inclusive */
    const char *choices; /* OPTION_CHOICE: "a|b|c". OPTION_STRING: values that completion offers; others are
                            taken too */
    bool list;           /* OPTION_STRING: several of `choices` may stand with commas between */
    const char *value_name; /* for help and messages: "N", "FILE"; NULL for flags and choices */
    const char *help;
    const char *field;   /* what the library calls it, in its errors and in configurations, where that is
                            another name; of OPTION_FLAG_OFF what it turns off */
    const char *aliases; /* more names with blanks between, as other programs call it; one letter goes with
                            one dash */
    const char *fixed;   /* OPTION_STRING, OPTION_CHOICE: takes no value, and sets this one */
    const char *of;      /* what the first operand is where the row belongs, words with blanks between; NULL:
                            anything. Else it is refused on the command line */
    bool required;
    bool rare; /* in --help-all alone */
} option;

#define LPIPS_HELP "network weights (.safetensors), to compute LPIPS too (docs/metrics.md)"

extern int options_threads; /* of --threads, which every command has; it is given to the library */

/** The row of a command whose data may be larger than memory; it is kept for it as for gbt_set_memory(). */
#define MEMORY_OPTION                                                                                        \
    {                                                                                                        \
        .name = "memory", .kind = OPTION_SIZE, .value = &options_memory, .min = 0, .max = 0x1p60,            \
        .value_name = "BYTES",                                                                               \
        .help = "memory to take at most, such as 1G (docs/memory.md); does not change the result; 0: no "    \
                "limit",                                                                                     \
        .rare = true                                                                                         \
    }
extern size_t options_memory;

/** GBT_OK, or a line that says how much more than so many bytes the process has taken; 0: no limit. */
gbt_status options_memory_kept(size_t limit, gbt_error *err);

/* Rows that several commands have; each says where the value goes. */
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
/* RUN by the name that other programs give it, and more of their names or NULL. */
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
    int argc;                                /* everything as it was typed, after the command's name */
    char **argv;
} operands;

/** The rows of a command, the common ones last. */
typedef struct option_table {
    option rows[OPTIONS_MAX + OPTIONS_COMMON];
    int own, count; /* own ones and --threads, which configuration files may set; all */
} option_table;

void options_table(const command *self, option_table *out);

/**
 * Parse the arguments of a subcommand into the places that its table names.
 *
 * Takes `--name VALUE`, `--name=VALUE`, `-x VALUE`; `--` ends the options. Six options belong to every
 * command: `--help` and `--help-all` print the help to stdout, `--threads` says how many, `--progress` and
 * `--quiet` say how to tell what is going on, `--config FILE` reads `name = value` lines (lines with # at
 * their start are comments; flags are true or false). The environment wins over the file (GBTRACE_NAME, and
 * over that GBTRACE_COMMAND_NAME), the command line over both. Strings stay valid until the program ends.
 *
 * @return -1: go on; else the exit code to end with: 0 after --help, 2 for a bad command line or environment
 *         (3 and 4 for a bad --config file), after one line on stderr
 */
int options_parse(const command *self, int argc, char **argv, operands *out);

/** Whether the option of this place was on the command line that was parsed last, not only in a file or the
    environment. */
bool options_typed(const void *place);

/**
 * What the library says of a field, "init_count: ...", as what the user typed: "--init-count: ...". Every
 * field of a list "a, b: ..." must be an option of the command that was parsed last; any other text stays as
 * it is.
 */
void options_name_fields(const char *text, char *out, size_t size);

/** A field that the library quotes anywhere, "go on by `resume`", as its option: "go on by --resume". Other
    quoted words stay. */
void options_name_quoted(const char *text, char *out, size_t size);

/** From now on the fields are those of `t`, which stays the caller's. */
void options_set_fields(const option_table *t);

/* ---- for the files that make the above ---- */

/** Text to the option's place. On failure false, and `wanted` says what would have been right. */
bool options_read_value(const option *o, const char *text, char *wanted, size_t wanted_size);

/** "bad value (wanted ..., got ...; did you mean ...?)" */
void options_bad_value(const option *o, const char *wanted, const char *text, char *out, size_t size);

/** The row of a name of `length` bytes without dashes, or -1. One letter: short names and aliases of one
    letter. */
int options_find(const option *options, int option_count, const char *name, size_t length);

/** Whether what was typed is among words with blanks between (NULL: none), where _ may stand for -. */
bool options_has_word(const char *words, const char *typed, size_t length);

/** Whether the library calls a row by this name. */
bool options_is_field(const option *o, const char *name, size_t length);

bool options_takes_value(const option *o);

/** What stands for its value in a list: choices, a name, or "". */
const char *options_value_name(const option *o);

/** The help text; before it the words that the row belongs to: "speed, rate: ...". Returns `out`. */
const char *options_help_text(const option *o, char *out, size_t size);

/** "(default 2)", "(needed)" or "", and `names`: the other names. */
void options_notes(const option *o, bool names, char *out, size_t size);

/** @param all [in] rare rows too, and other names */
void options_print_help(const command *self, const option_table *t, bool all);

/** Values from a `name = value` file, or from the environment, for rows that may come from there. `given`
    [option_count] is set for what was. -1 or an exit code. */
int options_read_config(const char *path, const option *options, int option_count, bool *given);
int options_read_environment(const command *self, const option *options, int option_count, bool *given);

/** Whether a variable may set this row. */
bool options_in_environment(const option *o);

/** GBTRACE_NAME, or with a command GBTRACE_COMMAND_NAME. */
void options_variable(const char *command_name, const char *option_name, char *out, size_t size);

#endif
