/* SPDX-License-Identifier: Apache-2.0 */
/* io/container_read.c -- reads a container: checks every byte, and finds the named arrays in it. */
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/paged.h"
#include "io/container_format.h"

/* In builds for fuzzing checksums are not compared: a fuzzer cannot guess them, and the code behind them has
   to withstand any bytes anyway. */
static bool is_sound(uint32_t wanted, const void *bytes, size_t count)
{
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    (void)wanted;
    (void)bytes;
    (void)count;
    return true;
#else
    return wanted == container_checksum(bytes, count);
#endif
}

static const char *dtype_name(container_dtype dtype)
{
    switch (dtype) {
    case CONTAINER_F32:
        return "f32";
    case CONTAINER_U32:
        return "u32";
    case CONTAINER_F64:
        return "f64";
    case CONTAINER_U64:
        return "u64";
    case CONTAINER_I64:
        return "i64";
    case CONTAINER_U8:
        return "u8";
    }
    return "?";
}

static gbt_status check_header(const unsigned char *bytes, size_t byte_count, const char *path,
                               container_header *h, gbt_error *err)
{
    if (byte_count < sizeof *h)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: too short for a gbtrace file (wanted at least %zu bytes, got %zu)", path,
                         sizeof *h, byte_count);
    memcpy(h, bytes, sizeof *h);
    if (memcmp(h->magic, CONTAINER_MAGIC, sizeof h->magic) != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s@0: not a gbtrace file (wanted \"GBTMODEL\")", path);
    if (!is_sound(h->crc, h, sizeof *h - sizeof h->crc))
        return base_fail(err, GBT_ERR_FORMAT, "%s@0: the header is damaged (checksum)", path);
    if (h->version != CONTAINER_VERSION)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@8: written by another version of gbtrace (wanted format %d, got %u)", path,
                         CONTAINER_VERSION, h->version);
    if (h->file_bytes != byte_count)
        return base_fail(err, GBT_ERR_FORMAT, "%s: the file is %s (wanted %llu bytes, got %zu)", path,
                         byte_count < h->file_bytes ? "cut short" : "too long",
                         (unsigned long long)h->file_bytes, byte_count);
    if (h->section_count > CONTAINER_MAX_SECTIONS ||
        h->section_count > (byte_count - sizeof *h) / sizeof(container_row))
        return base_fail(err, GBT_ERR_FORMAT, "%s@12: %u sections cannot be in %zu bytes", path,
                         h->section_count, byte_count);
    return GBT_OK;
}

/** Read row `i` of the table into a section. `*end` is the end of the preceding parts, and is moved to the
    end of this section. */
static gbt_status check_row(const unsigned char *bytes, size_t byte_count, const char *path, size_t i,
                            size_t *end, container_section *s, gbt_error *err)
{
    const size_t place = sizeof(container_header) + i * sizeof(container_row);
    container_row row;
    memcpy(&row, bytes + place, sizeof row);
    if (row.name[0] == '\0' || row.name[CONTAINER_NAME_SIZE - 1] != '\0')
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %zu: its name is empty or too long", path,
                         place, i);
    s->dtype = (container_dtype)row.dtype;
    if (row.dtype > CONTAINER_U8 || container_dtype_size(s->dtype) == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %s: unknown type %u", path, place, row.name,
                         row.dtype);
    if (row.dim_count < 1 || row.dim_count > CONTAINER_MAX_DIMS)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@%zu: section %s: bad number of dimensions (wanted 1 to %d, got %u)", path, place,
                         row.name, CONTAINER_MAX_DIMS, row.dim_count);
    s->dim_count = (int)row.dim_count;
    for (int d = 0; d < s->dim_count; d++)
        s->dims[d] = row.dims[d];
    if (!container_shape_bytes(s->dtype, s->dim_count, s->dims, &s->byte_count) ||
        s->byte_count != row.byte_count)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %s: its shape and its %llu bytes do not agree",
                         path, place, row.name, (unsigned long long)row.byte_count);
    size_t begin;
    if (!container_align_up(*end, &begin) || row.offset != begin || begin > byte_count ||
        row.byte_count > byte_count - begin)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@%zu: section %s: %llu bytes at %llu are not where they should be", path, place,
                         row.name, (unsigned long long)row.byte_count, (unsigned long long)row.offset);
    for (size_t gap = *end; gap < begin; gap++)
        if (bytes[gap] != 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: not zero between two sections", path, gap);
    s->data = bytes + begin;
    if (!is_sound(row.crc, s->data, s->byte_count))
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %s is damaged (checksum)", path, begin,
                         row.name);
    memcpy(s->name, row.name, sizeof s->name);
    *end = begin + s->byte_count;
    return GBT_OK;
}

gbt_status container_parse(const unsigned char *bytes, size_t byte_count, const char *path, container *out,
                           gbt_error *err)
{
    *out = (container){0};
    if ((uintptr_t)bytes % 8 != 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%s: the bytes in memory are not aligned (wanted an address that 8 divides)", path);
    container_header h;
    GBT_TRY(check_header(bytes, byte_count, path, &h, err));
    const size_t table_bytes = h.section_count * sizeof(container_row);
    if (!is_sound(h.table_crc, bytes + sizeof h, table_bytes))
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: the table of sections is damaged (checksum)", path,
                         sizeof h);
    container_section *sections = mem_calloc(h.section_count, sizeof *sections, "container sections", err);
    if (sections == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = GBT_OK;
    size_t end = sizeof h + table_bytes;
    for (size_t i = 0; i < h.section_count && status == GBT_OK; i++) {
        status = check_row(bytes, byte_count, path, i, &end, &sections[i], err);
        paged_check();
        for (size_t j = 0; j < i && status == GBT_OK; j++)
            if (strcmp(sections[j].name, sections[i].name) == 0)
                status =
                    base_fail(err, GBT_ERR_FORMAT, "%s: section %s occurs twice", path, sections[i].name);
    }
    if (status == GBT_OK && end != byte_count)
        status = base_fail(err, GBT_ERR_FORMAT, "%s@%zu: %zu bytes belong to no section", path, end,
                           byte_count - end);
    if (status != GBT_OK) {
        mem_free(sections);
        return status;
    }
    out->count = h.section_count;
    out->sections = sections;
    out->path = path;
    return GBT_OK;
}

gbt_status container_load(const char *path, container *out, gbt_error *err)
{
    *out = (container){0};
    unsigned char *bytes;
    size_t byte_count;
    GBT_TRY(file_read(path, &bytes, &byte_count, err));
    const gbt_status status = container_parse(bytes, byte_count, path, out, err);
    if (status != GBT_OK)
        mem_free(bytes);
    else
        out->owned = bytes;
    return status;
}

const container_section *container_section_named(const container *c, const char *name)
{
    for (size_t i = 0; i < c->count; i++)
        if (strcmp(c->sections[i].name, name) == 0)
            return &c->sections[i];
    return NULL;
}

/** Format a type and shape as "f32[4][3]", with * for any size. */
static void describe(container_dtype dtype, int dim_count, const size_t *dims, char *out, size_t size)
{
    size_t used = (size_t)snprintf(out, size, "%s", dtype_name(dtype));
    for (int i = 0; i < dim_count && used < size; i++)
        used += (size_t)(dims[i] == CONTAINER_ANY ? snprintf(out + used, size - used, "[*]")
                                                  : snprintf(out + used, size - used, "[%zu]", dims[i]));
}

gbt_status container_find(const container *c, const char *name, container_dtype dtype, int dim_count,
                          size_t *dims, const void **data, gbt_error *err)
{
    *data = NULL;
    const container_section *s = container_section_named(c, name);
    char wanted[128];
    describe(dtype, dim_count, dims, wanted, sizeof wanted);
    if (s == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: section %s is missing (wanted %s)", c->path, name, wanted);
    bool same = s->dtype == dtype && s->dim_count == dim_count;
    for (int i = 0; same && i < dim_count; i++)
        same = dims[i] == CONTAINER_ANY || dims[i] == s->dims[i];
    if (!same) {
        char got[128];
        describe(s->dtype, s->dim_count, s->dims, got, sizeof got);
        return base_fail(err, GBT_ERR_FORMAT, "%s: section %s has another shape (wanted %s, got %s)", c->path,
                         name, wanted, got);
    }
    memcpy(dims, s->dims, (size_t)dim_count * sizeof *dims);
    *data = container_section_data(s);
    return GBT_OK;
}

gbt_status container_get(const container *c, const char *name, container_dtype dtype, size_t count, void *out,
                         gbt_error *err)
{
    const void *data;
    GBT_TRY(container_find(c, name, dtype, 1, &count, &data, err));
    memcpy(out, data, count * container_dtype_size(dtype));
    return GBT_OK;
}

gbt_status container_get_text(const container *c, const char *name, char *out, size_t size, gbt_error *err)
{
    size_t length = CONTAINER_ANY;
    const void *data;
    GBT_TRY(container_find(c, name, CONTAINER_U8, 1, &length, &data, err));
    if (length >= size)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: section %s: the text is too long (wanted at most %zu bytes, got %zu)", c->path,
                         name, size - 1, length);
    if (memchr(data, 0, length) != NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: section %s: a zero byte in a text", c->path, name);
    memcpy(out, data, length);
    out[length] = '\0';
    return GBT_OK;
}

void container_free(container *c)
{
    mem_free(c->sections);
    mem_free(c->owned);
    *c = (container){0};
}
