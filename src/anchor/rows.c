/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/rows.c -- allocation and reordering of arrays that have one row per anchor. */
#include "anchor/rows.h"

#include <string.h>

#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"

int row_field_dims(const row_field *field, size_t count, size_t offset_count, size_t dims[ROWS_DIMS_MAX])
{
    int n = 0;
    dims[n++] = count;
    if (field->per_offset)
        dims[n++] = offset_count;
    if (field->width > 1)
        dims[n++] = field->width;
    return n;
}

gbt_status rows_resize(float **arrays, const row_field *fields, int field_count, int offset_count,
                       size_t *capacity, size_t used, size_t count, const char *what, gbt_error *err)
{
    const size_t kept = count < used ? count : used;
    if (count > *capacity || arrays[0] == NULL) {
        size_t wanted = *capacity + *capacity / 2;
        if (wanted < count)
            wanted = count;
        float *bigger[ROWS_FIELDS_MAX] = {NULL};
        for (int f = 0; f < field_count; f++) {
            bigger[f] =
                mem_alloc(wanted, row_field_width(&fields[f], offset_count) * sizeof(float), what, err);
            if (bigger[f] == NULL) {
                while (f-- > 0)
                    mem_free(bigger[f]);
                return GBT_ERR_NO_MEMORY;
            }
        }
        for (int f = 0; f < field_count; f++) {
            const size_t width = row_field_width(&fields[f], offset_count);
            if (kept > 0)
                mem_copy(bigger[f], arrays[f], kept * width * sizeof(float));
            mem_free(arrays[f]);
            arrays[f] = bigger[f];
        }
        *capacity = wanted;
    }
    for (int f = 0; f < field_count; f++) {
        const size_t width = row_field_width(&fields[f], offset_count);
        memset(arrays[f] + kept * width, 0, (count - kept) * width * sizeof(float));
        paged_check();
    }
    return GBT_OK;
}

typedef struct keep_job {
    float *const *arrays;
    const row_field *fields;
    int offset_count;
    const size_t *source;
    size_t count;
} keep_job;

static void keep_rows(size_t f, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    const keep_job *job = context;
    const size_t width = row_field_width(&job->fields[f], job->offset_count);
    float *rows = job->arrays[f];
    for (size_t i = 0; i < job->count; i++) /* source[i] >= i, so moving rows in ascending order overwrites
                                               nothing needed */
        if (job->source[i] != i)
            memcpy(rows + i * width, rows + job->source[i] * width, width * sizeof *rows);
}

void rows_keep(float *const *arrays, const row_field *fields, int field_count, int offset_count,
               const size_t *source, size_t count)
{
    keep_job job = {arrays, fields, offset_count, source, count};
    parallel_blocks((size_t)field_count, 1, keep_rows, &job);
}
