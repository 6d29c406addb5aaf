/* SPDX-License-Identifier: Apache-2.0 */
/* io/safetensors.c -- reads the header of a .safetensors file, and the array it points to. */
#include "io/safetensors.h"

#include <jansson.h>
#include <math.h>

#include "data/json_fields.h"

enum { LENGTH_BYTES = 8, HEADER_LIMIT = 100 << 20 };

static gbt_status read_header(const source_file *file, json_t **root, size_t *data_at, gbt_error *err)
{
    cursor c = {.file = file};
    GBT_TRY(cursor_need(&c, LENGTH_BYTES, "the header's length", err));
    const uint64_t length = cursor_u64(&c);
    if (length > HEADER_LIMIT || length > cursor_left(&c))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: not a .safetensors file (its header would have %llu bytes, but %zu follow)",
                         file->name, (unsigned long long)length, cursor_left(&c));
    GBT_TRY(json_read_text((const char *)file->bytes + LENGTH_BYTES, (size_t)length, file->name, root, err));
    *data_at = LENGTH_BYTES + (size_t)length;
    return GBT_OK;
}

static bool get_size(const json_t *list, size_t i, size_t *out)
{
    const json_t *value = json_array_get(list, i);
    if (!json_is_integer(value) || json_integer_value(value) < 0)
        return false;
    *out = (size_t)json_integer_value(value);
    return true;
}

/* Reduce a shape of one to four dimensions to rows and columns; false if there are more or fewer, or if the
   result exceeds `room`. */
static bool read_shape(const json_t *shape, size_t room, tensor *out)
{
    const size_t dimensions = json_array_size(shape);
    out->rows = out->columns = 1;
    for (size_t i = 0; i < dimensions; i++) {
        size_t size, *to = i == 0 && dimensions > 1 ? &out->rows : &out->columns;
        if (!get_size(shape, i, &size) || (double)*to * (double)size > (double)room)
            return false;
        *to *= size;
    }
    return dimensions >= 1 && dimensions <= 4;
}

/* Read the shape and position of an array; GBT_ERR_FORMAT unless both are valid. */
static gbt_status read_entry(const source_file *file, const json_t *entry, const char *name, size_t data_at,
                             tensor *out, size_t *at, gbt_error *err)
{
    const json_t *shape = json_object_get(entry, "shape"), *offsets = json_object_get(entry, "data_offsets");
    const char *type = json_string_value(json_object_get(entry, "dtype"));
    const size_t room = file->size - data_at;
    if (!json_is_object(entry))
        return base_fail(err, GBT_ERR_FORMAT, "%s: no array %s", file->name, name);
    if (type == NULL || strcmp(type, "F32") != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: array %s has the type %.20s (wanted F32)", file->name,
                         name, type != NULL ? type : "of no name");
    size_t end = 0;
    if (!read_shape(shape, room, out))
        return base_fail(err, GBT_ERR_FORMAT, "%s: array %s has no usable shape (wanted one to four sizes)",
                         file->name, name);
    if (!get_size(offsets, 0, at) || !get_size(offsets, 1, &end) || *at > end || end > room ||
        (end - *at) % sizeof(float) != 0 ||
        (double)out->rows * (double)out->columns != (double)((end - *at) / sizeof(float)))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: array %s of %zu x %zu does not fit its data_offsets or the file", file->name,
                         name, out->rows, out->columns);
    *at += data_at;
    return GBT_OK;
}

static gbt_status read_values(const source_file *file, const char *name, size_t at, tensor *out,
                              gbt_error *err)
{
    const size_t count = out->rows * out->columns;
    out->values = mem_alloc(count, sizeof *out->values, "tensor", err);
    if (out->values == NULL)
        return GBT_ERR_NO_MEMORY;
    cursor c = {.file = file, .at = at};
    for (size_t i = 0; i < count; i++) {
        out->values[i] = cursor_f32(&c);
        if (!isfinite(out->values[i]))
            return base_fail(err, GBT_ERR_FORMAT, "%s: array %s: value %zu is not finite", file->name, name,
                             i);
    }
    return GBT_OK;
}

gbt_status safetensors_read(const source_file *file, const char *name, tensor *out, gbt_error *err)
{
    *out = (tensor){0};
    json_t *root;
    size_t data_at = 0, at = 0;
    GBT_TRY(read_header(file, &root, &data_at, err));
    gbt_status status = read_entry(file, json_object_get(root, name), name, data_at, out, &at, err);
    json_decref(root);
    if (status == GBT_OK)
        status = read_values(file, name, at, out, err);
    if (status != GBT_OK) {
        mem_free(out->values);
        *out = (tensor){0};
    }
    return status;
}
