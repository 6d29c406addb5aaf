/* cli/options.h -- command lines by table: a row per option says its type, range, place and help. */
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
    OPTION_DURATION, /* double, seconds, [min, max]: 90, 90s, 10m, 1h, 1h30m */
    OPTION_SIZE      /* size_t, bytes, [min, max]: 512M, 6G (powers of 1024) */
} option_kind;

typedef struct option {
    const char *name;       /* without the dashes */
    char short_name;        /* a second name of one letter, or 0 */
    option_kind kind;
    void *value;            /* of the kind's type; holds the default before, and the result after */
    double min, max;        /* inclusive */
    const char *choices;    /* OPTION_CHOICE: "a|b|c" */
    const char *value_name; /* for help and messages: "N", "FILE"; NULL for flags and choices */
    const char *help;
    bool required;
} option;

enum { OPTIONS_MAX = 64, OPTIONS_MAX_OPERANDS = 64 };

typedef struct operands {
    int count;
    const char *value[OPTIONS_MAX_OPERANDS]; /* borrowed from argv */
} operands;

/**
 * Parse the arguments of a subcommand into the places that the table names.
 *
 * Takes `--name VALUE`, `--name=VALUE`, `-x VALUE`; `--` ends the options; `--help` prints the help, made from the table, to stdout.
 * `--config FILE` reads `name = value` lines first (# starts a comment; flags are true or false); the command line overrides them.
 * Strings stay valid until the program ends.
 *
 * @param min_operands, max_operands [in] how many arguments without a dash are wanted; max at most OPTIONS_MAX_OPERANDS
 * @return -1: go on; else the exit code to end with: 0 after --help, 2 for a bad command line (3 and 4 for a bad --config file), after one
 *         line on stderr
 */
int options_parse(const command *self, const option *options, int option_count, int min_operands, int max_operands, int argc, char **argv,
                  operands *out);

/** Text to the option's place. On failure false, and `wanted` says what would have been right. */
bool options_read_value(const option *o, const char *text, char *wanted, size_t wanted_size);

#endif
