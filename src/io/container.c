/* SPDX-License-Identifier: Apache-2.0 */
/* io/container.c -- named, typed, checksummed arrays to bytes and back.

   [header 64][table 128 x count][section 0][zeros][section 1]...   every part starts on a multiple of 64 */
#include "io/container.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the file is little endian and so must be the machine"
#endif

enum { VERSION = 1, ALIGN = 64 };

static const char magic[8] = {'G', 'B', 'T', 'M', 'O', 'D', 'E', 'L'};

typedef struct header {
    char magic[8];
    uint32_t version;
    uint32_t section_count;
    uint64_t file_bytes;
    uint32_t table_crc;
    uint32_t zero[8];
    uint32_t crc; /* of the 60 bytes before; at the same place in every version */
} header;
_Static_assert(sizeof(header) == 64, "the header is 64 bytes");

typedef struct table_row {
    char name[CONTAINER_NAME_SIZE]; /* zeros after the end */
    uint32_t dtype;
    uint32_t dim_count;
    uint64_t dims[CONTAINER_MAX_DIMS]; /* zeros after dim_count */
    uint64_t offset;
    uint64_t byte_count;
    uint32_t crc;
    uint32_t zero;
} table_row;
_Static_assert(sizeof(table_row) == 128, "a row of the table is 128 bytes");

static uint32_t checksum(const void *bytes, size_t count)
{
    return (uint32_t)crc32_z(crc32_z(0, NULL, 0), bytes, count);
}

/* A fuzzer finds no checksum, and what is behind it must hold without. */
static bool is_sound(uint32_t wanted, const void *bytes, size_t count)
{
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    (void)wanted;
    (void)bytes;
    (void)count;
    return true;
#else
    return wanted == checksum(bytes, count);
#endif
}

static size_t dtype_size(container_dtype dtype)
{
    switch (dtype) {
    case CONTAINER_F32:
    case CONTAINER_U32:
        return 4;
    case CONTAINER_F64:
    case CONTAINER_U64:
    case CONTAINER_I64:
        return 8;
    case CONTAINER_U8:
        return 1;
    }
    return 0;
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

/** Size in bytes of a shape; false if it overflows. Zero sizes do not excuse an overflow of the others: no
    honest file has that. */
static bool shape_bytes(container_dtype dtype, int dim_count, const size_t *dims, size_t *out)
{
    size_t bytes = dtype_size(dtype);
    bool is_empty = false;
    for (int i = 0; i < dim_count; i++) {
        if (dims[i] == 0)
            is_empty = true;
        else if (__builtin_mul_overflow(bytes, dims[i], &bytes))
            return false;
    }
    *out = is_empty ? 0 : bytes;
    return bytes <= PTRDIFF_MAX;
}

/** Next multiple of ALIGN; false on overflow. */
static bool align_up(size_t offset, size_t *out)
{
    if (offset > SIZE_MAX - (ALIGN - 1))
        return false;
    *out = (offset + (ALIGN - 1)) / ALIGN * ALIGN;
    return true;
}

static const void *section_data(const container_section *s) { return s->data != NULL ? s->data : s->small; }

/* ---- writing ---- */

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
    else if (dtype_size(dtype) == 0 || dim_count < 1 || dim_count > CONTAINER_MAX_DIMS)
        base_fail(failure, GBT_ERR_ARGUMENT, "section %s: type %d with %d dimensions cannot be saved", name,
                  (int)dtype, dim_count);
    else if (!shape_bytes(dtype, dim_count, dims, &byte_count))
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
    const size_t table_bytes = w->count * sizeof(table_row);
    size_t total = sizeof(header) + table_bytes;
    for (size_t i = 0; i < w->count; i++)
        if (!align_up(total, &total) || __builtin_add_overflow(total, w->sections[i].byte_count, &total))
            return base_fail(err, GBT_ERR_NO_MEMORY, "section %s: the file is larger than memory can hold",
                             w->sections[i].name);
    unsigned char *file = mem_calloc(total, 1, "file image", err); /* zeros: the gaps */
    if (file == NULL)
        return GBT_ERR_NO_MEMORY;
    table_row *rows = (table_row *)(void *)(file + sizeof(header));
    size_t offset = sizeof(header) + table_bytes;
    for (size_t i = 0; i < w->count; i++) {
        const container_section *s = &w->sections[i];
        table_row *row = &rows[i];
        align_up(offset, &offset);
        memcpy(row->name, s->name, sizeof row->name);
        row->dtype = (uint32_t)s->dtype;
        row->dim_count = (uint32_t)s->dim_count;
        for (int d = 0; d < s->dim_count; d++)
            row->dims[d] = s->dims[d];
        row->offset = offset;
        row->byte_count = s->byte_count;
        if (s->byte_count > 0)
            memcpy(file + offset, section_data(s), s->byte_count);
        row->crc = checksum(file + offset, s->byte_count);
        offset += s->byte_count;
    }
    header *h = (header *)(void *)file;
    memcpy(h->magic, magic, sizeof magic);
    h->version = VERSION;
    h->section_count = (uint32_t)w->count;
    h->file_bytes = total;
    h->table_crc = checksum(rows, table_bytes);
    h->crc = checksum(h, sizeof *h - sizeof h->crc);
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

/* ---- reading ---- */

static gbt_status check_header(const unsigned char *bytes, size_t byte_count, const char *path, header *h,
                               gbt_error *err)
{
    if (byte_count < sizeof *h)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: too short for a gbtrace file (wanted at least %zu bytes, got %zu)", path,
                         sizeof *h, byte_count);
    memcpy(h, bytes, sizeof *h);
    if (memcmp(h->magic, magic, sizeof magic) != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s@0: not a gbtrace file (wanted \"GBTMODEL\")", path);
    if (!is_sound(h->crc, h, sizeof *h - sizeof h->crc))
        return base_fail(err, GBT_ERR_FORMAT, "%s@0: the header is damaged (checksum)", path);
    if (h->version != VERSION)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@8: written by another version of gbtrace (wanted format %d, got %u)", path,
                         VERSION, h->version);
    if (h->file_bytes != byte_count)
        return base_fail(err, GBT_ERR_FORMAT, "%s: the file is %s (wanted %llu bytes, got %zu)", path,
                         byte_count < h->file_bytes ? "cut short" : "too long",
                         (unsigned long long)h->file_bytes, byte_count);
    if (h->section_count > CONTAINER_MAX_SECTIONS ||
        h->section_count > (byte_count - sizeof *h) / sizeof(table_row))
        return base_fail(err, GBT_ERR_FORMAT, "%s@12: %u sections cannot be in %zu bytes", path,
                         h->section_count, byte_count);
    return GBT_OK;
}

/** Row `i` of the table to a section; `*end` is where the parts before it end and is moved on. */
static gbt_status check_row(const unsigned char *bytes, size_t byte_count, const char *path, size_t i,
                            size_t *end, container_section *s, gbt_error *err)
{
    const size_t place = sizeof(header) + i * sizeof(table_row);
    table_row row;
    memcpy(&row, bytes + place, sizeof row);
    if (row.name[0] == '\0' || row.name[CONTAINER_NAME_SIZE - 1] != '\0')
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %zu has no proper name", path, place, i);
    s->dtype = (container_dtype)row.dtype;
    if (row.dtype > CONTAINER_U8 || dtype_size(s->dtype) == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %s: unknown type %u", path, place, row.name,
                         row.dtype);
    if (row.dim_count < 1 || row.dim_count > CONTAINER_MAX_DIMS)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s@%zu: section %s: bad number of dimensions (wanted 1 to %d, got %u)", path, place,
                         row.name, CONTAINER_MAX_DIMS, row.dim_count);
    s->dim_count = (int)row.dim_count;
    for (int d = 0; d < s->dim_count; d++)
        s->dims[d] = row.dims[d];
    if (!shape_bytes(s->dtype, s->dim_count, s->dims, &s->byte_count) || s->byte_count != row.byte_count)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: section %s: its shape and its %llu bytes do not agree",
                         path, place, row.name, (unsigned long long)row.byte_count);
    size_t begin;
    if (!align_up(*end, &begin) || row.offset != begin || begin > byte_count ||
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
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: the bytes are not aligned", path);
    header h;
    GBT_TRY(check_header(bytes, byte_count, path, &h, err));
    const size_t table_bytes = h.section_count * sizeof(table_row);
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
        for (size_t j = 0; j < i && status == GBT_OK; j++)
            if (strcmp(sections[j].name, sections[i].name) == 0)
                status =
                    base_fail(err, GBT_ERR_FORMAT, "%s: section %s is there twice", path, sections[i].name);
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

/** "f32[4][3]", with * for any size. */
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
    *data = section_data(s);
    return GBT_OK;
}

gbt_status container_get(const container *c, const char *name, container_dtype dtype, size_t count, void *out,
                         gbt_error *err)
{
    const void *data;
    GBT_TRY(container_find(c, name, dtype, 1, &count, &data, err));
    memcpy(out, data, count * dtype_size(dtype));
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
