/* SPDX-License-Identifier: Apache-2.0 */
/* view/answer.h -- an HTTP answer to a request of the page. */
#ifndef GBT_VIEW_ANSWER_H
#define GBT_VIEW_ANSWER_H

#include <stddef.h>

#include "gbtrace/status.h"

typedef struct answer {
    int code;             /* HTTP status code */
    const char *type;     /* MIME type; static */
    unsigned char *bytes; /* owned; free with mem_free() */
    size_t count;
    char about[512]; /* of a picture: JSON for the header X-Picture; empty: no such header */
} answer;

/** An answer with a copy of `text`. If memory runs out the answer is empty. */
void answer_text(answer *out, int code, const char *type, const char *text);

/** The answer "error: ..." to a failure, with its HTTP status code: 400 if the request is at fault, else 500.
 */
void answer_failure(answer *out, gbt_status status, const gbt_error *err);

#endif
