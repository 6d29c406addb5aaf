/* SPDX-License-Identifier: Apache-2.0 */
/* report/log.c -- read log.csv of a run into arrays. */
#include "report/log.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

enum { FIELD_LIMIT = 128 };

static const char *const column_names[LOG_COLUMNS] = {
    "step",
    "seconds",
    "loss",
    "train_psnr",
    "anchors",
    "gaussians",
    "rays_per_second",
    "blended_per_ray",
    "memory_bytes",
    "photo_ms",
    "rays_ms",
    "visible_ms",
    "decode_ms",
    "build_ms",
    "trace_ms",
    "loss_ms",
    "adjoint_ms",
    "decode_adjoint_ms",
    "optimizer_ms",
    "adjust_ms",
};

/** Split a line at its commas, in place. Fields beyond FIELD_LIMIT are ignored. */
static size_t split_fields(char *line, char **fields)
{
    size_t count = 0;
    for (char *rest = line; rest != NULL && count < FIELD_LIMIT;)
        fields[count++] = strsep(&rest, ",");
    return count;
}

/** The next whole line at *at, terminated in place; NULL if there is none. A killed run may leave a torn last
    line. */
static char *next_line(char **at)
{
    char *line = *at, *end = strchr(line, '\n');
    if (end == NULL)
        return NULL;
    *end = '\0';
    *at = end + 1;
    if (end > line && end[-1] == '\r')
        end[-1] = '\0';
    return line;
}

static double parse_field(const char *field)
{
    char *end;
    const double value = strtod(field, &end);
    return end != field && *end == '\0' && isfinite(value) ? value : (double)NAN;
}

static void add_row(training_log *log, const double row[LOG_COLUMNS])
{
    while (log->count > 0 && log->column[LOG_STEP][log->count - 1] > row[LOG_STEP]) /* the run was resumed
                                                                                       from an earlier step */
        log->count--;
    if (log->count > 0 && log->column[LOG_SECONDS][log->count - 1] > row[LOG_SECONDS])
        return;
    for (int i = 0; i < LOG_COLUMNS; i++)
        log->column[i][log->count] = row[i];
    log->count++;
}

static void read_rows(char *at, training_log *log)
{
    char *fields[FIELD_LIMIT], *line = next_line(&at);
    if (line == NULL)
        return;
    const size_t field_count = split_fields(line, fields);
    size_t place[LOG_COLUMNS];
    for (int i = 0; i < LOG_COLUMNS; i++) {
        place[i] = field_count;
        for (size_t j = 0; j < field_count; j++)
            if (strcmp(fields[j], column_names[i]) == 0)
                place[i] = j;
    }
    while ((line = next_line(&at)) != NULL) {
        if (split_fields(line, fields) != field_count)
            continue;
        double row[LOG_COLUMNS];
        for (int i = 0; i < LOG_COLUMNS; i++)
            row[i] = place[i] < field_count ? parse_field(fields[place[i]]) : (double)NAN;
        /* A held-out score logged right after a row covers no steps: its means are zeros, not measurements.
         */
        if (row[LOG_RAYS_PER_SECOND] <= 0)
            for (int i = LOG_LOSS; i < LOG_COLUMNS; i++)
                if (i != LOG_ANCHORS && i != LOG_MEMORY)
                    row[i] = (double)NAN;
        if (isfinite(row[LOG_STEP]) && isfinite(row[LOG_SECONDS]))
            add_row(log, row);
    }
}

gbt_status training_log_read(const char *path, training_log *out, gbt_error *err)
{
    *out = (training_log){0};
    unsigned char *bytes;
    size_t byte_count, line_count = 0;
    gbt_error ignored = {0};
    const gbt_status status = file_read(path, &bytes, &byte_count, &ignored);
    if (status == GBT_ERR_NO_MEMORY)
        return base_fail(err, status, "%s", ignored.text);
    if (status != GBT_OK)
        return GBT_OK;
    for (size_t i = 0; i < byte_count; i++)
        line_count += bytes[i] == '\n';
    double *block = mem_alloc(line_count + 1, LOG_COLUMNS * sizeof *block, "log.csv", err);
    if (block == NULL) {
        mem_free(bytes);
        return GBT_ERR_NO_MEMORY;
    }
    for (int i = 0; i < LOG_COLUMNS; i++)
        out->column[i] = block + (size_t)i * (line_count + 1);
    read_rows((char *)bytes, out);
    mem_free(bytes);
    return GBT_OK;
}

void training_log_free(training_log *log)
{
    mem_free(log->column[0]);
    *log = (training_log){0};
}

void training_log_smooth(const training_log *log, log_column column, double reach_seconds, double *out)
{
    const double *seconds = log->column[LOG_SECONDS], *value = log->column[column];
    size_t first = 0, end = 0, finite_count = 0;
    double sum = 0;
    for (size_t i = 0; i < log->count; i++) {
        for (; end < log->count && seconds[end] <= seconds[i] + reach_seconds; end++)
            if (isfinite(value[end])) {
                sum += value[end];
                finite_count++;
            }
        for (; seconds[first] < seconds[i] - reach_seconds; first++)
            if (isfinite(value[first])) {
                sum -= value[first];
                finite_count--;
            }
        out[i] = finite_count > 0 ? sum / (double)finite_count : (double)NAN;
    }
}
