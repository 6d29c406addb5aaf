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
    OPTION_CHOICE,   /* const char *, one of `choices` */
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
    const char *aliases; /* more names with blanks between, as other programs call it; one letter goes with
                            one dash */
    const char *fixed;   /* OPTION_STRING, OPTION_CHOICE: takes no value, and sets this one */
    bool required;
} option;

#define LPIPS_HELP "network weights (.safetensors), to compute LPIPS too (docs/metrics.md)"
#define THREADS_HELP "number of threads; 0: all processors, within the container's limit"

enum { OPTIONS_MAX = 64, OPTIONS_MAX_OPERANDS = 64, OPTIONS_COMMON = 4, OPTIONS_WANTED_SIZE = 256 };

typedef struct operands {
    int count;
    const char *value[OPTIONS_MAX_OPERANDS]; /* borrowed from argv */
} operands;

/**
 * Parse the arguments of a subcommand into the places that the table names.
 *
 * Takes `--name VALUE`, `--name=VALUE`, `-x VALUE`; `--` ends the options. Three options belong to every
 * command: `--help` prints the help to stdout, `--progress` says how to tell what is going on, `--config
 * FILE` reads `name = value` lines (# starts a comment; flags are true or false). The environment wins over
 * the file (GBTRACE_NAME, and over that GBTRACE_COMMAND_NAME), the command line over both. Strings stay valid
 * until the program ends.
 *
 * @param options       [in] at most OPTIONS_MAX rows
 * @param min_operands, max_operands [in] how many arguments without a dash are wanted; max at most
 *                      OPTIONS_MAX_OPERANDS
 * @return -1: go on; else the exit code to end with: 0 after --help, 2 for a bad command line or environment
 *         (3 and 4 for a bad --config file), after one line on stderr
 */
int options_parse(const command *self, const option *options, int option_count, int min_operands,
                  int max_operands, int argc, char **argv, operands *out);

/** Shown the rows of a command, the common ones last. */
typedef void options_visitor(const command *self, const option *options, int option_count, void *context);

/** Run `c` only as far as its options_parse(), which calls `visit` in place of parsing: so a table stands in
    one place alone. */
void options_visit(const command *c, options_visitor *visit, void *context);

/* ---- for the files that make the above ---- */

/** Text to the option's place. On failure false, and `wanted` says what would have been right. */
bool options_read_value(const option *o, const char *text, char *wanted, size_t wanted_size);

/** "bad value (wanted ..., got ...; did you mean ...?)" */
void options_bad_value(const option *o, const char *wanted, const char *text, char *out, size_t size);

/** The row of a name of `length` bytes without dashes, or -1. One letter: short names and aliases of one
    letter. */
int options_find(const option *options, int option_count, const char *name, size_t length);

bool options_takes_value(const option *o);

/** What stands for its value in a list: choices, a name, or "". */
const char *options_value_name(const option *o);

/** "(default 2)", "(needed)" or "", and the other names. */
void options_notes(const option *o, char *out, size_t size);

void options_print_help(const command *self, const option *options, int option_count);

/** Values from a `name = value` file, or from the environment, for rows that may come from there. `given`
    [option_count] is set for what was. -1 or an exit code. */
int options_read_config(const char *path, const option *options, int option_count, bool *given);
int options_read_environment(const command *self, const option *options, int option_count, bool *given);

/** Whether a variable may set this row. */
bool options_in_environment(const option *o);

/** GBTRACE_NAME, or with a command GBTRACE_COMMAND_NAME. */
void options_variable(const char *command_name, const char *option_name, char *out, size_t size);

#endif
