/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_fields.h -- reads and checks the fields of a JSON file one by one; each error is one line that
   names the file and the field. */
#ifndef GBT_DATA_JSON_FIELDS_H
#define GBT_DATA_JSON_FIELDS_H

#include <jansson.h>
#include <stdbool.h>

#include "gbtrace/status.h"

/** Larger values are rejected, so that sums and products of a few values do not overflow a float. */
#define JSON_VALUE_MAX 1e15

enum { JSON_PATH_SIZE = 4096 };

/** One object of a file. Everything is borrowed. */
typedef struct json_fields {
    const char *path, *prefix; /* the file; the object's place in it: "", "end.", "objects[2]." */
    const json_t *object;
    gbt_error *err;
} json_fields;

/** The JSON object in a file, which may begin with a byte order mark; duplicate names are an error. Free with
    json_decref(). GBT_ERR_IO, GBT_ERR_FORMAT or GBT_ERR_NO_MEMORY. */
gbt_status json_read(const char *path, json_t **out, gbt_error *err);

/** json_read() of a file that holds a list. */
gbt_status json_read_list(const char *path, json_t **out, gbt_error *err);

/** json_read() for text in memory; messages use `name` in place of the file name. */
gbt_status json_read_text(const char *text, size_t length, const char *name, json_t **out, gbt_error *err);

gbt_status json_field_fail(const json_fields *r, const char *field, const char *what); /* GBT_ERR_FORMAT */
bool json_field_given(const json_fields *r, const char *field);

/** Fails on a field that is not in `names`, which has a space before and after each name. */
gbt_status json_field_names(const json_fields *r, const char *names);

/** Fails, with `why` as the reason, when the field is missing. */
gbt_status json_field_needed(const json_fields *r, const char *field, const char *why);

/** Three numbers. When the field is missing, `out` keeps its value, or it is an error if `needed`. */
gbt_status json_field_vector(const json_fields *r, const char *field, bool needed, double out[3]);

/** A number in (low, high], or [low, high] when `closed`. If the field is missing, `out` is unchanged. */
gbt_status json_field_number(const json_fields *r, const char *field, double low, bool closed, double high,
                             double *out);
/** A whole number in [low, high]. If the field is missing, `out` is unchanged. */
gbt_status json_field_whole(const json_fields *r, const char *field, int low, int high, int *out);
gbt_status json_field_bool(const json_fields *r, const char *field, bool *out);

/** The index of the field's text in `choices`; 0 when the field is missing. */
gbt_status json_field_choice(const json_fields *r, const char *field, const char *const *choices, int count,
                             int *out);

/** A required file name, called `what` in messages; relative to the JSON file's folder unless absolute. */
gbt_status json_field_file(const json_fields *r, const char *field, const char *what,
                           char out[JSON_PATH_SIZE]);

#endif
