/* SPDX-License-Identifier: Apache-2.0 */
/* data/ply_header.c -- parses the header of a PLY file. */

#include "data/number.h"
#include "data/ply.h"

typedef struct header_line {
    const char *at, *end;
    raw_place place;
} header_line;

typedef struct word {
    const char *text;
    size_t length;
} word;

static bool word_is(word w, const char *text)
{
    return strlen(text) == w.length && memcmp(w.text, text, w.length) == 0;
}

static bool next_word(header_line *line, word *out)
{
    return number_next_token(&line->at, line->end, &out->text, &out->length);
}

static int shown(word w) { return w.length < 60 ? (int)w.length : 60; }

static gbt_status take_word(header_line *line, const char *what, word *out, gbt_error *err)
{
    return next_word(line, out) ? GBT_OK : raw_fail(err, line->place, "line ends before %s", what);
}

static gbt_status take_type(header_line *line, ply_type *type, gbt_error *err)
{
    static const char *const names[PLY_TYPE_COUNT][2] = {
        [PLY_INT8] = {"char", "int8"},      [PLY_UINT8] = {"uchar", "uint8"},
        [PLY_INT16] = {"short", "int16"},   [PLY_UINT16] = {"ushort", "uint16"},
        [PLY_INT32] = {"int", "int32"},     [PLY_UINT32] = {"uint", "uint32"},
        [PLY_FLOAT] = {"float", "float32"}, [PLY_DOUBLE] = {"double", "float64"},
    };
    word w;
    GBT_TRY(take_word(line, "the type", &w, err));
    for (int i = 0; i < PLY_TYPE_COUNT; i++)
        if (word_is(w, names[i][0]) || word_is(w, names[i][1])) {
            *type = (ply_type)i;
            return GBT_OK;
        }
    return raw_fail(err, line->place, "unknown property type: %.*s", shown(w), w.text);
}

static gbt_status read_format(header_line *line, ply_header *out, gbt_error *err)
{
    word format, version;
    GBT_TRY(take_word(line, "the format", &format, err));
    GBT_TRY(take_word(line, "the version", &version, err));
    if (word_is(format, "ascii"))
        out->format = PLY_ASCII;
    else if (word_is(format, "binary_little_endian"))
        out->format = PLY_LITTLE_ENDIAN;
    else if (word_is(format, "binary_big_endian"))
        out->format = PLY_BIG_ENDIAN;
    else
        return raw_fail(err, line->place, "unknown format: %.*s", shown(format), format.text);
    if (!word_is(version, "1.0"))
        return raw_fail(err, line->place, "unknown version (wanted 1.0, got %.*s)", shown(version),
                        version.text);
    return GBT_OK;
}

static gbt_status read_element(header_line *line, ply_header *out, gbt_error *err)
{
    word name, count;
    GBT_TRY(take_word(line, "the element's name", &name, err));
    GBT_TRY(take_word(line, "the element's count", &count, err));
    if (out->element_count == PLY_MAX_ELEMENTS)
        return raw_fail(err, line->place, "too many elements (wanted at most %d)", PLY_MAX_ELEMENTS);
    for (size_t i = 0; i < out->element_count; i++)
        if (out->elements[i].name_length == name.length &&
            memcmp(out->elements[i].name, name.text, name.length) == 0)
            return raw_fail(err, line->place, "duplicate element: %.*s", shown(name), name.text);
    ply_element *element = &out->elements[out->element_count++];
    *element =
        (ply_element){.name = name.text, .name_length = name.length, .first_property = out->property_count};
    if (number_parse_u64(count.text, count.length, &element->count) != NUMBER_OK)
        return raw_fail(err, line->place, "bad count of element %.*s: %.*s", shown(name), name.text,
                        shown(count), count.text);
    return GBT_OK;
}

static gbt_status read_property(header_line *line, ply_header *out, gbt_error *err)
{
    if (out->element_count == 0)
        return raw_fail(err, line->place, "property before any element");
    if (out->property_count == PLY_MAX_PROPERTIES)
        return raw_fail(err, line->place, "too many properties (wanted at most %d)", PLY_MAX_PROPERTIES);
    ply_element *element = &out->elements[out->element_count - 1];
    ply_property property = {0};
    const char *type_at = line->at;
    word w;
    GBT_TRY(take_word(line, "the type", &w, err));
    if (word_is(w, "list")) {
        property.is_list = true;
        GBT_TRY(take_type(line, &property.count_type, err));
        if (property.count_type == PLY_FLOAT || property.count_type == PLY_DOUBLE)
            return raw_fail(err, line->place, "a list cannot be counted in floats");
    } else {
        line->at = type_at;
    }
    GBT_TRY(take_type(line, &property.type, err));
    GBT_TRY(take_word(line, "the property's name", &w, err));
    property.name = w.text;
    property.name_length = w.length;
    for (size_t i = element->first_property; i < out->property_count; i++)
        if (out->properties[i].name_length == w.length &&
            memcmp(out->properties[i].name, w.text, w.length) == 0)
            return raw_fail(err, line->place, "duplicate property: %.*s", shown(w), w.text);
    out->properties[out->property_count++] = property;
    element->property_count++;
    return GBT_OK;
}

gbt_status ply_read_header(const source_file *file, ply_header *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    const size_t limit = file->size < PLY_MAX_HEADER_BYTES ? file->size : PLY_MAX_HEADER_BYTES;
    const char *text = (const char *)file->bytes;
    bool has_format = false;
    for (size_t at = 0;;) {
        const char *newline = at < limit ? memchr(text + at, '\n', limit - at) : NULL;
        out->line_count++;
        header_line line = {.at = text + at, .end = newline, .place = {file->name, ':', out->line_count}};
        if (out->line_count == 1) {
            word magic = {0};
            if (newline == NULL || !next_word(&line, &magic) || !word_is(magic, "ply"))
                return raw_fail(err, line.place, "not a PLY file (wanted the line \"ply\")");
        }
        if (newline == NULL)
            return raw_fail(err, line.place, "header does not end (wanted end_header within %d bytes)",
                            PLY_MAX_HEADER_BYTES);
        at = (size_t)(newline - text) + 1;
        word keyword;
        if (out->line_count == 1 || !next_word(&line, &keyword))
            continue;
        if (word_is(keyword, "end_header")) {
            out->data_at = at;
            break;
        }
        if (word_is(keyword, "format")) {
            if (has_format)
                return raw_fail(err, line.place, "second format line");
            has_format = true;
            GBT_TRY(read_format(&line, out, err));
        } else if (word_is(keyword, "element")) {
            GBT_TRY(read_element(&line, out, err));
        } else if (word_is(keyword, "property")) {
            GBT_TRY(read_property(&line, out, err));
        } else if (!word_is(keyword, "comment") && !word_is(keyword, "obj_info")) {
            return raw_fail(err, line.place, "unknown header line: %.*s", shown(keyword), keyword.text);
        }
    }
    if (!has_format)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no format line in the header", file->name);
    return GBT_OK;
}

int ply_find_element(const ply_header *header, const char *name)
{
    for (size_t i = 0; i < header->element_count; i++)
        if (word_is((word){header->elements[i].name, header->elements[i].name_length}, name))
            return (int)i;
    return -1;
}

int ply_find_property(const ply_header *header, int element, const char *name)
{
    const ply_element *e = &header->elements[element];
    for (size_t i = 0; i < e->property_count; i++) {
        const ply_property *p = &header->properties[e->first_property + i];
        if (word_is((word){p->name, p->name_length}, name))
            return (int)i;
    }
    return -1;
}
