/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_out.h -- finished JSON to a stream or a file; texts from outside made safe for it. */
#ifndef GBT_DATA_JSON_OUT_H
#define GBT_DATA_JSON_OUT_H

#include <jansson.h>
#include <stdio.h>

#include "gbtrace/status.h"

/** A JSON string of any bytes: those that are not UTF-8 are taken for Latin-1, so that different texts stay
    different. NULL without memory. */
json_t *json_text(const char *text);

/** A JSON number; null for what JSON has no number for: NaN, infinities. */
json_t *json_number(double value);

/** Indented, keys in the order they were set, one newline at the end. NULL, as failed json_pack() gives, is
    GBT_ERR_NO_MEMORY. */
gbt_status json_print(const json_t *value, FILE *out, gbt_error *err);
gbt_status json_save(const json_t *value, const char *path, gbt_error *err); /* atomically */

/** The same in a style of jansson's (JSON_INDENT(n) | JSON_REAL_PRECISION(n) ...), without a newline at the
 * end. */
gbt_status json_save_styled(const json_t *value, size_t style, const char *path, gbt_error *err);

#endif
