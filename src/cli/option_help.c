/* SPDX-License-Identifier: Apache-2.0 */
/* cli/option_help.c -- the help of a command: names, values and defaults of its options, as people read them.
 */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "cli/options.h"

bool options_takes_value(const option *o)
{
    return o->kind != OPTION_FLAG && o->kind != OPTION_FLAG_OFF && o->kind != OPTION_ELSEWHERE &&
           o->fixed == NULL;
}

const char *options_value_name(const option *o)
{
    return !options_takes_value(o) ? "" : o->kind == OPTION_CHOICE ? o->choices : o->value_name;
}

/** Whether `name` equals `typed`, in which _ may stand for -. */
static bool same_name(const char *name, size_t name_length, const char *typed, size_t length)
{
    if (name_length != length)
        return false;
    for (size_t i = 0; i < length; i++)
        if (name[i] != (typed[i] == '_' ? '-' : typed[i]))
            return false;
    return true;
}

bool options_has_word(const char *words, const char *typed, size_t length)
{
    for (const char *word = words; word != NULL && *word != '\0';) {
        const size_t end = strcspn(word, " ");
        if (same_name(word, end, typed, length))
            return true;
        word += end + strspn(word + end, " ");
    }
    return false;
}

static bool row_is(const option *o, const char *typed, size_t length)
{
    if (length == 1 ? o->short_name == typed[0] : same_name(o->name, strlen(o->name), typed, length))
        return true;
    return options_has_word(o->aliases, typed, length) ||
           (o->kind != OPTION_FLAG_OFF && options_is_field(o, typed, length));
}

bool options_is_field(const option *o, const char *name, size_t length)
{
    const char *field = o->field != NULL ? o->field : o->name;
    if (o->kind == OPTION_ELSEWHERE || strlen(field) != length)
        return false;
    for (size_t i = 0; i < length; i++)
        if ((field[i] == '_' ? '-' : field[i]) != (name[i] == '_' ? '-' : name[i]))
            return false;
    return true;
}

int options_find(const option *options, int option_count, const char *name, size_t length)
{
    for (int i = 0; i < option_count && length > 0; i++)
        if (row_is(&options[i], name, length))
            return i;
    return -1;
}

/* ---- values and defaults ---- */

static void add(char *out, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));

static void add(char *out, size_t size, const char *format, ...)
{
    const size_t used = strlen(out);
    va_list args;
    va_start(args, format);
    vsnprintf(out + used, size - used, format, args);
    va_end(args);
}

static void add_duration(char *out, size_t size, double seconds)
{
    if (seconds >= 60 && seconds / 60 == (double)(long)(seconds / 60))
        add(out, size, " (default %gm)", seconds / 60);
    else
        add(out, size, " (default %gs)", seconds);
}

static void add_size(char *out, size_t size, double bytes)
{
    int unit = 0;
    if (bytes <= 0) /* 0 means no default */
        return;
    while (unit < 4 && bytes >= 1024) {
        bytes /= 1024;
        unit++;
    }
    add(out, size, " (default %g%.*s)", bytes, unit > 0, unit > 0 ? &"KMGT"[unit - 1] : "");
}

/** The choice at `index` as default; nothing for an index outside the list, such as GBT_..._AS_TRAINED. */
static void add_choice(char *out, size_t size, const char *choices, int index)
{
    const char *name = choices;
    for (; name != NULL && index > 0; index--) {
        name = strchr(name, '|');
        name = name != NULL ? name + 1 : NULL;
    }
    if (name != NULL)
        add(out, size, " (default %.*s)", (int)strcspn(name, "|"), name);
}

static void add_default(const option *o, char *out, size_t size)
{
    switch (o->kind) {
    case OPTION_FLAG:
    case OPTION_FLAG_OFF:
    case OPTION_OPERAND:
    case OPTION_ELSEWHERE:
        return;
    case OPTION_INT:
        add(out, size, " (default %d)", *(const int *)o->value);
        return;
    case OPTION_UINT64:
        add(out, size, " (default %llu)", (unsigned long long)*(const uint64_t *)o->value);
        return;
    case OPTION_FLOAT:
        add(out, size, " (default %g)", (double)*(const float *)o->value);
        return;
    case OPTION_DOUBLE:
        if (!isnan(*(const double *)o->value)) /* its help text describes the default */
            add(out, size, " (default %g)", *(const double *)o->value);
        return;
    case OPTION_DURATION:
        add_duration(out, size, *(const double *)o->value);
        return;
    case OPTION_SIZE:
        add_size(out, size, (double)*(const size_t *)o->value);
        return;
    case OPTION_CHOICE:
        add_choice(out, size, o->choices, *(const int *)o->value);
        return;
    case OPTION_STRING: {
        const char *text = *(const char *const *)o->value;
        if (text != NULL && text[0] != '\0')
            add(out, size, " (default %s)", text);
        return;
    }
    }
}

/** Whether the help already explains the value 0, so that "(default 0)" would add nothing. */
static bool explains_zero(const option *o, const char *note)
{
    const char *zero = strstr(o->help, "0: ");
    return zero != NULL && (zero == o->help || zero[-1] == ' ') &&
           (strcmp(note, " (default 0)") == 0 || strcmp(note, " (default 0s)") == 0);
}

void options_notes(const option *o, bool names, char *out, size_t size)
{
    out[0] = '\0';
    if (o->required)
        add(out, size, " (needed)");
    else if (o->fixed == NULL)
        add_default(o, out, size);
    if (explains_zero(o, out))
        out[0] = '\0';
    const char *name = names && o->aliases != NULL ? o->aliases : "";
    for (const char *before = " (also "; *name != '\0'; before = ", ") {
        const int end = (int)strcspn(name, " ");
        add(out, size, "%s%s%.*s", before, end > 1 ? "--" : "-", end, name);
        name += (size_t)end + strspn(name + end, " ");
        if (*name == '\0')
            add(out, size, ")");
    }
}

/* ---- help ---- */

enum { HELP_COLUMNS = 100, HELP_INDENT = 30, WORD_WIDTH = 12 };

/** Print `text`, whose first line starts at column `at`, wrapped; further lines are indented. */
static void print_wrapped(const char *text, int at)
{
    bool first = true;
    while (*text != '\0') {
        const int length = (int)strcspn(text, " ");
        if (at + 1 + length > HELP_COLUMNS) {
            printf("\n%*s", HELP_INDENT, "");
            at = HELP_INDENT;
        } else if (!first) {
            putchar(' ');
            at++;
        }
        first = false;
        printf("%.*s", length, text);
        at += length;
        text += length + strspn(text + length, " ");
    }
    putchar('\n');
}

const char *options_help_text(const option *o, char *out, size_t size)
{
    out[0] = '\0';
    for (const char *word = o->of; word != NULL && *word != '\0';) {
        const size_t length = strcspn(word, " ");
        add(out, size, "%s%.*s", out[0] != '\0' ? ", " : "", (int)length, word);
        word += length + strspn(word + length, " ");
    }
    add(out, size, "%s%s", o->of != NULL ? ": " : "", o->help);
    return out;
}

static void print_row(const option *o, bool all)
{
    char left[256], help[HELP_TEXT_SIZE], text[2048], notes[512], short_text[8] = "    ";
    const char *value_name = options_value_name(o);
    if (o->short_name != 0)
        snprintf(short_text, sizeof short_text, "-%c, ", o->short_name);
    const int used = snprintf(left, sizeof left, "  %s--%s%s%s", short_text, o->name,
                              value_name[0] != '\0' ? " " : "", value_name);
    options_notes(o, all, notes, sizeof notes);
    snprintf(text, sizeof text, "%s%s", options_help_text(o, help, sizeof help), notes);
    printf("%-*s", used > HELP_INDENT - 2 ? used + 2 : HELP_INDENT, left);
    print_wrapped(text, used > HELP_INDENT - 2 ? used + 2 : HELP_INDENT);
}

static void print_words(const char *title, const command_word *(*list)(void))
{
    const command_word *words = list != NULL ? list() : NULL;
    int width = WORD_WIDTH;
    for (int i = 0; words != NULL && words[i].name != NULL; i++)
        width = (int)strlen(words[i].name) >= width ? (int)strlen(words[i].name) + 1 : width;
    for (int i = 0; words != NULL && words[i].name != NULL; i++)
        printf("%s%s  %-*s%s\n%s", i == 0 ? title : "", i == 0 ? "\n" : "", width, words[i].name,
               words[i].help, words[i + 1].name == NULL ? "\n" : "");
}

void options_print_help(const command *self, const option_table *t, bool all)
{
    printf("usage: gbtrace %s %s%s[options]\n\n%s\n\n", self->name, self->usage,
           self->usage[0] != '\0' ? " " : "", self->summary);
    print_words("the first argument is one of:", self->words);
    print_words("files, by the ending of their names:", self->endings);
    puts("options:");
    for (int i = 0; i < t->count; i++)
        if (t->rows[i].kind != OPTION_ELSEWHERE && (all || !t->rows[i].rare))
            print_row(&t->rows[i], all);
}
