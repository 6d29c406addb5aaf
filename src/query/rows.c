/* SPDX-License-Identifier: Apache-2.0 */
/* query/rows.c -- rows of numbers from text and from PLY. */
#include "query/rows.h"

#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/number.h"
#include "data/ply.h"

void query_rows_free(query_rows *rows)
{
    mem_free(rows->value);
    *rows = (query_rows){0};
}

static gbt_status add_row(query_rows *rows, const double *values, gbt_error *err)
{
    GBT_TRY(mem_reserve((void **)&rows->value, &rows->capacity, rows->count, rows->count + 1,
                        rows->width * sizeof *rows->value, "rows", err));
    memcpy(rows->value + rows->count * rows->width, values, rows->width * sizeof *values);
    rows->count++;
    return GBT_OK;
}

/* ---- text ---- */

/* The numbers of a line; false when something is not a number, or one is missing between commas. */
static bool read_line(const char *at, const char *end, double value[ROW_WIDTH_MAX + 1], size_t *count)
{
    bool missing = true; /* no number since the last comma, or the begin of the line */
    *count = 0;
    while (at < end && *at != '#') {
        const char *token = at;
        while (at < end && strchr(" \t\r,#", *at) == NULL)
            at++;
        if (at > token) {
            if (*count > ROW_WIDTH_MAX ||
                number_parse_double(token, (size_t)(at - token), &value[*count]) != NUMBER_OK)
                return false;
            ++*count;
            missing = false;
        }
        if (at < end && *at == ',') {
            if (missing)
                return false;
            missing = true;
        }
        if (at < end && *at != '#')
            at++;
    }
    return true;
}

static gbt_status bad_width(const char *name, size_t line, size_t count, size_t least, size_t most,
                            gbt_error *err)
{
    return least == most ? base_fail(err, GBT_ERR_FORMAT, "%.400s:%zu: %zu numbers (wanted %zu)", name, line,
                                     count, least)
                         : base_fail(err, GBT_ERR_FORMAT,
                                     "%.400s:%zu: %zu numbers (wanted %zu to %zu, the same in all rows)",
                                     name, line, count, least, most);
}

gbt_status query_rows_parse(const char *name, const char *text, size_t size, size_t least, size_t most,
                            query_rows *out, gbt_error *err)
{
    const char *at = text + file_mark_bytes(text, size), *const end = text + size;
    for (size_t line = 1; at < end; line++) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        stop = stop != NULL ? stop : end;
        double value[ROW_WIDTH_MAX + 1];
        size_t count;
        if (memchr(at, '\0', (size_t)(stop - at)) != NULL || !read_line(at, stop, value, &count))
            return base_fail(err, GBT_ERR_FORMAT, "%.400s:%zu: not a row of numbers", name, line);
        if (count > 0) {
            if (count < least || count > most || (out->width > 0 && count != out->width))
                return bad_width(name, line, count, least, most, err);
            out->width = count;
            GBT_TRY(add_row(out, value, err));
        }
        at = stop < end ? stop + 1 : end;
    }
    return GBT_OK;
}

/* ---- PLY ---- */

typedef struct ply_job {
    query_rows *out;
    gbt_status status;
    gbt_error *err;
} ply_job;

static void take_vertex(void *context, const double *values)
{
    ply_job *job = context;
    if (job->status == GBT_OK)
        job->status = add_row(job->out, values, job->err);
}

static gbt_status read_ply(const source_file *file, size_t least, size_t most, query_rows *out,
                           gbt_error *err)
{
    ply_header header;
    GBT_TRY(ply_read_header(file, &header, err));
    static const char *const names[4] = {"x", "y", "z", "radius"};
    const int vertex = ply_find_element(&header, "vertex");
    int columns[4];
    for (size_t i = 0; i < 4; i++)
        columns[i] = vertex >= 0 ? ply_find_property(&header, vertex, names[i]) : -1;
    if (columns[0] < 0 || columns[1] < 0 || columns[2] < 0)
        return base_fail(err, GBT_ERR_FORMAT, "%.400s: no vertices with x y z", file->name);
    if (least > 4)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%.400s: vertices have no direction (wanted lines of %zu numbers)", file->name,
                         least);
    out->width = columns[3] >= 0 && most >= 4 ? 4 : 3;
    ply_job job = {out, GBT_OK, err};
    GBT_TRY(ply_read_rows(file, &header, vertex, columns, out->width, take_vertex, &job, err));
    return job.status;
}

gbt_status query_rows_read(const char *path, size_t least, size_t most, query_rows *out, gbt_error *err)
{
    unsigned char *bytes;
    size_t size;
    GBT_TRY(file_read(path, &bytes, &size, err));
    const gbt_status status =
        file_ends_with(path, ".ply")
            ? read_ply(&(source_file){.name = path, .bytes = bytes, .size = size}, least, most, out, err)
            : query_rows_parse(path, (const char *)bytes, size, least, most, out, err);
    mem_free(bytes);
    return status;
}
