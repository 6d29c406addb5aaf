/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_out.h -- writes JSON to a stream or a file, and makes external text safe for it. */
#ifndef GBT_DATA_JSON_OUT_H
#define GBT_DATA_JSON_OUT_H

#include <jansson.h>
#include <stdio.h>

#include "gbtrace/status.h"

/** A JSON string from any bytes. Text that is not valid UTF-8 is taken for Latin-1, so that different texts
    stay different. NULL without memory. */
json_t *json_text(const char *text);

/** A JSON number; null for NaN and infinities, which JSON cannot express. */
json_t *json_number(double value);

/** Write indented JSON with one newline at the end; keys in the order they were set. If `value` is NULL (what
    a failed json_pack() returns), GBT_ERR_NO_MEMORY. */
gbt_status json_print(const json_t *value, FILE *out, gbt_error *err);
gbt_status json_save(const json_t *value, const char *path, gbt_error *err); /* atomically */

/**
 * The same with jansson's formatting flags (JSON_INDENT(n) | JSON_REAL_PRECISION(n) ...), without a newline
 * at the end.
 */
gbt_status json_save_styled(const json_t *value, size_t style, const char *path, gbt_error *err);

#endif
