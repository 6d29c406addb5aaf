/* SPDX-License-Identifier: Apache-2.0 */
/* cli/option_fields.c -- fields that errors of the library name, as the options that set them. */
#include <stdio.h>
#include <string.h>

#include "cli/options.h"

/** The table of the command that runs; NULL before one does. */
static const option_table *running;

void options_set_fields(const option_table *t) { running = t; }

void options_name_fields(const char *text, char *out, size_t size)
{
    size_t used = 0;
    const char *at = text;
    const int own = running != NULL ? running->own : 0;
    for (;;) {
        const size_t length = strspn(at, "abcdefghijklmnopqrstuvwxyz0123456789_");
        int row = 0;
        while (row < own && !options_is_field(&running->rows[row], at, length))
            row++;
        const bool last = at[length] == ':' && at[length + 1] == ' ';
        if (length == 0 || row == own || !(last || strncmp(at + length, ", ", 2) == 0) || used >= size)
            break;
        used +=
            (size_t)snprintf(out + used, size - used, "--%s%s", running->rows[row].name, last ? "" : ", ");
        at += length + (last ? 0 : 2);
        if (last) {
            snprintf(out + (used < size ? used : size), used < size ? size - used : 0, "%s", at);
            return;
        }
    }
    snprintf(out, size, "%s", text);
}
