/* SPDX-License-Identifier: Apache-2.0 */
/* cli/option_values.c -- parse the value of one option: strictly, independent of the locale, within its
   range. */
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/options.h"

enum { CHOICES_MAX = 16 };

/** Length of [+-]digits[.digits][e[+-]digits] at the start of `text`; 0 if there is none. Excludes
    hexadecimal numbers, nan, inf and blanks, which strtod() would accept. */
static size_t decimal_length(const char *text)
{
    size_t i = text[0] == '+' || text[0] == '-' ? 1 : 0, digits = 0;
    for (; isdigit((unsigned char)text[i]); i++)
        digits++;
    if (text[i] == '.')
        for (i++; isdigit((unsigned char)text[i]); i++)
            digits++;
    if (digits == 0)
        return 0;
    if (text[i] == 'e' || text[i] == 'E') {
        size_t j = i + 1;
        if (text[j] == '+' || text[j] == '-')
            j++;
        if (isdigit((unsigned char)text[j])) {
            while (isdigit((unsigned char)text[j]))
                j++;
            i = j;
        }
    }
    return i;
}

static bool read_decimal(const char *text, double min, double max, double *out)
{
    const size_t length = decimal_length(text);
    if (length == 0 || text[length] != '\0')
        return false;
    *out = strtod(text, NULL); /* safe, because the program never leaves the C locale */
    return isfinite(*out) && *out >= min && *out <= max;
}

static bool read_whole(const char *text, double min, double max, int64_t *out)
{
    const char *digits = text[0] == '-' ? text + 1 : text;
    if (digits[0] == '\0' || strspn(digits, "0123456789") != strlen(digits))
        return false;
    errno = 0;
    const long long value = strtoll(text, NULL, 10);
    *out = value;
    return errno == 0 && (double)value >= min && (double)value <= max;
}

static bool read_uint64(const char *text, double min, double max, uint64_t *out)
{
    if (text[0] == '\0' || strspn(text, "0123456789") != strlen(text))
        return false;
    errno = 0;
    *out = strtoull(text, NULL, 10);
    return errno == 0 && ((min == 0 && max == 0) || ((double)*out >= min && (double)*out <= max));
}

/* In descending order. */
static const struct {
    const char *names;
    double seconds;
} time_units[] = {
    {" h hr hrs hour hours ", 3600}, {" m min mins minute minutes ", 60}, {" s sec secs second seconds ", 1}};

enum { TIME_UNITS = sizeof time_units / sizeof *time_units, TIME_NAME_MAX = 8 };

static int find_time_unit(const char *name, size_t length)
{
    char wanted[TIME_NAME_MAX + 3];
    if (length > TIME_NAME_MAX)
        return -1;
    snprintf(wanted, sizeof wanted, " %.*s ", (int)length, name);
    for (int i = 0; i < TIME_UNITS; i++)
        if (strstr(time_units[i].names, wanted) != NULL)
            return i;
    return -1;
}

/** A duration such as 90, 90s, 10m, 10min or 1h30m: units in descending order, each at most once. */
static bool read_duration(const char *text, double min, double max, double *out)
{
    double sum = 0;
    int next = 0;
    if (text[0] == '\0' || text[0] == '-' || text[0] == '+')
        return false;
    while (*text != '\0') {
        const size_t length = decimal_length(text);
        if (length == 0 || text[0] == '-' || text[0] == '+')
            return false;
        size_t name_length = 0;
        while (isalpha((unsigned char)text[length + name_length]))
            name_length++;
        if (text[length] == '\0' && next > 0) /* a number without a unit means seconds, but only alone */
            return false;
        const int unit = text[length] == '\0' ? TIME_UNITS - 1 : find_time_unit(text + length, name_length);
        if (unit < next)
            return false;
        sum += strtod(text, NULL) * time_units[unit].seconds;
        next = unit + 1;
        text += length + name_length;
    }
    *out = sum;
    return isfinite(sum) && sum >= min && sum <= max;
}

static bool read_size(const char *text, double min, double max, size_t *out)
{
    static const char units[] = "KMGT";
    const size_t length = decimal_length(text);
    if (length == 0 || text[0] == '-')
        return false;
    double bytes = strtod(text, NULL);
    if (text[length] != '\0') {
        const char *place = strchr(units, text[length]);
        if (place == NULL || text[length + 1] != '\0')
            return false;
        bytes = ldexp(bytes, 10 * (int)(place - units + 1));
    }
    if (!isfinite(bytes) || bytes < min || bytes > max || bytes >= 0x1p63)
        return false;
    *out = (size_t)bytes;
    return true;
}

/** The index of `text` in "a|b|c", or -1. */
static int find_choice(const char *choices, const char *text)
{
    const size_t length = strlen(text);
    int index = 0;
    for (const char *part = choices; part != NULL; index++) {
        if (length > 0 && strcspn(part, "|") == length && strncmp(part, text, length) == 0)
            return index;
        part = strchr(part, '|');
        part = part != NULL ? part + 1 : NULL;
    }
    return -1;
}

bool options_read_value(const option *o, const char *text, char *wanted, size_t wanted_size)
{
    bool ok = false;
    int64_t whole;
    double number;
    switch (o->kind) {
    case OPTION_FLAG:
    case OPTION_FLAG_OFF: {
        const bool on = strcmp(text, "true") == 0 || strcmp(text, "1") == 0;
        ok = on || strcmp(text, "false") == 0 || strcmp(text, "0") == 0;
        if (ok)
            *(bool *)o->value = on == (o->kind == OPTION_FLAG);
        snprintf(wanted, wanted_size, "true or false");
        break;
    }
    case OPTION_INT:
        ok = read_whole(text, o->min, o->max, &whole);
        if (ok)
            *(int *)o->value = (int)whole;
        snprintf(wanted, wanted_size, "a whole number from %.0f to %.0f", o->min, o->max);
        break;
    case OPTION_UINT64:
        ok = read_uint64(text, o->min, o->max, o->value);
        if (o->min == 0 && o->max == 0)
            snprintf(wanted, wanted_size, "a whole number from 0 to 18446744073709551615");
        else
            snprintf(wanted, wanted_size, "a whole number from %.0f to %.0f", o->min, o->max);
        break;
    case OPTION_FLOAT:
        ok = read_decimal(text, o->min, o->max, &number);
        if (ok)
            *(float *)o->value = (float)number;
        snprintf(wanted, wanted_size, "a number from %g to %g", o->min, o->max);
        break;
    case OPTION_DOUBLE:
        ok = read_decimal(text, o->min, o->max, &number);
        if (ok)
            *(double *)o->value = number;
        snprintf(wanted, wanted_size, "a number from %g to %g", o->min, o->max);
        break;
    case OPTION_STRING:
    case OPTION_OPERAND:
        ok = text[0] != '\0';
        if (ok)
            *(const char **)o->value = text;
        snprintf(wanted, wanted_size, "a text that is not empty");
        break;
    case OPTION_CHOICE:
        whole = find_choice(o->choices, text);
        ok = whole >= 0;
        if (ok)
            *(int *)o->value = (int)whole;
        snprintf(wanted, wanted_size, "one of %s", o->choices);
        break;
    case OPTION_DURATION:
        ok = read_duration(text, o->min, o->max, &number);
        if (ok)
            *(double *)o->value = number;
        snprintf(wanted, wanted_size, "a duration like 90s, 10m or 1h30m, from %gs to %gs", o->min, o->max);
        break;
    case OPTION_SIZE:
        ok = read_size(text, o->min, o->max, o->value);
        snprintf(wanted, wanted_size, "a size like 512M or 6G, from %.0f to %.0f bytes", o->min, o->max);
        break;
    case OPTION_ELSEWHERE:
        break;
    }
    return ok;
}

void options_bad_value(const option *o, const char *wanted, const char *text, char *out, size_t size)
{
    char list[OPTIONS_WANTED_SIZE];
    const char *names[CHOICES_MAX], *nearest = NULL;
    int count = 0;
    if (o->kind == OPTION_CHOICE) {
        snprintf(list, sizeof list, "%s", o->choices);
        char *rest = NULL;
        for (char *name = strtok_r(list, "|", &rest); name != NULL && count < CHOICES_MAX;
             name = strtok_r(NULL, "|", &rest))
            names[count++] = name;
        nearest = command_nearest(text, names, count);
    }
    snprintf(out, size, "bad value (wanted %s, got %.80s%s%s%s)", wanted, text[0] != '\0' ? text : "nothing",
             nearest != NULL ? "; did you mean " : "", nearest != NULL ? nearest : "",
             nearest != NULL ? "?" : "");
}
