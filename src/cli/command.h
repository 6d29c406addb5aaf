/* SPDX-License-Identifier: Apache-2.0 */
/* cli/command.h -- what a subcommand is, and how it ends. */
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
    const char *usage;   /* operands and the options that it needs, for example "DATA -o FILE.ply" */
    const struct option *(*options)(int *count); /* its rows, static: their places hold the defaults. NULL:
                                                    it has none of its own */
    int min_operands, max_operands;              /* how many arguments without a dash */
    int (*run)(const struct operands *given);    /* after the command line was read; returns the exit code */
    bool shares_work;                     /* all processes that mpirun started run it; else the first one
                                             alone */
    const char *alias;                    /* a second name, or NULL */
    const command_word *(*words)(void);   /* what the first operand may be, up to a name of NULL; NULL:
                                             anything, such as a path */
    const command_word *(*endings)(void); /* what file names end in, and what that means, up to a name of
                                             NULL; NULL: nothing to tell */
} command;

/** One `error: ...` line on stderr for a failure (control characters become ?), with options for the fields
   that it names; returns the exit code that belongs to the status. */
int command_failed(gbt_status status, const gbt_error *err);

/** The same for the caller's own text: usage, exit code 2. */
int command_misused(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** The name of `names` (count of them) that is nearest to a mistyped one, or NULL if none is near. */
const char *command_nearest(const char *typed, const char *const *names, int count);

/* One line per subcommand; command_list.c lists them. */
extern const command command_demo, command_info, command_init, command_train, command_eval, command_render,
    command_report, command_make_scene, command_bench, command_check_grad, command_study, command_compare,
    command_compress, command_export, command_import, command_view, command_query, command_doctor,
    command_describe, command_pose;

/** All of them, in the order of the help. */
extern const command *const command_list[];
extern const int command_list_count;

#endif
