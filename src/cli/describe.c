/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe.c -- code shared by the manual page and the completion scripts. */
#include "cli/describe.h"

#include <string.h>

value_kind describe_value(const option *o)
{
    if (!options_takes_value(o))
        return VALUE_NONE;
    if (o->kind == OPTION_CHOICE)
        return VALUE_CHOICES;
    if (o->kind != OPTION_STRING && o->kind != OPTION_OPERAND)
        return VALUE_ANY;
    if (o->choices != NULL)
        return o->list                                 ? VALUE_LIST
               : strstr(o->value_name, "FILE") != NULL ? VALUE_CHOICES_OR_FILE
                                                       : VALUE_CHOICES;
    if (strcmp(o->value_name, "DIR") == 0)
        return VALUE_FOLDER;
    static const char *const paths[] = {"FILE", "RUN", "DATA", "MODEL"};
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++)
        if (strncmp(o->value_name, paths[i], strlen(paths[i])) == 0)
            return VALUE_FILE;
    return VALUE_ANY;
}

void describe_choices(FILE *out, const option *o)
{
    for (const char *c = o->choices; *c != '\0'; c++)
        fputc(*c == '|' ? ' ' : *c, out);
}

void describe_escaped(FILE *out, const char *text, const char *special)
{
    for (; *text != '\0'; text++)
        fprintf(out, strchr(special, *text) != NULL ? "\\%c" : "%c", *text);
}

void describe_words(FILE *out, const command *c)
{
    const command_word *words = c->words != NULL ? c->words() : NULL;
    for (int i = 0; words != NULL && words[i].name != NULL; i++)
        fprintf(out, "%s%s", i > 0 ? " " : "", words[i].name);
}

void describe_names(FILE *out, const option *o, const char *before, bool all)
{
    if (o->short_name != 0)
        fprintf(out, "%s-%c", before, o->short_name);
    fprintf(out, "%s--%s", before, o->name);
    for (const char *name = all && o->aliases != NULL ? o->aliases : ""; *name != '\0';) {
        const size_t length = strcspn(name, " ");
        fprintf(out, "%s%s%.*s", before, length > 1 ? "--" : "-", (int)length, name);
        name += length + strspn(name + length, " ");
    }
}
