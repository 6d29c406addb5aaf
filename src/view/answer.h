/* SPDX-License-Identifier: Apache-2.0 */
/* view/answer.h -- what goes back to the page. */
#ifndef GBT_VIEW_ANSWER_H
#define GBT_VIEW_ANSWER_H

#include <stddef.h>

#include "gbtrace/status.h"

typedef struct answer {
    int code;             /* of HTTP */
    const char *type;     /* of the bytes; static */
    unsigned char *bytes; /* owned; mem_free() */
    size_t count;
    char about[512]; /* of a picture, as JSON: goes into the header X-Picture; empty: none */
} answer;

/** A copy of a text. Without memory the answer is empty. */
void answer_text(answer *out, int code, const char *type, const char *text);

/** "error: ..." with the code that belongs to the status: 400 for what the request did wrong, else 500. */
void answer_failure(answer *out, gbt_status status, const gbt_error *err);

#endif
