/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe_zsh.c -- the completion script for zsh. */
#include "cli/describe.h"

#include <string.h>

/* Write text for '...[text]...', where a quote would end the string, and a bracket or colon the text. */
static void write_note(FILE *out, const char *text)
{
    for (; *text != '\0'; text++)
        fprintf(out, *text == '\'' ? "'\\''" : strchr("[]:\\", *text) != NULL ? "\\%c" : "%c", *text);
}

static void write_rows(const command *self, const option_table *t, FILE *out)
{
    fprintf(out, "  %s%s%s)\n    _arguments -S", self->name, self->alias != NULL ? "|" : "",
            self->alias != NULL ? self->alias : "");
    for (int i = 0; i < t->count; i++) {
        const option *o = &t->rows[i];
        char help[HELP_TEXT_SIZE];
        if (o->kind == OPTION_ELSEWHERE)
            continue;
        fputs(" \\\n      ", out);
        if (o->short_name != 0)
            fprintf(out, "'(-%c --%s)'{-%c,--%s}'[", o->short_name, o->name, o->short_name, o->name);
        else
            fprintf(out, "'--%s[", o->name);
        write_note(out, options_help_text(o, help, sizeof help));
        fputc(']', out);
        const value_kind kind = describe_value(o);
        if (kind != VALUE_NONE) {
            fputc(':', out);
            write_note(out, kind == VALUE_CHOICES ? o->name : o->value_name);
            fputc(':', out);
        }
        static const char *const before[] = {[VALUE_CHOICES] = "(",
                                             [VALUE_LIST] = "_values -s , value ",
                                             [VALUE_CHOICES_OR_FILE] = " _alternative \"values\\:value\\:(",
                                             [VALUE_FILE] = "_files",
                                             [VALUE_FOLDER] = "_files -/"};
        static const char *const after[] = {[VALUE_CHOICES] = ")",
                                            [VALUE_CHOICES_OR_FILE] = ")\" \"files\\:file\\:_files\"",
                                            [VALUE_FOLDER] = ""};
        fputs(before[kind] != NULL ? before[kind] : "", out);
        if (kind != VALUE_NONE && o->choices != NULL)
            describe_choices(out, o);
        fputs(after[kind] != NULL ? after[kind] : "", out);
        fputc('\'', out);
    }
    if (self->words != NULL) {
        fputs(" \\\n      '1:what:(", out);
        describe_words(out, self);
        fputs(")'", out);
    }
    fputs(" \\\n      '*:file:_files'\n    ;;\n", out);
}

void describe_zsh(FILE *out)
{
    fputs("#compdef gbtrace\n"
          "# Completion of gbtrace for zsh. Made by gbtrace describe zsh.\n"
          "_gbtrace() {\n"
          "  local -a commands\n"
          "  commands=(\n"
          "    'help:the commands, or the options of one'\n",
          out);
    for (int i = 0; i < command_list_count; i++) {
        fprintf(out, "    '%s:", command_list[i]->name);
        write_note(out, command_list[i]->summary);
        fputs("'\n", out);
    }
    fputs("  )\n"
          "  if (( CURRENT == 2 )); then\n"
          "    _describe command commands\n"
          "    return\n"
          "  fi\n"
          "  local command=$words[2]\n"
          "  shift words\n"
          "  (( CURRENT-- ))\n"
          "  case $command in\n"
          "  help) _describe command commands ;;\n",
          out);
    for (int i = 0; i < command_list_count; i++) {
        option_table t;
        options_table(command_list[i], &t);
        write_rows(command_list[i], &t, out);
    }
    fputs("  esac\n"
          "}\n"
          "# Read as a function of completion, or by source.\n"
          "if [ \"$funcstack[1]\" = _gbtrace ]; then _gbtrace \"$@\"; else compdef _gbtrace gbtrace; fi\n",
          out);
}
