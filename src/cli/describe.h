/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe.h -- the command line in other forms, all from the tables that parse it. */
#ifndef GBT_CLI_DESCRIBE_H
#define GBT_CLI_DESCRIBE_H

#include <stdio.h>

#include "cli/options.h"

void describe_man(FILE *out); /* roff for man(7) */
void describe_bash(FILE *out);
void describe_zsh(FILE *out);
void describe_fish(FILE *out);

/* ---- for the files that make the above ---- */

typedef enum value_kind {
    VALUE_NONE,
    VALUE_ANY,             /* cannot be guessed */
    VALUE_CHOICES,         /* one of its choices */
    VALUE_LIST,            /* some of its choices, with commas between */
    VALUE_CHOICES_OR_FILE, /* one of its choices, or a path */
    VALUE_FILE,
    VALUE_FOLDER
} value_kind;

/** What may stand behind an option. */
value_kind describe_value(const option *o);

/** "a|b" as "a b". */
void describe_choices(FILE *out, const option *o);

/** `text` with a backslash before every byte of `special`. */
void describe_escaped(FILE *out, const char *text, const char *special);

/** What the first operand of `c` may be, with blanks between; nothing where that is anything. */
void describe_words(FILE *out, const command *c);

/** Every name of a row with its dashes, after `before` each: aliases too when `all`. */
void describe_names(FILE *out, const option *o, const char *before, bool all);

#endif
