/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe_fish.c -- the completion script for fish. */
#include "cli/describe.h"

static void write_note(FILE *out, const char *text)
{
    fputs(" -d '", out);
    describe_escaped(out, text, "'\\");
    fputs("'\n", out);
}

static void write_rows(const command *self, const option_table *t, FILE *out)
{
    for (int i = 0; i < t->count; i++) {
        const option *o = &t->rows[i];
        char help[HELP_TEXT_SIZE];
        if (o->kind == OPTION_ELSEWHERE)
            continue;
        fprintf(out, "complete -c gbtrace -n '__fish_seen_subcommand_from %s' -l %s", self->name, o->name);
        if (o->short_name != 0)
            fprintf(out, " -s %c", o->short_name);
        switch (describe_value(o)) {
        case VALUE_NONE:
            break;
        case VALUE_ANY:
            fputs(" -x", out);
            break;
        case VALUE_CHOICES:
            fputs(" -x -a '", out);
            describe_choices(out, o);
            fputc('\'', out);
            break;
        case VALUE_LIST:
            fputs(" -x -a '(__fish_append , ", out);
            describe_choices(out, o);
            fputs(")'", out);
            break;
        case VALUE_CHOICES_OR_FILE:
            fputs(" -r -F -a '", out);
            describe_choices(out, o);
            fputc('\'', out);
            break;
        case VALUE_FILE:
            fputs(" -r -F", out);
            break;
        case VALUE_FOLDER:
            fputs(" -x -a '(__fish_complete_directories)'", out);
            break;
        }
        write_note(out, options_help_text(o, help, sizeof help));
    }
    if (self->words == NULL)
        return;
    fprintf(out,
            "complete -c gbtrace -n '__fish_seen_subcommand_from %s; and test (count (commandline -opc)) -eq "
            "2' -f -a '",
            self->name);
    describe_words(out, self);
    fputs("'\n", out);
}

void describe_fish(FILE *out)
{
    fputs("# Completion of gbtrace for fish. Made by gbtrace describe fish.\n", out);
    for (int i = 0; i < command_list_count; i++) {
        fprintf(out, "complete -c gbtrace -n __fish_use_subcommand -f -a %s", command_list[i]->name);
        write_note(out, command_list[i]->summary);
    }
    for (int i = 0; i < command_list_count; i++) {
        option_table t;
        options_table(command_list[i], &t);
        write_rows(command_list[i], &t, out);
    }
}
