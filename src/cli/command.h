/* SPDX-License-Identifier: Apache-2.0 */
/* cli/command.h -- what a subcommand is, and how it reports failure. */
#ifndef GBT_CLI_COMMAND_H
#define GBT_CLI_COMMAND_H

#include <stdbool.h>

#include "gbtrace/status.h"

struct option;
struct operands;

typedef struct command_word {
    const char *name;
    const char *help; /* one line, for --help and the manual page */
} command_word;

typedef struct command {
    const char *name;
    const char *summary; /* one line, for the list of commands */
    const char *usage;   /* operands and required options, for example "DATA -o FILE.ply" */
    const struct option *(*options)(int *count); /* its own options, a static table whose places hold the
                                                    defaults; NULL: none */
    int min_operands, max_operands;              /* number of arguments that are not options */
    int (*run)(const struct operands *given);    /* called after parsing; returns the exit code */
    bool shares_work;  /* run by all processes that mpirun started; else by the first alone */
    const char *alias; /* a second name, or NULL */
    const command_word *(*words)(void);   /* accepted values of the first operand, ended by a NULL name; NULL:
                                             anything, such as a path */
    const command_word *(*endings)(void); /* file name endings and their meanings, for the help, ended by a
                                             NULL name; NULL: none */
} command;

/** Report a failure as one `error: ...` line on stderr. Fields that the text names are replaced by their
    options, and control characters by ?. Returns the exit code of the status. */
int command_failed(gbt_status status, const gbt_error *err);

/** Report a wrong command line in the same way. Returns exit code 2. */
int command_misused(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** The name among `names` (`count` of them) most similar to a mistyped one; NULL if none is similar enough.
 */
const char *command_nearest(const char *typed, const char *const *names, int count);

/* One variable per subcommand; command_list.c lists them. */
extern const command command_demo, command_info, command_init, command_train, command_eval, command_render,
    command_report, command_make_scene, command_bench, command_check_grad, command_study, command_compare,
    command_compress, command_export, command_import, command_view, command_query, command_doctor,
    command_describe, command_pose;

/** All subcommands, in the order in which the help lists them. */
extern const command *const command_list[];
extern const int command_list_count;

#endif
