/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_ply.c -- reads plain 3DGS models (.ply). */
#include "data/gaussian_ply.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/compare.h"
#include "data/compressed_ply.h"
#include "data/number.h"
#include "data/ply.h"

enum {
    COLUMN_MEAN = 0,
    COLUMN_OPACITY = 3,
    COLUMN_SCALE = 4,
    COLUMN_ROT = 7,
    COLUMN_DC = 11,
    COLUMN_REST = 14,
    FIXED_COLUMNS = 14
};

typedef struct gaussian_rows {
    gaussian_cloud *out;
    size_t rest_count; /* f_rest properties: 0, 9, 24 or 45 */
    bool has_filter;   /* filter_3D is the column after them */
} gaussian_rows;

/* Apply the 3D smoothing filter of Mip-Splatting (Yu 2024): widen each axis and lower the opacity in
   proportion. The files store the filter size next to the unfiltered Gaussian. */
static void widen(gaussian_row *row, double filter)
{
    for (int k = 0; k < 3 && filter != 0; k++) {
        const double before = exp(2 * row->scale_log[k]), after = before + filter * filter;
        row->opacity *= sqrt(before / after);
        row->scale_log[k] = 0.5 * log(after);
    }
}

static void add_row(void *context, const double *values)
{
    const gaussian_rows *rows = context;
    gaussian_row row = {.opacity = 1 / (1 + exp(-values[COLUMN_OPACITY]))};
    for (size_t k = 0; k < 3; k++)
        row.mean[k] = values[COLUMN_MEAN + k] - rows->out->origin[k];
    memcpy(row.scale_log, values + COLUMN_SCALE, sizeof row.scale_log);
    memcpy(row.quat, values + COLUMN_ROT, sizeof row.quat);
    /* f_rest is channel-major in the file: all of red, then green, then blue. */
    const size_t per_channel = rows->rest_count / 3;
    for (size_t channel = 0; channel < 3; channel++) {
        row.sh[0][channel] = values[COLUMN_DC + channel];
        for (size_t k = 0; k < per_channel; k++)
            row.sh[1 + k][channel] = values[COLUMN_REST + channel * per_channel + k];
    }
    if (rows->has_filter)
        widen(&row, values[COLUMN_REST + rows->rest_count]);
    gaussian_cloud_add(rows->out, &row);
}

/* Find the column index of each property; the error message names what is missing. */
static gbt_status find_columns(const source_file *file, const ply_header *header, int vertex, int *columns,
                               size_t *rest_count, bool *has_filter, gbt_error *err)
{
    static const char *const names[FIXED_COLUMNS] = {"x",       "y",       "z",      "opacity", "scale_0",
                                                     "scale_1", "scale_2", "rot_0",  "rot_1",   "rot_2",
                                                     "rot_3",   "f_dc_0",  "f_dc_1", "f_dc_2"};
    const ply_element *e = &header->elements[vertex];
    if (ply_find_property(header, vertex, "f_anchor_feat_0") >= 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: holds anchors of a neural model, not Gaussians (see gbtrace import)",
                         file->name);
    if (ply_find_property(header, vertex, "f_dc_0") < 0 && ply_find_property(header, vertex, "opacity") < 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: is a point cloud, not a Gaussian model (no property f_dc_0 nor opacity)",
                         file->name);
    for (int k = 0; k < FIXED_COLUMNS; k++) {
        columns[k] = ply_find_property(header, vertex, names[k]);
        if (columns[k] < 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s: element vertex has no property %s", file->name,
                             names[k]);
    }
    size_t rest = 0;
    for (; FIXED_COLUMNS + rest < PLY_MAX_COLUMNS; rest++) {
        char name[32];
        snprintf(name, sizeof name, "f_rest_%zu", rest);
        columns[FIXED_COLUMNS + rest] = ply_find_property(header, vertex, name);
        if (columns[FIXED_COLUMNS + rest] < 0)
            break;
    }
    size_t named = 0;
    for (size_t k = 0; k < e->property_count; k++) {
        const ply_property *p = &header->properties[e->first_property + k];
        named += p->name_length > 7 && memcmp(p->name, "f_rest_", 7) == 0;
    }
    if (rest != named)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %zu f_rest properties that are not numbered from 0 on",
                         file->name, named);
    if (rest != 0 && rest != 9 && rest != 24 && rest != 45)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: wrong number of f_rest properties (wanted 0, 9, 24 or 45, got %zu)", file->name,
                         rest);
    columns[FIXED_COLUMNS + rest] = ply_find_property(header, vertex, "filter_3D");
    *has_filter = columns[FIXED_COLUMNS + rest] >= 0;
    for (size_t k = 0; k < FIXED_COLUMNS + rest + *has_filter; k++)
        if (header->properties[e->first_property + (size_t)columns[k]].is_list)
            return base_fail(err, GBT_ERR_FORMAT, "%s: property %zu of the Gaussians is a list", file->name,
                             k);
    *rest_count = rest;
    return GBT_OK;
}

/* ---- the origin of coordinates in double ---- */

enum { SAMPLE_ROWS = 1024 };

/* Means of rows all over the file. */
typedef struct mean_sample {
    size_t row_count, row; /* of the file; how many of them were offered */
    size_t taken, count;   /* rows taken so far; how many of them are usable */
    double values[3][SAMPLE_ROWS];
} mean_sample;

/* The next row that belongs to the sample; `row_count` when there is none. */
static size_t next_sample_row(const mean_sample *s)
{
    const size_t wanted = smaller_size(s->row_count, SAMPLE_ROWS);
    return s->taken < wanted ? (size_t)((uint64_t)s->taken * s->row_count / wanted) : s->row_count;
}

static void take_sample_row(void *context, const double *mean)
{
    mean_sample *s = context;
    s->taken++;
    if (!(fabs(mean[0]) <= RAW_COORDINATE_LIMIT && fabs(mean[1]) <= RAW_COORDINATE_LIMIT &&
          fabs(mean[2]) <= RAW_COORDINATE_LIMIT))
        return;
    for (size_t k = 0; k < 3; k++)
        s->values[k][s->count] = mean[k];
    s->count++;
}

static void offer_row(void *context, const double *mean)
{
    mean_sample *s = context;
    if (s->row++ == next_sample_row(s))
        take_sample_row(s, mean);
}

/* Around their median floats keep the digits of map coordinates. */
static void find_origin(mean_sample *s, double origin[3])
{
    for (size_t k = 0; k < 3 && s->count > 0; k++) {
        qsort(s->values[k], s->count, sizeof *s->values[k], compare_doubles);
        origin[k] = round(s->values[k][s->count / 2]) + 0.0; /* never -0 */
    }
}

static bool is_double(const ply_header *header, int vertex, const int *columns)
{
    return header->properties[header->elements[vertex].first_property + (size_t)columns[COLUMN_MEAN]].type ==
           PLY_DOUBLE;
}

static int degree_of(size_t rest_count)
{
    return rest_count == 45 ? 3 : rest_count == 24 ? 2 : rest_count == 9 ? 1 : 0;
}

static gbt_status read_plain(const source_file *file, const ply_header *header, int vertex,
                             gaussian_cloud *out, gbt_error *err)
{
    int columns[PLY_MAX_COLUMNS + 1];
    gaussian_rows rows = {.out = out};
    GBT_TRY(find_columns(file, header, vertex, columns, &rows.rest_count, &rows.has_filter, err));
    /* Every column takes at least one byte, so memory is bounded by a small multiple of the file size. */
    const uint64_t row_count = header->elements[vertex].count, least_bytes = FIXED_COLUMNS + rows.rest_count;
    if (row_count > (file->size - header->data_at) / least_bytes)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: %llu Gaussians cannot be in the %zu bytes that follow",
                         file->name, header->data_at, (unsigned long long)row_count,
                         file->size - header->data_at);
    mean_sample sample = {.row_count = (size_t)row_count};
    if (is_double(header, vertex, columns))
        GBT_TRY(ply_read_rows(file, header, vertex, columns, 3, offer_row, &sample, err));
    GBT_TRY(gaussian_cloud_alloc(out, (size_t)row_count, err));
    find_origin(&sample, out->origin);
    out->count = 0; /* counts the usable rows from here on */
    out->sh_degree = degree_of(rows.rest_count);
    return ply_read_rows(file, header, vertex, columns, FIXED_COLUMNS + rows.rest_count + rows.has_filter,
                         add_row, &rows, err);
}

/* The near distance from the header comment; 0 when it is missing or unusable. */
static float near_of(const source_file *file, const ply_header *header)
{
    static const char mark[] = "\n" GAUSSIAN_PLY_NEAR;
    const char *text = memmem(file->bytes, header->data_at, mark, sizeof mark - 1);
    double near;
    if (text == NULL)
        return 0;
    text += sizeof mark - 1;
    const char *end = (const char *)file->bytes + header->data_at;
    size_t length = 0;
    while (text + length < end && text[length] != '\n' && text[length] != '\r')
        length++;
    return number_parse_double(text, length, &near) == NUMBER_OK ? gaussian_cloud_near(near) : 0;
}

/* Whether the header contains this text. */
static bool header_contains(const source_file *file, const ply_header *header, const char *line)
{
    return memmem(file->bytes, header->data_at, line, strlen(line)) != NULL;
}

gbt_status gaussian_ply_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    ply_header header;
    GBT_TRY(ply_read_header(file, &header, err));
    const int vertex = ply_find_element(&header, "vertex");
    if (vertex < 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no element vertex in the header", file->name);
    gbt_status status = compressed_ply_is(&header) ? compressed_ply_read(file, &header, out, err)
                                                   : read_plain(file, &header, vertex, out, err);
    out->antialiased = header_contains(file, &header, "\n" GAUSSIAN_PLY_MIP) ||
                       header_contains(file, &header, "\ncomment antialiased 1");
    out->near = near_of(file, &header);
    if (status == GBT_OK && out->count == 0)
        status = base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu rows dropped)", file->name,
                           out->dropped);
    if (status != GBT_OK)
        gaussian_cloud_free(out);
    return status;
}

bool gaussian_ply_has_gaussians(const source_file *file)
{
    ply_header header;
    if (ply_read_header(file, &header, NULL) != GBT_OK)
        return false;
    const int vertex = ply_find_element(&header, "vertex");
    return compressed_ply_is(&header) || (vertex >= 0 && ply_find_property(&header, vertex, "f_dc_0") >= 0 &&
                                          ply_find_property(&header, vertex, "rot_0") >= 0);
}

/* ---- reading in parts ---- */

/* Read rows as a file of their own: `column_count` of the columns. */
static gbt_status read_rows(const gaussian_ply_parts *parts, size_t first, size_t count, unsigned char *bytes,
                            size_t column_count, ply_row *row, void *context, gbt_error *err)
{
    const size_t size = count * parts->row_bytes;
    GBT_TRY(large_file_read(&parts->file, parts->header.data_at + (uint64_t)first * parts->row_bytes, bytes,
                            size, err));
    ply_header header = parts->header;
    header.element_count = 1;
    header.elements[0].count = count;
    header.data_at = 0;
    const source_file file = {parts->file.name, bytes, size};
    return ply_read_rows(&file, &header, 0, parts->columns, column_count, row, context, err);
}

/* The origin that gaussian_ply_read() finds. */
static gbt_status find_origin_of_parts(gaussian_ply_parts *parts, gbt_error *err)
{
    mean_sample sample = {.row_count = parts->count};
    unsigned char *bytes = mem_alloc(parts->row_bytes, 1, "a row of Gaussians", err);
    gbt_status status = bytes == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t row; status == GBT_OK && (row = next_sample_row(&sample)) < parts->count;)
        status = read_rows(parts, row, 1, bytes, 3, take_sample_row, &sample, err);
    mem_free(bytes);
    find_origin(&sample, parts->origin);
    return status;
}

static gbt_status open_parts(const char *path, gaussian_ply_parts *out, gbt_error *err)
{
    GBT_TRY(large_file_open(path, &out->file, err));
    const size_t size = out->file.size < PLY_MAX_HEADER_BYTES ? (size_t)out->file.size : PLY_MAX_HEADER_BYTES;
    out->head = mem_alloc(size + 1, 1, "header", err);
    if (out->head == NULL)
        return GBT_ERR_NO_MEMORY;
    GBT_TRY(large_file_read(&out->file, 0, out->head, size, err));
    const source_file head = {path, out->head, size};
    ply_header *header = &out->header;
    GBT_TRY(ply_read_header(&head, header, err));
    const int vertex = ply_find_element(header, "vertex");
    if (vertex != 0 || compressed_ply_is(header) || ply_row_bytes(header, vertex) == 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: cannot be read by parts (wanted a binary .ply that begins with its Gaussians)",
                         path);
    GBT_TRY(find_columns(&head, header, vertex, out->columns, &out->rest_count, &out->has_filter, err));
    out->row_bytes = ply_row_bytes(header, vertex);
    const uint64_t rows = header->elements[vertex].count;
    if (rows > (out->file.size - header->data_at) / out->row_bytes)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@%zu: %llu Gaussians cannot be in the %llu bytes that follow", path,
                         header->data_at, (unsigned long long)rows,
                         (unsigned long long)(out->file.size - header->data_at));
    out->count = (size_t)rows;
    out->sh_degree = degree_of(out->rest_count);
    out->antialiased = header_contains(&head, header, "\n" GAUSSIAN_PLY_MIP) ||
                       header_contains(&head, header, "\ncomment antialiased 1");
    out->near = near_of(&head, header);
    return is_double(header, vertex, out->columns) ? find_origin_of_parts(out, err) : GBT_OK;
}

gbt_status gaussian_ply_open(const char *path, gaussian_ply_parts *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    const gbt_status status = open_parts(path, out, err);
    if (status != GBT_OK)
        gaussian_ply_close(out);
    return status;
}

typedef struct part_rows {
    gaussian_rows rows;
    uint32_t number, *kept;
} part_rows;

static void add_part_row(void *context, const double *values)
{
    part_rows *part = context;
    const size_t before = part->rows.out->count;
    add_row(&part->rows, values);
    if (part->rows.out->count > before)
        part->kept[before] = part->number;
    part->number++;
}

gbt_status gaussian_ply_part(const gaussian_ply_parts *parts, size_t first, size_t count,
                             unsigned char *bytes, gaussian_cloud *out, uint32_t *kept, gbt_error *err)
{
    part_rows part = {.rows = {out, parts->rest_count, parts->has_filter}, .kept = kept};
    memcpy(out->origin, parts->origin, sizeof out->origin);
    out->count = 0;
    out->sh_degree = parts->sh_degree;
    return read_rows(parts, first, count, bytes, FIXED_COLUMNS + parts->rest_count + parts->has_filter,
                     add_part_row, &part, err);
}

void gaussian_ply_close(gaussian_ply_parts *parts)
{
    large_file_close(&parts->file, false, NULL);
    mem_free(parts->head);
    memset(parts, 0, sizeof *parts);
}
