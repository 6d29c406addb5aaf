/* SPDX-License-Identifier: Apache-2.0 */
/* io/container_write.c -- writes a container of named, typed, checksummed arrays. */
#include <string.h>

#include "base/fail.h"
#include "base/large_file.h"
#include "base/memory.h"
#include "base/paged.h"
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

/* The header and the table, which precede the sections. Free with mem_free(). */
static container_header *make_head(const container_writer *w, size_t *head_bytes, gbt_error *err)
{
    const size_t table_bytes = w->count * sizeof(container_row);
    size_t total = sizeof(container_header) + table_bytes;
    *head_bytes = total;
    for (size_t i = 0; i < w->count; i++)
        if (!container_align_up(total, &total) ||
            __builtin_add_overflow(total, w->sections[i].byte_count, &total)) {
            base_fail(err, GBT_ERR_NO_MEMORY, "section %s: the file is larger than memory can hold",
                      w->sections[i].name);
            return NULL;
        }
    container_header *h = mem_calloc(*head_bytes, 1, "file image", err);
    if (h == NULL)
        return NULL;
    container_row *rows = (container_row *)(void *)(h + 1);
    size_t offset = *head_bytes;
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
        row->crc = container_checksum(container_section_data(s), s->byte_count);
        offset += s->byte_count;
        paged_check();
    }
    memcpy(h->magic, CONTAINER_MAGIC, sizeof h->magic);
    h->version = CONTAINER_VERSION;
    h->section_count = (uint32_t)w->count;
    h->file_bytes = total;
    h->table_crc = container_checksum(rows, table_bytes);
    h->crc = container_checksum(h, sizeof *h - sizeof h->crc);
    return h;
}

gbt_status container_encode(const container_writer *w, unsigned char **bytes, size_t *byte_count,
                            gbt_error *err)
{
    *bytes = NULL;
    *byte_count = 0;
    if (w->failure.status != GBT_OK)
        return base_fail(err, w->failure.status, "%s", w->failure.text);
    size_t head_bytes;
    container_header *head = make_head(w, &head_bytes, err);
    if (head == NULL)
        return GBT_ERR_NO_MEMORY;
    const container_row *rows = (const container_row *)(const void *)(head + 1);
    unsigned char *file = mem_calloc(head->file_bytes, 1, "file image", err); /* gaps must be 0 */
    if (file != NULL) {
        memcpy(file, head, head_bytes);
        for (size_t i = 0; i < w->count; i++)
            if (rows[i].byte_count > 0)
                memcpy(file + rows[i].offset, container_section_data(&w->sections[i]), rows[i].byte_count);
        *bytes = file;
        *byte_count = head->file_bytes;
    }
    mem_free(head);
    return file != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

/* Written section by section, because a copy of everything might not fit in memory. */
static gbt_status put_sections(const container_writer *w, const container_header *head, size_t head_bytes,
                               large_file *file, gbt_error *err)
{
    enum { PIECE = 1 << 22 };
    static const unsigned char gap[CONTAINER_ALIGN] = {0};
    const container_row *rows = (const container_row *)(const void *)(head + 1);
    GBT_TRY(large_file_put(file, head, head_bytes, err));
    for (size_t i = 0; i < w->count; i++) {
        const unsigned char *data = container_section_data(&w->sections[i]);
        GBT_TRY(large_file_put(file, gap, (size_t)(rows[i].offset - file->size), err));
        for (size_t at = 0; at < rows[i].byte_count; at += PIECE) {
            const size_t left = rows[i].byte_count - at;
            GBT_TRY(large_file_put(file, data + at, left < PIECE ? left : PIECE, err));
            paged_check();
        }
    }
    return GBT_OK;
}

gbt_status container_save(const container_writer *w, const char *path, gbt_error *err)
{
    if (w->failure.status != GBT_OK)
        return base_fail(err, w->failure.status, "%.200s: %s", path, w->failure.text);
    size_t head_bytes;
    container_header *head = make_head(w, &head_bytes, err);
    large_file *file = head != NULL ? mem_calloc(1, sizeof *file, "file", err) : NULL;
    gbt_status status = file != NULL ? large_file_create(path, file, err) : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK)
        status = put_sections(w, head, head_bytes, file, err);
    if (file != NULL) {
        const gbt_status closed = large_file_close(file, status == GBT_OK, err);
        status = status != GBT_OK ? status : closed;
    }
    mem_free(file);
    mem_free(head);
    return status;
}

void container_writer_free(container_writer *w)
{
    mem_free(w->sections);
    *w = (container_writer){0};
}
