/* SPDX-License-Identifier: Apache-2.0 */
/* report/text.h -- a growing text for pages: escaping, base64, numbers as people read them. */
#ifndef GBT_REPORT_TEXT_H
#define GBT_REPORT_TEXT_H

#include <stddef.h>
#include <stdio.h>

#include "gbtrace/status.h"

/**
 * Start from {.err = err}; free with text_free(). After a failed allocation every call is a no-op and
 * `status` says why, so that a page is written straight through and checked once at the end.
 */
typedef struct text {
    char *bytes; /* not terminated */
    size_t length, capacity;
    gbt_status status;
    gbt_error *err;
} text;

void text_free(text *t);

/** Write it to a stream and free it; t->status. */
gbt_status text_print(text *t, FILE *out);

/** Write it whole into folder/name and free it; t->status, or that of the file. */
gbt_status text_save(text *t, const char *folder, const char *name);

void text_add(text *t, const char *markup); /* as it is: only what this program wrote */
void text_format(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/**
 * Anything from outside, for content and quoted attributes: markup characters escaped, control bytes become
 * ?, what is not UTF-8 U+FFFD. NULL is "n/a".
 */
void text_escaped(text *t, const char *outside);

/** The same for tables in Markdown, which terminals show too: only | is escaped. */
void text_plain(text *t, const char *outside);

/** A file name as part of a link: what is not a letter, a digit or one of -._~/ becomes %XX. */
void text_url(text *t, const char *name);

/** Add what another text holds, and free that one; its failure becomes that of `t`. */
void text_append(text *t, text *other);
void text_base64(text *t, const unsigned char *bytes, size_t count);

/* What is not finite is "n/a", in all four. */
void text_number(text *t, double value, int decimals);
void text_count(text *t, double value);      /* 1,234,567 */
void text_bytes(text *t, double value);      /* 1.23 MB, powers of 1000 */
void text_duration(text *t, double seconds); /* 12.3 s, 5 min 02 s, 2 h 05 min */

#endif
