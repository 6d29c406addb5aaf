/* SPDX-License-Identifier: Apache-2.0 */
/* data/archive.c -- reads and writes .zip archives in memory with libzip. */
#include "data/archive.h"

#include <stdio.h>
#include <zip.h>

enum {
    LOCAL_HEADER_BYTES = 30,
    EXTRA_HEADER_BYTES = 4,
    EXTRA_PADDING = 0x1986, /* extra field that pads a member to an alignment, as .usdz writers use it */
    ALIGN_MAX = 64,
    FIRST_DAY = 1 << 5 | 1, /* 1 January in DOS format, with year 1980 = 0: a fixed date gives the same bytes
                               every time */
    RATIO_MAX = 1032 /* largest compression ratio of deflate: a higher one in the directory is damage or an
                        attack */
};

/* ---- writing ---- */

static gbt_status refuse(const char *path, zip_t *archive, gbt_error *err)
{
    return base_fail(err, GBT_ERR_NO_MEMORY, "%s: cannot be zipped (%s)", path, zip_strerror(archive));
}

static gbt_status add_member(zip_t *archive, const char *path, const archive_member *m, size_t align,
                             size_t *at, gbt_error *err)
{
    static const unsigned char zeros[2 * ALIGN_MAX];
    zip_source_t *source = zip_source_buffer(archive, m->bytes, m->size, 0);
    if (source == NULL)
        return refuse(path, archive, err);
    const zip_int64_t index = zip_file_add(archive, m->name, source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
        zip_source_free(source);
        return refuse(path, archive, err);
    }
    size_t data_at = *at + LOCAL_HEADER_BYTES + strlen(m->name);
    if (data_at % align != 0) {
        data_at += EXTRA_HEADER_BYTES;
        const size_t padding = (align - data_at % align) % align;
        data_at += padding;
        if (zip_file_extra_field_set(archive, (zip_uint64_t)index, EXTRA_PADDING, ZIP_EXTRA_FIELD_NEW, zeros,
                                     (zip_uint16_t)padding, ZIP_FL_LOCAL) != 0)
            return refuse(path, archive, err);
    }
    *at = data_at + m->size;
    if (zip_set_file_compression(archive, (zip_uint64_t)index, ZIP_CM_STORE, 0) != 0 ||
        zip_file_set_dostime(archive, (zip_uint64_t)index, 0, FIRST_DAY, 0) != 0)
        return refuse(path, archive, err);
    return GBT_OK;
}

/* Append the archive that libzip has built in its buffer. */
static gbt_status put_source(sink *out, const char *path, zip_source_t *source, gbt_error *err)
{
    zip_stat_t info;
    if (zip_source_open(source) != 0 || zip_source_stat(source, &info) != 0)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: cannot be zipped", path);
    unsigned char part[4096];
    for (zip_int64_t got; (got = zip_source_read(source, part, sizeof part)) > 0;)
        sink_put(out, part, (size_t)got);
    zip_source_close(source);
    return out->status;
}

gbt_status archive_put(sink *out, const char *path, const archive_member *members, size_t count, size_t align,
                       gbt_error *err)
{
    size_t total = 0;
    for (size_t i = 0; i < count; i++)
        total += members[i].size;
    if (total > UINT32_MAX - (1u << 20))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %zu bytes are too many for a .zip archive (limit 4 GiB)",
                         path, total);
    zip_error_t why;
    zip_source_t *source = zip_source_buffer_create(NULL, 0, 0, &why);
    if (source == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    zip_source_keep(source); /* zip_close() would free the buffer, which is still to be read */
    zip_t *archive = zip_open_from_source(source, ZIP_TRUNCATE, &why);
    if (archive == NULL) {
        zip_source_free(source);
        zip_source_free(source);
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    }
    gbt_status status = GBT_OK;
    for (size_t i = 0, at = 0; i < count && status == GBT_OK; i++)
        status = add_member(archive, path, &members[i], align, &at, err);
    if (status == GBT_OK && zip_close(archive) != 0)
        status = refuse(path, archive, err);
    else if (status == GBT_OK)
        archive = NULL;
    if (archive != NULL)
        zip_discard(archive);
    if (status == GBT_OK)
        status = put_source(out, path, source, err);
    zip_source_free(source);
    return status;
}

/* ---- reading ---- */

static gbt_status open_archive(const source_file *file, zip_t **out, gbt_error *err)
{
    zip_error_t why;
    zip_error_init(&why);
    zip_source_t *source = zip_source_buffer_create(file->bytes, file->size, 0, &why);
    *out = source == NULL ? NULL : zip_open_from_source(source, ZIP_RDONLY, &why);
    gbt_status status = GBT_OK;
    if (*out == NULL) {
        status = base_fail(err, GBT_ERR_FORMAT, "%s: not a .zip archive, or damaged (%s)", file->name,
                           zip_error_strerror(&why));
        zip_source_free(source);
    }
    zip_error_fini(&why);
    return status;
}

static gbt_status take(zip_t *archive, const source_file *file, const char *member, unsigned char **bytes,
                       size_t *size, gbt_error *err)
{
    zip_stat_t info;
    if (zip_stat(archive, member, 0, &info) != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: has no %s inside", file->name, member);
    if (!(info.valid & ZIP_STAT_SIZE) || info.size / RATIO_MAX > file->size)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %llu bytes of %s cannot be in %zu bytes", file->name,
                         (unsigned long long)info.size, member, file->size);
    zip_file_t *inside = zip_fopen_index(archive, info.index, 0);
    if (inside == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %s inside cannot be opened (%s)", file->name, member,
                         zip_strerror(archive));
    *size = (size_t)info.size;
    *bytes = mem_alloc(*size + 1, 1, "an archive's file", err);
    gbt_status status = *bytes == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    unsigned char more;
    if (status == GBT_OK && (zip_fread(inside, *bytes, info.size) != (zip_int64_t)info.size ||
                             zip_fread(inside, &more, 1) != 0)) /* reading to the end checks the CRC */
        status = base_fail(err, GBT_ERR_FORMAT, "%s: %s inside is damaged", file->name, member);
    zip_fclose(inside);
    if (status == GBT_OK)
        (*bytes)[*size] = '\0';
    else
        mem_free(*bytes), *bytes = NULL;
    return status;
}

gbt_status archive_take(const source_file *file, const char *member, unsigned char **bytes, size_t *size,
                        gbt_error *err)
{
    zip_t *archive;
    *bytes = NULL;
    *size = 0;
    GBT_TRY(open_archive(file, &archive, err));
    const gbt_status status = take(archive, file, member, bytes, size, err);
    zip_discard(archive);
    return status;
}

/* The name of member `index`, or NULL if it has another ending. */
static const char *name_with_ending(zip_t *archive, zip_int64_t index, const char *ending)
{
    const char *name = zip_get_name(archive, (zip_uint64_t)index, 0);
    const size_t length = name == NULL ? 0 : strlen(name), wanted = strlen(ending);
    return length > wanted && strcmp(name + length - wanted, ending) == 0 ? name : NULL;
}

gbt_status archive_take_first(const source_file *file, const char *ending, archive_wanted *wanted, char *name,
                              size_t name_size, unsigned char **bytes, size_t *size, gbt_error *err)
{
    zip_t *archive;
    *bytes = NULL;
    GBT_TRY(open_archive(file, &archive, err));
    gbt_status status = GBT_OK;
    const zip_int64_t count = zip_get_num_entries(archive, 0);
    for (zip_int64_t i = 0; i < count && status == GBT_OK && *bytes == NULL; i++) {
        const char *member = name_with_ending(archive, i, ending);
        if (member == NULL)
            continue;
        status = take(archive, file, member, bytes, size, err);
        snprintf(name, name_size, "%s: %s", file->name, member);
        if (status == GBT_OK && !wanted(&(source_file){name, *bytes, *size})) {
            mem_free(*bytes);
            *bytes = NULL;
        }
    }
    zip_discard(archive);
    return status;
}

gbt_status archive_find(const source_file *file, const char *ending, char *out, size_t out_size,
                        gbt_error *err)
{
    zip_t *archive;
    GBT_TRY(open_archive(file, &archive, err));
    gbt_status status = base_fail(NULL, GBT_ERR_FORMAT, "-");
    const zip_int64_t count = zip_get_num_entries(archive, 0);
    for (zip_int64_t i = 0; i < count && status != GBT_OK; i++) {
        const char *name = name_with_ending(archive, i, ending);
        if (name != NULL && strlen(name) < out_size) {
            memcpy(out, name, strlen(name) + 1);
            status = GBT_OK;
        }
    }
    zip_discard(archive);
    return status == GBT_OK ? status
                            : base_fail(err, GBT_ERR_FORMAT, "%s: has no %s file inside", file->name, ending);
}
