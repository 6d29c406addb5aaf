/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe.h -- the manual page and completion scripts, generated from the tables that the parser uses.
 */
#ifndef GBT_CLI_DESCRIBE_H
#define GBT_CLI_DESCRIBE_H

#include <stdio.h>

#include "cli/options.h"

void describe_man(FILE *out); /* roff for man(7) */
void describe_bash(FILE *out);
void describe_zsh(FILE *out);
void describe_fish(FILE *out);

/* ---- for the files that generate them ---- */

typedef enum value_kind {
    VALUE_NONE,
    VALUE_ANY,             /* nothing to complete */
    VALUE_CHOICES,         /* one of its choices */
    VALUE_LIST,            /* several of its choices, separated by commas */
    VALUE_CHOICES_OR_FILE, /* one of its choices, or a path */
    VALUE_FILE,
    VALUE_FOLDER
} value_kind;

/** What kind of value an option takes. */
value_kind describe_value(const option *o);

/** The choices "a|b" as "a b". */
void describe_choices(FILE *out, const option *o);

/** `text` with a backslash before each character of `special`. */
void describe_escaped(FILE *out, const char *text, const char *special);

/** The accepted first operands of `c`, separated by blanks; nothing if anything is accepted. */
void describe_words(FILE *out, const command *c);

/** Every name of an option with its dashes, each preceded by `before`; with `all`, aliases too. */
void describe_names(FILE *out, const option *o, const char *before, bool all);

#endif
