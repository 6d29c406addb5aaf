/* SPDX-License-Identifier: Apache-2.0 */
/* base/choice.c -- look up, print and check the names of enumerations. */
#include "base/choice.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"

/* The next of "a|b|c" after the name at `name`; NULL after the last. */
static const char *next_name(const char *name)
{
    name += strcspn(name, "|");
    return *name == '|' ? name + 1 : NULL;
}

int choice_find(const char *names, const char *text)
{
    int index = 0;
    for (const char *name = names; name != NULL; name = next_name(name), index++)
        if (strcspn(name, "|") == strlen(text) && strncmp(name, text, strlen(text)) == 0)
            return index;
    return -1;
}

const char *choice_name(const char *names, int index, char *out)
{
    out[0] = '\0';
    for (const char *name = index >= 0 ? names : NULL; name != NULL; name = next_name(name), index--)
        if (index == 0)
            snprintf(out, CHOICE_TEXT_SIZE, "%.*s", (int)strcspn(name, "|"), name);
    return out;
}

const char *choice_list(const char *names, char *out)
{
    size_t used = 0;
    out[0] = '\0';
    for (const char *name = names; name != NULL && used < CHOICE_TEXT_SIZE; name = next_name(name)) {
        const char *join = name == names ? "" : next_name(name) == NULL ? " or " : ", ";
        used += (size_t)snprintf(out + used, CHOICE_TEXT_SIZE - used, "%s%.*s", join, (int)strcspn(name, "|"),
                                 name);
    }
    return out;
}

gbt_status choice_check(const char *field, const char *names, int value, gbt_error *err)
{
    char text[CHOICE_TEXT_SIZE];
    if (choice_name(names, value, text)[0] != '\0')
        return GBT_OK;
    return base_fail(err, GBT_ERR_ARGUMENT, "%s: %d (wanted %s)", field, value, choice_list(names, text));
}
