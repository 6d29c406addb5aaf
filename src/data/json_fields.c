/* SPDX-License-Identifier: Apache-2.0 */
/* data/json_fields.c -- reads and checks the fields of a JSON file one by one. */
#include "data/json_fields.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

/* Of memory in jansson, at most: an empty object in a list takes 80, texts as short as {} somewhat more. */
enum { BYTES_PER_CHARACTER = 100 };

static gbt_status parse(const char *text, size_t length, const char *name, json_type type, json_t **out,
                        gbt_error *err)
{
    json_error_t where;
    const size_t mark = file_mark_bytes(text, length);
    *out = NULL;
    if (length == mark)
        return base_fail(err, GBT_ERR_FORMAT, "%s:1: file is empty (wanted JSON)", name);
    /* Without memory jansson would report a wrong token, nothing at all, or end the program. */
    GBT_TRY(mem_check(length + 16, BYTES_PER_CHARACTER, name, err));
    *out = json_loadb(text + mark, length - mark, JSON_REJECT_DUPLICATES, &where);
    if (*out == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s:%d: not usable JSON: %s", name, where.line, where.text);
    if (json_typeof(*out) == type)
        return GBT_OK;
    json_decref(*out);
    *out = NULL;
    return base_fail(err, GBT_ERR_FORMAT, "%s: wanted a JSON %s", name,
                     type == JSON_OBJECT ? "object" : "list");
}

static gbt_status read_file(const char *path, json_type type, json_t **out, gbt_error *err)
{
    unsigned char *bytes;
    size_t count;
    GBT_TRY(file_read(path, &bytes, &count, err));
    const gbt_status status = parse((const char *)bytes, count, path, type, out, err);
    mem_free(bytes);
    return status;
}

gbt_status json_read(const char *path, json_t **out, gbt_error *err)
{
    return read_file(path, JSON_OBJECT, out, err);
}

gbt_status json_read_list(const char *path, json_t **out, gbt_error *err)
{
    return read_file(path, JSON_ARRAY, out, err);
}

gbt_status json_read_text(const char *text, size_t length, const char *name, json_t **out, gbt_error *err)
{
    return parse(text, length, name, JSON_OBJECT, out, err);
}

gbt_status json_field_fail(const json_fields *r, const char *field, const char *what)
{
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: %s", r->path, r->prefix, field, what);
}

bool json_field_given(const json_fields *r, const char *field)
{
    return json_object_get(r->object, field) != NULL;
}

gbt_status json_field_names(const json_fields *r, const char *names)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)r->object, key, value)
    {
        char padded[64];
        const int length = snprintf(padded, sizeof padded, " %s ", key);
        if (length >= (int)sizeof padded || length < 3 || strchr(key, ' ') != NULL ||
            strstr(names, padded) == NULL)
            return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%.60s: unknown field (wanted one of%.*s)",
                             r->path, r->prefix, key, (int)strlen(names) - 1, names);
    }
    return GBT_OK;
}

gbt_status json_field_vector(const json_fields *r, const char *field, bool needed, double out[3])
{
    const json_t *array = json_object_get(r->object, field);
    if (array == NULL)
        return needed ? json_field_fail(r, field, "missing (wanted 3 numbers)") : GBT_OK;
    if (!json_is_array(array) || json_array_size(array) != 3)
        return json_field_fail(r, field, "wanted 3 numbers");
    for (size_t i = 0; i < 3; i++) {
        const json_t *value = json_array_get(array, i);
        if (!json_is_number(value) || !(fabs(json_number_value(value)) <= JSON_VALUE_MAX))
            return json_field_fail(r, field, "wanted 3 numbers, within 1e15");
        out[i] = json_number_value(value);
    }
    return GBT_OK;
}

gbt_status json_field_number(const json_fields *r, const char *field, double low, bool closed, double high,
                             double *out)
{
    const json_t *value = json_object_get(r->object, field);
    if (value == NULL)
        return GBT_OK;
    const double number = json_number_value(value);
    if (!json_is_number(value) || !(closed ? number >= low : number > low) || !(number <= high))
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted a number in %c%g, %g]", r->path, r->prefix,
                         field, closed ? '[' : '(', low, high);
    *out = number;
    return GBT_OK;
}

gbt_status json_field_whole(const json_fields *r, const char *field, int low, int high, int *out)
{
    const json_t *value = json_object_get(r->object, field);
    if (value == NULL)
        return GBT_OK;
    const json_int_t number = json_integer_value(value);
    if (!json_is_integer(value) || number < low || number > high)
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted a whole number in [%d, %d]", r->path,
                         r->prefix, field, low, high);
    *out = (int)number;
    return GBT_OK;
}

gbt_status json_field_choice(const json_fields *r, const char *field, const char *const *choices, int count,
                             int *out)
{
    const json_t *value = json_object_get(r->object, field);
    char list[160] = "";
    *out = 0;
    for (int i = 0; i < count; i++) {
        if (json_is_string(value) && strcmp(json_string_value(value), choices[i]) == 0)
            *out = i;
        const size_t length = strlen(list);
        snprintf(list + length, sizeof list - length, "%s%s", i > 0 ? ", " : "", choices[i]);
    }
    if (value == NULL || (json_is_string(value) && strcmp(json_string_value(value), choices[*out]) == 0))
        return GBT_OK;
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted one of %s", r->path, r->prefix, field, list);
}

gbt_status json_field_needed(const json_fields *r, const char *field, const char *why)
{
    return json_field_given(r, field)
               ? GBT_OK
               : base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: missing (%s)", r->path, r->prefix, field, why);
}

gbt_status json_field_bool(const json_fields *r, const char *field, bool *out)
{
    const json_t *value = json_object_get(r->object, field);
    if (value != NULL && !json_is_boolean(value))
        return json_field_fail(r, field, "wanted true or false");
    if (value != NULL)
        *out = json_is_true(value);
    return GBT_OK;
}

gbt_status json_field_file(const json_fields *r, const char *field, const char *what,
                           char out[JSON_PATH_SIZE])
{
    const char *name = json_string_value(json_object_get(r->object, field)), *slash = strrchr(r->path, '/');
    if (name == NULL || name[0] == '\0')
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted the name of %s", r->path, r->prefix, field,
                         what);
    const int folder_length = slash == NULL || name[0] == '/' ? 0 : (int)(slash - r->path) + 1;
    if (snprintf(out, JSON_PATH_SIZE, "%.*s%s", folder_length, r->path, name) >= JSON_PATH_SIZE)
        return json_field_fail(r, field, "name is too long");
    return GBT_OK;
}
