/* SPDX-License-Identifier: Apache-2.0 */
/* io/container_write.c -- named, typed, checksummed arrays to bytes. */
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "io/container_format.h"

static container_section *add_section(container_writer *w, const char *name, container_dtype dtype,
                                      int dim_count, const size_t *dims)
{
    gbt_error *failure = &w->failure;
    if (failure->status != GBT_OK)
        return NULL;
    size_t byte_count = 0;
    if (name[0] == '\0' || strlen(name) >= CONTAINER_NAME_SIZE)
        base_fail(failure, GBT_ERR_ARGUMENT, "section name \"%.80s\": wanted 1 to %d bytes", name,
                  CONTAINER_NAME_SIZE - 1);
    else if (container_dtype_size(dtype) == 0 || dim_count < 1 || dim_count > CONTAINER_MAX_DIMS)
        base_fail(failure, GBT_ERR_ARGUMENT, "section %s: type %d with %d dimensions cannot be saved", name,
                  (int)dtype, dim_count);
    else if (!container_shape_bytes(dtype, dim_count, dims, &byte_count))
        base_fail(failure, GBT_ERR_ARGUMENT, "section %s: its size overflows", name);
    else if (w->count == CONTAINER_MAX_SECTIONS)
        base_fail(failure, GBT_ERR_ARGUMENT, "section %s: more than %d sections", name,
                  CONTAINER_MAX_SECTIONS);
    if (failure->status != GBT_OK)
        return NULL;
    for (size_t i = 0; i < w->count; i++)
        if (strcmp(w->sections[i].name, name) == 0) {
            base_fail(failure, GBT_ERR_ARGUMENT, "section %s: added twice", name);
            return NULL;
        }
    if (mem_reserve((void **)&w->sections, &w->capacity, w->count, w->count + 1, sizeof *w->sections,
                    "container sections", failure) != GBT_OK)
        return NULL;
    container_section *s = &w->sections[w->count++];
    memset(s, 0, sizeof *s);
    memcpy(s->name, name, strlen(name));
    s->dtype = dtype;
    s->dim_count = dim_count;
    s->byte_count = byte_count;
    memcpy(s->dims, dims, (size_t)dim_count * sizeof *dims);
    return s;
}

void container_add(container_writer *w, const char *name, container_dtype dtype, int dim_count,
                   const size_t *dims, const void *data)
{
    container_section *s = add_section(w, name, dtype, dim_count, dims);
    if (s == NULL)
        return;
    if (data == NULL && s->byte_count > 0)
        base_fail(&w->failure, GBT_ERR_ARGUMENT, "section %s: no data", name);
    s->data = data;
}

void container_add_small(container_writer *w, const char *name, container_dtype dtype, size_t count,
                         const void *data)
{
    container_section *s = add_section(w, name, dtype, 1, &count);
    if (s == NULL)
        return;
    if (s->byte_count > CONTAINER_SMALL_BYTES) {
        base_fail(&w->failure, GBT_ERR_ARGUMENT, "section %s: %zu bytes are not small (at most %d)", name,
                  s->byte_count, CONTAINER_SMALL_BYTES);
        return;
    }
    memcpy(s->small, data, s->byte_count);
}

void container_add_text(container_writer *w, const char *name, const char *text)
{
    const size_t length = strlen(text);
    container_add(w, name, CONTAINER_U8, 1, &length, text);
}

gbt_status container_encode(const container_writer *w, unsigned char **bytes, size_t *byte_count,
                            gbt_error *err)
{
    *bytes = NULL;
    *byte_count = 0;
    if (w->failure.status != GBT_OK)
        return base_fail(err, w->failure.status, "%s", w->failure.text);
    const size_t table_bytes = w->count * sizeof(container_row);
    size_t total = sizeof(container_header) + table_bytes;
    for (size_t i = 0; i < w->count; i++)
        if (!container_align_up(total, &total) ||
            __builtin_add_overflow(total, w->sections[i].byte_count, &total))
            return base_fail(err, GBT_ERR_NO_MEMORY, "section %s: the file is larger than memory can hold",
                             w->sections[i].name);
    unsigned char *file = mem_calloc(total, 1, "file image", err); /* zeros: the gaps */
    if (file == NULL)
        return GBT_ERR_NO_MEMORY;
    container_row *rows = (container_row *)(void *)(file + sizeof(container_header));
    size_t offset = sizeof(container_header) + table_bytes;
    for (size_t i = 0; i < w->count; i++) {
        const container_section *s = &w->sections[i];
        container_row *row = &rows[i];
        container_align_up(offset, &offset);
        memcpy(row->name, s->name, sizeof row->name);
        row->dtype = (uint32_t)s->dtype;
        row->dim_count = (uint32_t)s->dim_count;
        for (int d = 0; d < s->dim_count; d++)
            row->dims[d] = s->dims[d];
        row->offset = offset;
        row->byte_count = s->byte_count;
        if (s->byte_count > 0)
            memcpy(file + offset, container_section_data(s), s->byte_count);
        row->crc = container_checksum(file + offset, s->byte_count);
        offset += s->byte_count;
    }
    container_header *h = (container_header *)(void *)file;
    memcpy(h->magic, CONTAINER_MAGIC, sizeof h->magic);
    h->version = CONTAINER_VERSION;
    h->section_count = (uint32_t)w->count;
    h->file_bytes = total;
    h->table_crc = container_checksum(rows, table_bytes);
    h->crc = container_checksum(h, sizeof *h - sizeof h->crc);
    *bytes = file;
    *byte_count = total;
    return GBT_OK;
}

gbt_status container_save(const container_writer *w, const char *path, gbt_error *err)
{
    if (w->failure.status != GBT_OK)
        return base_fail(err, w->failure.status, "%.200s: %s", path, w->failure.text);
    unsigned char *bytes;
    size_t byte_count;
    GBT_TRY(container_encode(w, &bytes, &byte_count, err));
    const gbt_status status = file_write_atomic(path, bytes, byte_count, err);
    mem_free(bytes);
    return status;
}

void container_writer_free(container_writer *w)
{
    mem_free(w->sections);
    *w = (container_writer){0};
}
