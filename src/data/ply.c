/* SPDX-License-Identifier: Apache-2.0 */
/* data/ply.c -- reads the rows of a PLY file, and point clouds from them. */
#include "data/ply.h"

#include <math.h>

#include "data/number.h"

static const size_t type_bytes[PLY_TYPE_COUNT] = {
    [PLY_INT8] = 1,  [PLY_UINT8] = 1,  [PLY_INT16] = 2, [PLY_UINT16] = 2,
    [PLY_INT32] = 4, [PLY_UINT32] = 4, [PLY_FLOAT] = 4, [PLY_DOUBLE] = 8,
};

static double take_binary(cursor *c, ply_type type, ply_format format)
{
    uint64_t bits = cursor_uint(c, type_bytes[type]);
    if (format == PLY_BIG_ENDIAN)
        bits = __builtin_bswap64(bits) >> (64 - 8 * type_bytes[type]);
    switch (type) {
    case PLY_INT8:
        return (double)(int8_t)bits;
    case PLY_INT16:
        return (double)(int16_t)bits;
    case PLY_INT32:
        return (double)(int32_t)bits;
    case PLY_FLOAT: {
        const uint32_t low = (uint32_t)bits;
        float value;
        memcpy(&value, &low, sizeof value);
        return (double)value;
    }
    case PLY_DOUBLE: {
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    default:
        return (double)bits;
    }
}

/* The least number of bytes that a row of this element can take. */
static size_t least_row_bytes(const ply_header *header, const ply_element *e)
{
    if (header->format == PLY_ASCII)
        return 2 * e->property_count; /* a digit and a separator for each property */
    size_t bytes = 0;
    for (size_t i = 0; i < e->property_count; i++) {
        const ply_property *p = &header->properties[e->first_property + i];
        bytes += type_bytes[p->is_list ? p->count_type : p->type];
    }
    return bytes;
}

size_t ply_row_bytes(const ply_header *header, int element)
{
    const ply_element *e = &header->elements[element];
    for (size_t i = 0; i < e->property_count; i++)
        if (header->properties[e->first_property + i].is_list)
            return 0;
    return header->format == PLY_ASCII ? 0 : least_row_bytes(header, e);
}

static gbt_status check_count(const source_file *file, const cursor *c, const ply_header *header,
                              const ply_element *e, gbt_error *err)
{
    if (e->count == 0)
        return GBT_OK;
    const int shown = e->name_length < 60 ? (int)e->name_length : 60;
    if (e->property_count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: element %.*s has rows but no properties", file->name,
                         shown, e->name);
    /* The last row of an ASCII file may lack its newline, so one missing byte is allowed. */
    const size_t row_bytes = least_row_bytes(header, e), grant = header->format == PLY_ASCII ? 1 : 0;
    if (e->count > (cursor_left(c) + grant) / row_bytes)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@%zu: %llu rows of element %.*s cannot be in the %zu bytes that follow",
                         file->name, c->at, (unsigned long long)e->count, shown, e->name, cursor_left(c));
    return GBT_OK;
}

/* The one list property whose items are kept. */
typedef struct kept_list {
    int property; /* within the element; -1: none */
    double *items;
    size_t count, capacity;
} kept_list;

static gbt_status keep_item(kept_list *list, double value, gbt_error *err)
{
    GBT_TRY(mem_reserve((void **)&list->items, &list->capacity, list->count, list->count + 1,
                        sizeof *list->items, "list of a PLY row", err));
    list->items[list->count++] = value;
    return GBT_OK;
}

/* Read one binary row. `values` gets every scalar property of the element, `list` the items of one list;
   other lists are skipped. */
static gbt_status take_binary_row(cursor *c, const ply_header *header, const ply_element *e, double *values,
                                  kept_list *list, gbt_error *err)
{
    const size_t start = c->at;
    for (size_t i = 0; i < e->property_count && !c->short_read; i++) {
        const ply_property *p = &header->properties[e->first_property + i];
        if (!p->is_list) {
            values[i] = take_binary(c, p->type, header->format);
            continue;
        }
        const double count = take_binary(c, p->count_type, header->format);
        if (count < 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: list of %g items", c->file->name, start, count);
        if ((int)i != list->property)
            cursor_skip(c, (uint64_t)count * type_bytes[p->type]); /* at most 2^32 * 8, so no overflow */
        for (uint64_t k = 0; (int)i == list->property && k < (uint64_t)count && !c->short_read; k++)
            GBT_TRY(keep_item(list, take_binary(c, p->type, header->format), err));
    }
    if (c->short_read)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: file ends inside a row of element %.*s", c->file->name,
                         start, e->name_length < 60 ? (int)e->name_length : 60, e->name);
    return GBT_OK;
}

static gbt_status take_ascii_value(const char **at, const char *end, raw_place place, double *out,
                                   gbt_error *err)
{
    const char *token;
    size_t length;
    if (!number_next_token(at, end, &token, &length))
        return raw_fail(err, place, "row has too few values");
    const number_result result = number_parse_double(token, length, out);
    if (result == NUMBER_OK)
        return GBT_OK;
    return raw_fail(err, place,
                    result == NUMBER_RANGE ? "value is out of range: %.*s" : "value is not a number: %.*s",
                    length < 60 ? (int)length : 60, token);
}

/* Read one ASCII row, which is one line; blank lines before it are skipped. */
static gbt_status take_ascii_row(cursor *c, size_t *line, const ply_header *header, const ply_element *e,
                                 double *values, kept_list *list, gbt_error *err)
{
    const char *at = NULL, *end = NULL, *ahead = NULL, *token = NULL;
    size_t length = 0;
    raw_place place = {0};
    do {
        if (cursor_left(c) == 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s:%zu: file ends before the last row of element %.*s",
                             c->file->name, *line, e->name_length < 60 ? (int)e->name_length : 60, e->name);
        at = (const char *)c->file->bytes + c->at;
        const char *newline = memchr(at, '\n', cursor_left(c));
        end = newline != NULL ? newline : at + cursor_left(c);
        c->at += (size_t)(end - at) + (newline != NULL);
        place = (raw_place){c->file->name, ':', ++*line};
        ahead = at;
    } while (!number_next_token(&ahead, end, &token, &length));
    for (size_t i = 0; i < e->property_count; i++) {
        const ply_property *p = &header->properties[e->first_property + i];
        double value;
        GBT_TRY(take_ascii_value(&at, end, place, &value, err));
        if (!p->is_list) {
            values[i] = value;
            continue;
        }
        if (!(value >= 0 && value <= UINT32_MAX))
            return raw_fail(err, place, "list of %g items", value);
        for (uint64_t k = (uint64_t)value; k > 0; k--) {
            double item;
            GBT_TRY(take_ascii_value(&at, end, place, &item, err));
            if ((int)i == list->property)
                GBT_TRY(keep_item(list, item, err));
        }
    }
    if (number_next_token(&at, end, &token, &length))
        return raw_fail(err, place, "row has too many values, from %.*s", length < 60 ? (int)length : 60,
                        token);
    return GBT_OK;
}

/* Called for each row of the requested element. */
typedef gbt_status use_row(void *context, const double *values, const kept_list *list, gbt_error *err);

static gbt_status read_rows(const source_file *file, const ply_header *header, int element, kept_list *list,
                            use_row *use, void *context, gbt_error *err)
{
    cursor c = {.file = file, .at = header->data_at};
    size_t line = header->line_count;
    double values[PLY_MAX_PROPERTIES];
    kept_list none = {.property = -1};
    /* Elements after the requested one are read too, so that a file which ends inside them is found to be
       damaged. */
    for (int i = 0; i < (int)header->element_count; i++) {
        const ply_element *e = &header->elements[i];
        GBT_TRY(check_count(file, &c, header, e, err));
        for (uint64_t k = 0; k < e->count; k++) {
            list->count = 0;
            if (header->format == PLY_ASCII)
                GBT_TRY(take_ascii_row(&c, &line, header, e, values, i == element ? list : &none, err));
            else
                GBT_TRY(take_binary_row(&c, header, e, values, i == element ? list : &none, err));
            if (i == element)
                GBT_TRY(use(context, values, list, err));
        }
    }
    return GBT_OK;
}

typedef struct column_rows {
    const int *columns;
    size_t column_count;
    ply_row *row;
    void *context;
} column_rows;

static gbt_status use_columns(void *context, const double *values, const kept_list *list, gbt_error *err)
{
    (void)list;
    (void)err;
    const column_rows *rows = context;
    double wanted[PLY_MAX_COLUMNS];
    for (size_t j = 0; j < rows->column_count; j++)
        wanted[j] = values[rows->columns[j]];
    rows->row(rows->context, wanted);
    return GBT_OK;
}

gbt_status ply_read_rows(const source_file *file, const ply_header *header, int element, const int *columns,
                         size_t column_count, ply_row *row, void *context, gbt_error *err)
{
    column_rows rows = {columns, column_count, row, context};
    for (size_t j = 0; j < column_count; j++) {
        const ply_property *p =
            &header->properties[header->elements[element].first_property + (size_t)columns[j]];
        if (p->is_list)
            return base_fail(err, GBT_ERR_FORMAT, "%s: property %.*s is a list (wanted a number)", file->name,
                             p->name_length < 60 ? (int)p->name_length : 60, p->name);
    }
    return read_rows(file, header, element, &(kept_list){.property = -1}, use_columns, &rows, err);
}

typedef struct list_rows {
    ply_list *take;
    void *context;
} list_rows;

static gbt_status use_list(void *context, const double *values, const kept_list *list, gbt_error *err)
{
    (void)values;
    const list_rows *rows = context;
    return rows->take(rows->context, list->items, list->count, err);
}

gbt_status ply_read_lists(const source_file *file, const ply_header *header, int element, int property,
                          ply_list *take, void *context, gbt_error *err)
{
    kept_list list = {.property = property};
    const gbt_status status =
        read_rows(file, header, element, &list, use_list, &(list_rows){take, context}, err);
    mem_free(list.items);
    return status;
}

typedef struct point_rows {
    raw_scene *out;
    bool has_color;
    double color_scale[3];
} point_rows;

static void add_point_row(void *context, const double *values)
{
    const point_rows *rows = context;
    float color[3] = {0.5f, 0.5f, 0.5f};
    for (int k = 0; k < 3 && rows->has_color; k++)
        color[k] = (float)(values[3 + k] / rows->color_scale[k]);
    raw_add_point(rows->out, values, color);
}

gbt_status ply_read_points(const source_file *file, raw_scene *out, gbt_error *err)
{
    static const char *const names[9] = {
        "x", "y", "z", "red", "green", "blue", "diffuse_red", "diffuse_green", "diffuse_blue"};
    ply_header header;
    GBT_TRY(ply_read_header(file, &header, err));
    const int vertex = ply_find_element(&header, "vertex");
    if (vertex < 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no element vertex in the header", file->name);
    const ply_element *e = &header.elements[vertex];
    int columns[6];
    point_rows rows = {.out = out, .has_color = true};
    for (int k = 0; k < 6; k++) {
        columns[k] = ply_find_property(&header, vertex, names[k]);
        if (columns[k] < 0 && k >= 3)
            columns[k] = ply_find_property(&header, vertex, names[k + 3]);
        const ply_property *p =
            columns[k] < 0 ? NULL : &header.properties[e->first_property + (size_t)columns[k]];
        const bool usable = p != NULL && !p->is_list;
        if (!usable && k < 3)
            return base_fail(err, GBT_ERR_FORMAT, "%s: element vertex has no property %s", file->name,
                             names[k]);
        if (k >= 3) {
            rows.has_color = rows.has_color && usable;
            const bool is_whole = usable && p->type != PLY_FLOAT && p->type != PLY_DOUBLE;
            const bool has_sign =
                usable && (p->type == PLY_INT8 || p->type == PLY_INT16 || p->type == PLY_INT32);
            rows.color_scale[k - 3] = is_whole ? ldexp(1, 8 * (int)type_bytes[p->type] - has_sign) - 1 : 1;
        }
    }
    cursor c = {.file = file, .at = header.data_at};
    if (vertex == 0)
        GBT_TRY(check_count(file, &c, &header, e, err));
    /* Where other elements come first, the exact position of the vertices is not known yet. All remaining
       bytes are still an upper bound: x, y and z take at least one byte each. */
    if (e->count > cursor_left(&c) / 3)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %llu vertices cannot be in %zu bytes", file->name,
                         (unsigned long long)e->count, file->size);
    GBT_TRY(raw_reserve_points(out, (size_t)e->count, err));
    out->has_color = rows.has_color;
    return ply_read_rows(file, &header, vertex, columns, rows.has_color ? 6 : 3, add_point_row, &rows, err);
}
