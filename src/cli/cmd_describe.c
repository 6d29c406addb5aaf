/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_describe.c -- gbtrace describe: write the manual page or a completion script. */
#include <string.h>

#include "cli/describe.h"

static const command_word forms[] = {{"man", "the manual page, in roff"},
                                     {"bash", "completion for bash"},
                                     {"zsh", "completion for zsh"},
                                     {"fish", "completion for fish"},
                                     {NULL, NULL}};
static void (*const writers[])(FILE *) = {describe_man, describe_bash, describe_zsh, describe_fish};

static const command_word *form_words(void) { return forms; }

static int run(const operands *given)
{
    for (int i = 0; forms[i].name != NULL; i++)
        if (strcmp(forms[i].name, given->value[0]) == 0)
            writers[i](stdout);
    return 0;
}

const command command_describe = {.name = "describe",
                                  .summary = "print the manual page, or a completion script for a shell",
                                  .usage = "man|bash|zsh|fish",
                                  .min_operands = 1,
                                  .max_operands = 1,
                                  .run = run,
                                  .words = form_words};
