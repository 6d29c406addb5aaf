/* SPDX-License-Identifier: Apache-2.0 */
/* query/answer.c -- queries of a file, answered as CSV. */
#include <math.h>
#include <string.h>

#include "base/def.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "data/number.h"
#include "gbtrace/query.h"
#include "query/rows.h"

gbt_query_def gbt_query_def_default(void) { return (gbt_query_def){.k = 1, .cookie_ = DEF_COOKIE}; }

static gbt_status check(const gbt_query_def *def, gbt_error *err)
{
    GBT_TRY(def_check(def->cookie_, "gbt_query_def_default", err));
    if ((unsigned)def->kind > GBT_QUERY_CROSSED)
        return base_fail(err, GBT_ERR_ARGUMENT, "kind: %d (wanted 0 to %d)", (int)def->kind,
                         (int)GBT_QUERY_CROSSED);
    if ((def->at == NULL) == (def->from == NULL))
        return base_fail(err, GBT_ERR_ARGUMENT, "at, from: %s given (wanted exactly one of them)",
                         def->at == NULL ? "neither is" : "both are");
    if (def->k < 1 || def->k > 1000000)
        return base_fail(err, GBT_ERR_ARGUMENT, "k: %d (wanted 1 to 1000000)", def->k);
    if (!(def->radius >= 0))
        return base_fail(err, GBT_ERR_ARGUMENT, "radius: %g (wanted 0 or more)", def->radius);
    return GBT_OK;
}

static gbt_status read_queries(const gbt_query_def *def, query_rows *rows, gbt_error *err)
{
    const bool ray = def->kind == GBT_QUERY_CROSSED,
               round = def->kind == GBT_QUERY_WITHIN || def->kind == GBT_QUERY_OVERLAPPING;
    const size_t least = ray ? 6 : 3, most = ray ? 8 : round ? 4 : 3;
    if (def->at != NULL)
        GBT_TRY(query_rows_parse("at", def->at, strlen(def->at), least, most, rows, err));
    else
        GBT_TRY(query_rows_read(def->from, least, most, rows, err));
    if (rows->count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%.400s: holds no query points",
                         def->at != NULL ? "at" : def->from);
    if (rows->width == 7)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%.400s: 7 numbers for a ray (wanted 6, or 8 with t_min and t_max)",
                         def->at != NULL ? "at" : def->from);
    if (round && rows->width == 3 && def->radius <= 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "radius: 0 (wanted more, or a fourth number for each query point)");
    return GBT_OK;
}

/* Columns `from` .. `from` + `width` - 1 of all rows, [count][width]. NULL when memory ran out. */
static double *take(const query_rows *rows, size_t from, size_t width, gbt_error *err)
{
    double *out = mem_alloc(rows->count, width * sizeof *out, "queries", err);
    for (size_t i = 0; i < rows->count && out != NULL; i++)
        memcpy(out + width * i, rows->value + rows->width * i + from, width * sizeof *out);
    return out;
}

/* ---- out ---- */

static void put(FILE *out, char before, double value)
{
    char text[NUMBER_TEXT_SIZE];
    number_format_double(value, text);
    fprintf(out, "%c%s", before, text);
}

static void print_answer(FILE *out, const gbt_balls_view *v, size_t query, size_t rank, uint32_t ball,
                         double value)
{
    fprintf(out, "%zu,%zu,%u", query, rank, (unsigned)ball);
    put(out, ',', value);
    for (size_t j = 0; j < 3; j++)
        put(out, ',', v->position[3 * (size_t)ball + j]);
    put(out, ',', v->radius != NULL ? v->radius[ball] : 0);
    putc('\n', out);
}

static void print(const gbt_balls *balls, const gbt_query_def *def, const gbt_answers *a, FILE *out)
{
    const gbt_balls_view v = gbt_balls_get(balls);
    fprintf(out, "query,rank,ball,%s,x,y,z,radius\n", def->kind == GBT_QUERY_CROSSED ? "t" : "distance");
    for (size_t i = 0; i < a->count; i++)
        for (size_t at = a->first[i]; at < a->first[i + 1]; at++)
            print_answer(out, &v, i, at - a->first[i], a->index[at], a->value[at]);
}

/* ---- the queries ---- */

static gbt_status nearest(const gbt_balls *balls, const gbt_query_def *def, const double *point, size_t count,
                          gbt_answers *out, gbt_error *err)
{
    const size_t balls_count = gbt_balls_get(balls).count,
                 k = (size_t)def->k < balls_count ? (size_t)def->k : balls_count;
    out->first = mem_alloc(count + 1, sizeof *out->first, "answers", err);
    out->index = mem_alloc(count, k * sizeof *out->index, "answers", err);
    out->value = mem_alloc(count, k * sizeof *out->value, "answers", err);
    if (out->first == NULL || out->index == NULL || out->value == NULL)
        return GBT_ERR_NO_MEMORY;
    out->count = count;
    for (size_t i = 0; i <= count; i++)
        out->first[i] = k * i;
    return k == 0 ? GBT_OK : gbt_balls_nearest(balls, point, count, k, false, out->index, out->value, err);
}

static gbt_status lists(const gbt_balls *balls, const gbt_query_def *def, const query_rows *rows,
                        const double *point, gbt_answers *out, gbt_error *err)
{
    const size_t n = rows->count;
    const bool ray = def->kind == GBT_QUERY_CROSSED;
    double *direction = ray ? take(rows, 3, 3, err) : NULL;
    double *first = rows->width == 4   ? take(rows, 3, 1, err)
                    : rows->width == 8 ? take(rows, 6, 1, err)
                                       : mem_alloc(n, sizeof *first, "queries", err);
    double *second = rows->width == 8 ? take(rows, 7, 1, err) : mem_alloc(n, sizeof *second, "queries", err);
    gbt_status status =
        first == NULL || second == NULL || (ray && direction == NULL) ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t i = 0; i < n && status == GBT_OK; i++) {
        if (rows->width < 4 || rows->width == 6)
            first[i] = ray ? 0 : def->radius;
        if (rows->width != 8)
            second[i] = HUGE_VAL;
    }
    if (status == GBT_OK)
        status = ray ? gbt_balls_crossed(balls, point, direction, first, second, n, out, err)
                 : def->kind == GBT_QUERY_WITHIN ? gbt_balls_within(balls, point, first, n, out, err)
                 : def->kind == GBT_QUERY_CONTAINING
                     ? gbt_balls_containing(balls, point, n, out, err)
                     : gbt_balls_overlapping(balls, point, first, n, out, err);
    mem_free(direction);
    mem_free(first);
    mem_free(second);
    return status;
}

/* Values that no query can have are bad input here, of this file. */
static gbt_status answer(const gbt_balls *balls, const gbt_query_def *def, const query_rows *rows, FILE *out,
                         gbt_error *err)
{
    double *point = take(rows, 0, 3, err);
    if (point == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_error why = {0};
    gbt_answers answers = {0};
    const gbt_status status = def->kind == GBT_QUERY_NEAREST
                                  ? nearest(balls, def, point, rows->count, &answers, &why)
                                  : lists(balls, def, rows, point, &answers, &why);
    if (status == GBT_OK)
        print(balls, def, &answers, out);
    gbt_answers_free(&answers);
    mem_free(point);
    if (status == GBT_ERR_ARGUMENT)
        return base_fail(err, GBT_ERR_FORMAT, "%.400s: %s", def->at != NULL ? "at" : def->from, why.text);
    return status == GBT_OK ? GBT_OK : base_fail(err, status, "%s", why.text);
}

gbt_status gbt_query(const char *path, const gbt_query_def *def, FILE *out, gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(check(def, err));
    query_rows rows = {0};
    gbt_balls *balls = NULL;
    gbt_status status = read_queries(def, &rows, err);
    if (status == GBT_OK)
        status = gbt_balls_open(path, &balls, err);
    if (status == GBT_OK)
        status = answer(balls, def, &rows, out, err);
    gbt_balls_free(balls);
    query_rows_free(&rows);
    if (status == GBT_OK && ferror(out))
        return base_fail(err, GBT_ERR_IO, "query: the answers could not be written");
    return status;
}
