/* SPDX-License-Identifier: Apache-2.0 */
/* report/text.h -- a growing string for pages: escaping, base64, numbers formatted for people. */
#ifndef GBT_REPORT_TEXT_H
#define GBT_REPORT_TEXT_H

#include <stddef.h>
#include <stdio.h>

#include "gbtrace/status.h"

/**
 * Start from {.err = err}; free with text_free(). After a failed allocation every call is a no-op and
 * `status` keeps the failure, so that a page is written without checks and tested once at the end.
 */
typedef struct text {
    char *bytes; /* not zero-terminated */
    size_t length, capacity;
    gbt_status status;
    gbt_error *err;
} text;

void text_free(text *t);

/** Write the text to a stream and free it. Returns t->status. */
gbt_status text_print(text *t, FILE *out);

/** Write the text to folder/name, all or nothing, and free it. Returns t->status, or the failure of the file.
 */
gbt_status text_save(text *t, const char *folder, const char *name);

void text_add(text *t, const char *markup); /* verbatim: trusted markup only */
void text_format(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/**
 * Untrusted text, for content and quoted attributes: markup characters are escaped, control bytes become ?,
 * invalid UTF-8 becomes U+FFFD. NULL is "n/a".
 */
void text_escaped(text *t, const char *outside);

/** Untrusted text for Markdown tables, which terminals show too: only | is escaped. */
void text_plain(text *t, const char *outside);

/** A file name as part of a URL: everything but letters, digits and -._~/ becomes %XX. */
void text_url(text *t, const char *name);

/** Append another text and free it. Its failure becomes that of `t`. */
void text_append(text *t, text *other);
void text_base64(text *t, const unsigned char *bytes, size_t count);

/* In all four, a non-finite value is "n/a". */
void text_number(text *t, double value, int decimals);
void text_count(text *t, double value);      /* 1,234,567 */
void text_bytes(text *t, double value);      /* 1.23 MB, powers of 1000 */
void text_duration(text *t, double seconds); /* 12.3 s, 5 min 02 s, 2 h 05 min */

#endif
