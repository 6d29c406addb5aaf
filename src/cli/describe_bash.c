/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe_bash.c -- the completion script for bash. */
#include "cli/describe.h"

static void write_names(const command *self, const option_table *t, FILE *out)
{
    fprintf(out, "    %s%s%s) options='", self->name, self->alias != NULL ? "|" : "",
            self->alias != NULL ? self->alias : "");
    for (int i = 0; i < t->count; i++)
        if (t->rows[i].kind != OPTION_ELSEWHERE)
            describe_names(out, &t->rows[i], " ", false);
    fputs("' ;;\n", out);
}

static void write_pattern(FILE *out, const command *self, const option *o)
{
    char before[64];
    snprintf(before, sizeof before, "|%s:", self->name);
    fputs("    (''", out); /* an empty pattern first, so that every name can be preceded by a bar */
    describe_names(out, o, before, true);
    fputs(") ", out);
}

static void write_values(const command *self, const option_table *t, FILE *out)
{
    for (int i = 0; i < t->count; i++) {
        const option *o = &t->rows[i];
        const value_kind kind = describe_value(o);
        if (kind == VALUE_NONE)
            continue;
        write_pattern(out, self, o);
        static const char *const wants[] = {[VALUE_ANY] = "none",  [VALUE_CHOICES] = "none",
                                            [VALUE_LIST] = "list", [VALUE_CHOICES_OR_FILE] = "file",
                                            [VALUE_FILE] = "file", [VALUE_FOLDER] = "folder"};
        fputs("words='", out);
        if (o->choices != NULL)
            describe_choices(out, o);
        fprintf(out, "' want=%s ;;\n", wants[kind]);
    }
}

static void write_command_words(FILE *out)
{
    for (int i = 0; i < command_list_count; i++)
        fprintf(out, "%s%s", i > 0 ? " " : "", command_list[i]->name);
}

void describe_bash(FILE *out)
{
    fputs("# Completion of gbtrace for bash. Made by gbtrace describe bash.\n"
          "_gbtrace() {\n"
          "    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} "
          "command=${COMP_WORDS[1]} options= words= list= want=file\n"
          "    COMPREPLY=()\n"
          "    # bash parts a word at =: --name=VALUE comes as three.\n"
          "    [ \"$current\" = = ] && current=\n"
          "    [ \"$before\" = = ] && before=${COMP_WORDS[COMP_CWORD-2]}\n"
          "    if [ \"$COMP_CWORD\" = 1 ]; then\n"
          "        COMPREPLY=($(compgen -W 'help --help --version ",
          out);
    write_command_words(out);
    fputs("' -- \"$current\"))\n"
          "        return\n"
          "    fi\n"
          "    case $command in\n"
          "    help) words='",
          out);
    write_command_words(out);
    fputs("' want=none ;;\n", out);
    for (int i = 0; i < command_list_count; i++) {
        option_table t;
        options_table(command_list[i], &t);
        write_names(command_list[i], &t, out);
    }
    fputs("    esac\n"
          "    if [ \"$COMP_CWORD\" = 2 ]; then\n"
          "        case $command in\n",
          out);
    for (int i = 0; i < command_list_count; i++) {
        if (command_list[i]->words == NULL)
            continue;
        fprintf(out, "        %s) want=none words='", command_list[i]->name);
        describe_words(out, command_list[i]);
        fputs("' ;;\n", out);
    }
    fputs("        esac\n"
          "    fi\n"
          "    case $command:$before in\n",
          out);
    for (int i = 0; i < command_list_count; i++) {
        option_table t;
        options_table(command_list[i], &t);
        write_values(command_list[i], &t, out);
    }
    fputs("    esac\n"
          "    if [[ $current = -* ]]; then\n"
          "        COMPREPLY=($(compgen -W \"$options\" -- \"$current\"))\n"
          "        return\n"
          "    fi\n"
          "    if [ \"$want\" = list ]; then\n"
          "        compopt -o nospace 2>/dev/null\n"
          "        [[ $current = *,* ]] && list=${current%,*},\n"
          "    fi\n"
          "    COMPREPLY=($(compgen -P \"$list\" -W \"$words\" -- \"${current#\"$list\"}\"))\n"
          "    if [ \"$want\" = file ] || [ \"$want\" = folder ]; then\n"
          "        compopt -o filenames 2>/dev/null\n"
          "        local IFS=$'\\n'\n"
          "        COMPREPLY+=($(compgen -A $([ \"$want\" = folder ] && echo directory || echo file) -- "
          "\"$current\"))\n"
          "    fi\n"
          "}\n"
          "complete -F _gbtrace gbtrace\n",
          out);
}
