/* SPDX-License-Identifier: Apache-2.0 */
/* cli/option_fields.c -- replace field names in the library's error messages by the options that set them. */
#include <stdio.h>
#include <string.h>

#include "cli/options.h"

static const option_table none;

/** The table of the running command; empty before it is known. */
static const option_table *running = &none;

void options_set_fields(const option_table *t) { running = t; }

/** The option that sets the field at `name`; NULL if the command has none. */
static const option *option_of(const char *name, size_t length)
{
    for (int row = 0; length > 0 && row < running->own; row++)
        if (options_is_field(&running->rows[row], name, length))
            return &running->rows[row];
    return NULL;
}

void options_name_fields(const char *text, char *out, size_t size)
{
    size_t used = 0;
    const char *at = text;
    for (;;) {
        const size_t length = strspn(at, "abcdefghijklmnopqrstuvwxyz0123456789_");
        const option *o = option_of(at, length);
        const bool last = at[length] == ':' && at[length + 1] == ' ';
        if (o == NULL || !(last || strncmp(at + length, ", ", 2) == 0) || used >= size)
            break;
        used += (size_t)snprintf(out + used, size - used, "--%s%s", o->name, last ? "" : ", ");
        at += length + (last ? 0 : 2);
        if (last) {
            snprintf(out + (used < size ? used : size), used < size ? size - used : 0, "%s", at);
            return;
        }
    }
    snprintf(out, size, "%s", text);
}

void options_name_quoted(const char *text, char *out, size_t size)
{
    size_t used = 0;
    for (const char *at = text; *at != '\0' && used + 1 < size;) {
        const size_t length = *at == '`' ? strcspn(at + 1, "`") : 0;
        const option *o = option_of(at + 1, length);
        if (o != NULL && at[length + 1] == '`') {
            const int put = snprintf(out + used, size - used, "--%s", o->name);
            used += (size_t)put < size - used ? (size_t)put : size - used - 1;
            at += length + 2;
        } else {
            out[used++] = *at++;
        }
    }
    out[used] = '\0';
}
