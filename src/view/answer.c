/* SPDX-License-Identifier: Apache-2.0 */
/* view/answer.c -- HTTP answers made of a text or of a failure. */
#include "view/answer.h"

#include <stdio.h>
#include <string.h>

#include "base/memory.h"

void answer_text(answer *out, int code, const char *type, const char *text)
{
    const size_t count = strlen(text);
    mem_free(out->bytes);
    *out = (answer){.code = code, .type = type, .bytes = mem_alloc(count, 1, "answer", NULL)};
    if (out->bytes == NULL)
        return;
    memcpy(out->bytes, text, count);
    out->count = count;
}

void answer_failure(answer *out, gbt_status status, const gbt_error *err)
{
    char text[sizeof err->text + 16];
    snprintf(text, sizeof text, "error: %s\n", err->text);
    answer_text(out, status == GBT_ERR_ARGUMENT || status == GBT_ERR_FORMAT ? 400 : 500,
                "text/plain; charset=utf-8", text);
}
