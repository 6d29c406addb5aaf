/* SPDX-License-Identifier: Apache-2.0 */
/* base/shell_word.c -- quote text for a shell in single quotes; a quote in the text is written outside of
   them: 'it'\''s'. */
#include "gbtrace/progress.h"

#include <stdio.h>
#include <string.h>

const char *gbt_shell_word(const char *text, char *out, size_t size)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./:=@%+,-";
    if (text[0] != '\0' && text[strspn(text, plain)] == '\0') {
        snprintf(out, size, "%s", text);
        return out;
    }
    size_t used = (size_t)snprintf(out, size, "'");
    for (; *text != '\0' && used < size; text++)
        used += (size_t)snprintf(out + used, size - used, *text == '\'' ? "'\\''" : "%c", *text);
    if (used < size)
        snprintf(out + used, size - used, "'");
    return out;
}
