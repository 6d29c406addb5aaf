/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_out.c -- writes JSON to a stream or a file. */
#include "data/json_out.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

/* 9 digits are enough to tell any two floats apart; 12 digits keep world coordinates within a city to a
   micrometre. */
enum { JSON_STYLE = JSON_INDENT(2) | JSON_REAL_PRECISION(12) };

json_t *json_text(const char *text)
{
    json_t *value = json_string(text);
    if (value != NULL)
        return value;
    const size_t length = strlen(text);
    char *letters = mem_alloc(2 * length + 1, 1, "JSON text", NULL), *end = letters;
    if (letters == NULL)
        return NULL;
    for (size_t i = 0; i < length; i++) {
        const unsigned char byte = (unsigned char)text[i];
        if (byte >= 0x80)
            *end++ = (char)(0xc0 | byte >> 6);
        *end++ = (char)(byte < 0x80 ? byte : 0x80 | (byte & 0x3f));
    }
    value = json_stringn(letters, (size_t)(end - letters));
    mem_free(letters);
    return value;
}

json_t *json_number(double value) { return isfinite(value) ? json_real(value) : json_null(); }

static char *dump(const json_t *value, gbt_error *err)
{
    char *text = value != NULL ? json_dumps(value, JSON_STYLE) : NULL;
    if (text == NULL)
        base_fail(err, GBT_ERR_NO_MEMORY, "JSON: no memory");
    return text;
}

gbt_status json_print(const json_t *value, FILE *out, gbt_error *err)
{
    char *text = dump(value, err);
    if (text == NULL)
        return GBT_ERR_NO_MEMORY;
    fprintf(out, "%s\n", text);
    free(text);
    return GBT_OK;
}

gbt_status json_save(const json_t *value, const char *path, gbt_error *err)
{
    char *text = dump(value, err);
    if (text == NULL)
        return GBT_ERR_NO_MEMORY;
    const size_t length = strlen(text);
    text[length] = '\n'; /* overwrites the terminating zero, which is not needed any more */
    const gbt_status status = file_write_atomic(path, text, length + 1, err);
    free(text);
    return status;
}

gbt_status json_save_styled(const json_t *value, size_t style, const char *path, gbt_error *err)
{
    char *text = value != NULL ? json_dumps(value, style) : NULL;
    if (text == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    const gbt_status status = file_write_atomic(path, text, strlen(text), err);
    free(text);
    return status;
}
