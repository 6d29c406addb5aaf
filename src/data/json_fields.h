/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_fields.h -- the fields of a JSON file, checked one by one, each failure one line that names the
   file and the field. */
#ifndef GBT_DATA_JSON_FIELDS_H
#define GBT_DATA_JSON_FIELDS_H

#include <jansson.h>
#include <stdbool.h>

#include "gbtrace/status.h"

/** Larger values are refused: no sum or product of a few of them leaves the range of float. */
#define JSON_VALUE_MAX 1e15

enum { JSON_PATH_SIZE = 4096 };

/** One object of a file. All is borrowed. */
typedef struct json_fields {
    const char *path, *prefix; /* the file; where in it the object stands: "", "end.", "objects[2]." */
    const json_t *object;
    gbt_error *err;
} json_fields;

/** The JSON object that a file holds; names may not be given twice. Free with json_decref(). GBT_ERR_IO or
    GBT_ERR_FORMAT. */
gbt_status json_read(const char *path, json_t **out, gbt_error *err);

/** The same of a text; `name` stands for the file in messages. */
gbt_status json_read_text(const char *text, size_t length, const char *name, json_t **out, gbt_error *err);

gbt_status json_field_fail(const json_fields *r, const char *field, const char *what); /* GBT_ERR_FORMAT */
bool json_field_given(const json_fields *r, const char *field);

/** Fails on a field that is not one of `names`, which are separated and enclosed by spaces. */
gbt_status json_field_names(const json_fields *r, const char *names);

/** Fails with `why` when the field is missing. */
gbt_status json_field_needed(const json_fields *r, const char *field, const char *why);

/** Three numbers; when they are missing `out` keeps what it has, unless they are `needed`. */
gbt_status json_field_vector(const json_fields *r, const char *field, bool needed, double out[3]);

/** A number in (low, high], or [low, high] when `closed`; a missing one keeps `out`. */
gbt_status json_field_number(const json_fields *r, const char *field, double low, bool closed, double high,
                             double *out);
gbt_status json_field_whole(const json_fields *r, const char *field, int low, int high, int *out); /* in [low,
                                                                                                      high] */
gbt_status json_field_bool(const json_fields *r, const char *field, bool *out);

/** One of the texts of `choices`, as its number; a missing one is the first. */
gbt_status json_field_choice(const json_fields *r, const char *field, const char *const *choices, int count,
                             int *out);

/** The name of a file, `what`, that stands beside the JSON file unless its name is absolute; needed. */
gbt_status json_field_file(const json_fields *r, const char *field, const char *what,
                           char out[JSON_PATH_SIZE]);

#endif
