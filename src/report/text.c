/* SPDX-License-Identifier: Apache-2.0 */
/* report/text.c -- a growing string for pages: escaping, base64, numbers formatted for people. */
#include "report/text.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/file.h"
#include "base/memory.h"

void text_free(text *t)
{
    mem_free(t->bytes);
    t->bytes = NULL;
    t->length = t->capacity = 0;
}

gbt_status text_print(text *t, FILE *out)
{
    if (t->status == GBT_OK)
        fwrite(t->bytes, 1, t->length, out);
    text_free(t);
    return t->status;
}

gbt_status text_save(text *t, const char *folder, const char *name)
{
    char path[4096];
    gbt_status status = t->status;
    if (status == GBT_OK)
        status = file_join(path, sizeof path, folder, name, t->err);
    if (status == GBT_OK)
        status = file_write_atomic(path, t->bytes, t->length, t->err);
    text_free(t);
    return status;
}

static bool make_room(text *t, size_t count)
{
    if (t->status == GBT_OK && count > t->capacity - t->length)
        t->status =
            mem_reserve((void **)&t->bytes, &t->capacity, t->length, t->length + count, 1, "report", t->err);
    return t->status == GBT_OK;
}

static void add_bytes(text *t, const char *bytes, size_t count)
{
    if (count == 0 || !make_room(t, count))
        return;
    memcpy(t->bytes + t->length, bytes, count);
    t->length += count;
}

void text_add(text *t, const char *markup) { add_bytes(t, markup, strlen(markup)); }

void text_append(text *t, text *other)
{
    if (t->status == GBT_OK)
        t->status = other->status;
    add_bytes(t, other->bytes, other->length);
    text_free(other);
}

void text_format(text *t, const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    const int count = vsnprintf(NULL, 0, format, args);
    va_end(args);
    if (count >= 0 && make_room(t, (size_t)count + 1)) { /* vsnprintf() also writes a terminating zero */
        vsnprintf(t->bytes + t->length, (size_t)count + 1, format, again);
        t->length += (size_t)count;
    }
    va_end(again);
}

/** Length in bytes of the well-formed UTF-8 character at `s` (RFC 3629: shortest form, no surrogates, at most
    U+10FFFF); 0 if there is none. */
static size_t utf8_length(const unsigned char *s)
{
    if (s[0] < 0x80)
        return 1;
    const size_t length = s[0] >= 0xc2 && s[0] <= 0xdf   ? 2
                          : s[0] >= 0xe0 && s[0] <= 0xef ? 3
                          : s[0] >= 0xf0 && s[0] <= 0xf4 ? 4
                                                         : 0;
    const unsigned char lowest = s[0] == 0xe0   ? 0xa0
                                 : s[0] == 0xf0 ? 0x90
                                                : 0x80,
                        highest = s[0] == 0xed   ? 0x9f
                                  : s[0] == 0xf4 ? 0x8f
                                                 : 0xbf;
    if (length == 0 || s[1] < lowest || s[1] > highest)
        return 0;
    for (size_t i = 2; i < length; i++)
        if ((s[i] & 0xc0) != 0x80) /* also stops at a terminating zero */
            return 0;
    return length;
}

static void add_outside(text *t, const char *outside, bool markup)
{
    static const struct {
        char c;
        const char *escaped;
    } special[] = {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
    if (outside == NULL)
        outside = "n/a";
    for (const unsigned char *s = (const unsigned char *)outside; *s != '\0';) {
        const size_t length = utf8_length(s);
        const char *escaped = !markup && *s == '|' ? "\\|" : NULL;
        for (size_t i = 0; markup && i < sizeof special / sizeof *special; i++)
            if (*s == (unsigned char)special[i].c)
                escaped = special[i].escaped;
        if (escaped != NULL)
            text_add(t, escaped);
        else if (length == 0)
            text_add(t, "\xef\xbf\xbd");
        else if (*s < 0x20 || *s == 0x7f)
            text_add(t, *s == '\t' || *s == '\n' ? " " : "?");
        else
            add_bytes(t, (const char *)s, length);
        s += length > 0 ? length : 1;
    }
}

void text_escaped(text *t, const char *outside) { add_outside(t, outside, true); }

void text_plain(text *t, const char *outside) { add_outside(t, outside, false); }

void text_url(text *t, const char *name)
{
    for (const unsigned char *s = (const unsigned char *)name; *s != '\0'; s++) {
        const bool plain = (*s >= 'a' && *s <= 'z') || (*s >= 'A' && *s <= 'Z') || (*s >= '0' && *s <= '9') ||
                           strchr("-._~/", *s) != NULL;
        text_format(t, plain ? "%c" : "%%%02X", *s);
    }
}

void text_base64(text *t, const unsigned char *bytes, size_t count)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (!make_room(t, (count + 2) / 3 * 4))
        return;
    char *out = t->bytes + t->length;
    for (size_t i = 0; i < count; i += 3) {
        const size_t have = count - i;
        const unsigned a = bytes[i], b = have > 1 ? bytes[i + 1] : 0, c = have > 2 ? bytes[i + 2] : 0,
                       group = a << 16 | b << 8 | c;
        *out++ = digits[group >> 18];
        *out++ = digits[group >> 12 & 63];
        *out++ = have > 1 ? digits[group >> 6 & 63] : '=';
        *out++ = have > 2 ? digits[group & 63] : '=';
    }
    t->length = (size_t)(out - t->bytes);
}

void text_number(text *t, double value, int decimals)
{
    if (!isfinite(value))
        text_add(t, "n/a");
    else if (fabs(value) >= 1e15)
        text_format(t, "%.4g", value);
    else
        text_format(t, "%.*f", decimals, value);
}

void text_count(text *t, double value)
{
    if (!isfinite(value) || fabs(value) >= 1e15) {
        text_number(t, value, 0);
        return;
    }
    char digits[32];
    const int count = snprintf(digits, sizeof digits, "%.0f", fabs(value));
    if (value <= -0.5)
        text_add(t, "-");
    for (int i = 0; i < count; i++) {
        if (i > 0 && (count - i) % 3 == 0)
            text_add(t, ",");
        add_bytes(t, digits + i, 1);
    }
}

void text_bytes(text *t, double value)
{
    static const char *const units[] = {"B", "kB", "MB", "GB", "TB"};
    if (!isfinite(value)) {
        text_add(t, "n/a");
        return;
    }
    int unit = 0;
    while (value >= 999.5 && unit < 4) {
        value /= 1000;
        unit++;
    }
    text_format(t, "%.*f %s", unit == 0 ? 0 : value < 9.995 ? 2 : value < 99.95 ? 1 : 0, value, units[unit]);
}

void text_duration(text *t, double seconds)
{
    if (!isfinite(seconds))
        text_add(t, "n/a");
    else if (seconds < 99.95)
        text_format(t, "%.*f s", seconds < 9.995 ? 2 : 1, seconds);
    else if (seconds < 7199.5)
        text_format(t, "%.0f min %02.0f s", floor(round(seconds) / 60), fmod(round(seconds), 60));
    else
        text_format(t, "%.0f h %02.0f min", floor(round(seconds / 60) / 60), fmod(round(seconds / 60), 60));
}
