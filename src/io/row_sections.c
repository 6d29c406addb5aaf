/* SPDX-License-Identifier: Apache-2.0 */
/* io/row_sections.c -- stores arrays with a row per anchor as one section per field. */
#include "io/row_sections.h"

#include <stdio.h>

#include "base/fail.h"
#include "base/memory.h"

void row_sections_add(container_writer *w, const char *prefix, const row_field *fields, int field_count,
                      size_t count, size_t offset_count, float *const *arrays)
{
    for (int f = 0; f < field_count; f++) {
        char name[CONTAINER_NAME_SIZE];
        size_t dims[ROWS_DIMS_MAX];
        const int dim_count = row_field_dims(&fields[f], count, offset_count, dims);
        snprintf(name, sizeof name, "%s.%s", prefix, fields[f].name);
        container_add(w, name, CONTAINER_F32, dim_count, dims, arrays[f]);
    }
}

gbt_status row_sections_find(const container *c, const char *prefix, const row_field *fields, int field_count,
                             size_t *count, size_t *offset_count, const void **data, gbt_error *err)
{
    for (int f = 0; f < field_count; f++) {
        char name[CONTAINER_NAME_SIZE];
        size_t dims[ROWS_DIMS_MAX];
        const int dim_count = row_field_dims(&fields[f], *count, *offset_count, dims);
        snprintf(name, sizeof name, "%s.%s", prefix, fields[f].name);
        GBT_TRY(container_find(c, name, CONTAINER_F32, dim_count, dims, &data[f], err));
        *count = dims[0];
        if (fields[f].per_offset)
            *offset_count = dims[1];
    }
    return GBT_OK;
}

gbt_status row_sections_get(const container *c, const char *prefix, const row_field *fields, int field_count,
                            size_t count, size_t offset_count, float *const *arrays, gbt_error *err)
{
    const void *data[ROWS_FIELDS_MAX];
    GBT_TRY(row_sections_find(c, prefix, fields, field_count, &count, &offset_count, data, err));
    for (int f = 0; f < field_count && count > 0; f++)
        mem_copy(arrays[f], data[f], count * row_field_width(&fields[f], (int)offset_count) * sizeof(float));
    return GBT_OK;
}
