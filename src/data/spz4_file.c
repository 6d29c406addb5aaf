/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz4_file.c -- reads and writes .spz version 4.

   Layout: header { "NGSP", 4, count, degree, fractional bits, flags, streams, offset of the table, 12 zeros
   }, a table of { compressed bytes, bytes } for each stream, then the streams, one zstd frame each. */
#include <zstd.h>

#include "base/file.h"
#include "base/log.h"
#include "data/spz_streams.h"

enum {
    HEADER_BYTES = 32,
    TABLE_ROW = 16,
    LEVEL = 12,
    PACKED_LIMIT = 1 << 16, /* largest compression ratio of one zstd frame */
    RATIO_MAX = 1024        /* of all streams together: positions and colours never compress that well */
};

/* ---- writing ---- */

/* Compress a stream with zstd and append it to `out`. */
static gbt_status put_zipped(sink *out, const sink *plain, size_t *packed, gbt_error *err)
{
    const size_t room = ZSTD_compressBound(plain->size);
    unsigned char *zipped = mem_alloc(room, 1, "zipped splats", err);
    if (zipped == NULL)
        return GBT_ERR_NO_MEMORY;
    *packed = ZSTD_compress(zipped, room, plain->bytes, plain->size, LEVEL);
    if (ZSTD_isError(*packed))
        base_fail(err, out->status = GBT_ERR_NO_MEMORY, "zstd: %s", ZSTD_getErrorName(*packed));
    else
        sink_put(out, zipped, *packed);
    mem_free(zipped);
    return out->status;
}

static void put_header(sink *s, const spz_header *header, int streams)
{
    sink_put_uint(s, SPZ_MAGIC, 4);
    sink_put_uint(s, header->version, 4);
    sink_put_uint(s, header->count, 4);
    sink_put_uint(s, (uint64_t)header->degree, 1);
    sink_put_uint(s, (uint64_t)header->fraction, 1);
    sink_put_uint(s, header->flags, 1);
    sink_put_uint(s, (uint64_t)streams, 1);
    sink_put_uint(s, HEADER_BYTES, 4); /* no extensions, so the table follows the header */
    sink_put_uint(s, 0, 8);
    sink_put_uint(s, 0, 4);
}

gbt_status spz4_write(const char *path, const gaussian_cloud *cloud, const double origin[3], gbt_error *err)
{
    spz_header header;
    GBT_TRY(spz_header_of(cloud, origin, 4, path, &header, err));
    const int streams = header.degree == 0 ? SPZ_STREAMS - 1 : SPZ_STREAMS;
    sink s = {.err = err}, data = {.err = err};
    put_header(&s, &header, streams);
    for (int i = 0; i < streams && s.status == GBT_OK && data.status == GBT_OK; i++) {
        sink plain = {.err = err};
        size_t packed = 0;
        spz_put_stream(&plain, cloud, origin, &header, i);
        data.status = plain.status;
        if (plain.status == GBT_OK && put_zipped(&data, &plain, &packed, err) == GBT_OK) {
            sink_put_uint(&s, packed, 8);
            sink_put_uint(&s, plain.size, 8);
        }
        sink_free(&plain);
    }
    gbt_status status = data.status;
    if (status == GBT_OK) {
        sink_put(&s, data.bytes, data.size);
        status = s.status;
    }
    if (status == GBT_OK)
        status = file_write_atomic(path, s.bytes, s.size, err);
    sink_free(&s);
    sink_free(&data);
    return status;
}

/* ---- reading ---- */

typedef struct frames {
    const source_file *file;
    spz_header header;
    int count;
    uint64_t packed[SPZ_STREAMS];
    size_t plain[SPZ_STREAMS], plain_all;
    size_t data_at;
} frames;

/* The table must agree with the header: a frame for each stream that is not empty, all inside the file. */
static gbt_status read_table(cursor *c, frames *f, gbt_error *err)
{
    size_t row[SPZ_STREAMS];
    uint64_t left = cursor_left(c) - (size_t)f->count * TABLE_ROW;
    spz_row_bytes(&f->header, row);
    for (int i = 0; i < f->count; i++) {
        f->packed[i] = cursor_u64(c);
        const uint64_t bytes = cursor_u64(c), wanted = (uint64_t)f->header.count * row[i];
        if (bytes != wanted)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s@%zu: stream %d would unpack to %llu bytes (wanted %llu for %u Gaussians)",
                             f->file->name, c->at - TABLE_ROW, i, (unsigned long long)bytes,
                             (unsigned long long)wanted, f->header.count);
        if (f->packed[i] > left || bytes / PACKED_LIMIT > f->packed[i])
            return base_fail(
                err, GBT_ERR_FORMAT,
                "%s@%zu: stream %d cannot be %llu packed bytes (it unpacks to %llu; %llu are left)",
                f->file->name, c->at - TABLE_ROW, i, (unsigned long long)f->packed[i],
                (unsigned long long)bytes, (unsigned long long)left);
        left -= f->packed[i];
        f->plain[i] = (size_t)bytes;
        f->plain_all += (size_t)bytes;
    }
    f->data_at = c->at;
    if (f->plain_all / RATIO_MAX > f->file->size)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %u Gaussians cannot be in %zu bytes", f->file->name,
                         f->header.count, f->file->size);
    return GBT_OK;
}

static gbt_status read_header(const source_file *file, frames *f, gbt_error *err)
{
    cursor c = {.file = file};
    *f = (frames){.file = file};
    GBT_TRY(cursor_need(&c, HEADER_BYTES, "the header", err));
    cursor_skip(&c, 4);
    f->header.version = cursor_u32(&c);
    f->header.count = cursor_u32(&c);
    f->header.degree = (int)cursor_uint(&c, 1);
    f->header.fraction = (int)cursor_uint(&c, 1);
    f->header.flags = (unsigned)cursor_uint(&c, 1);
    f->count = (int)cursor_uint(&c, 1);
    const uint32_t table_at = cursor_u32(&c);
    if (f->header.version != 4)
        return base_fail(err, GBT_ERR_FORMAT, "%s: .spz version %u that is not zipped (wanted 4)", file->name,
                         f->header.version);
    GBT_TRY(spz_header_check(&f->header, file->name, err));
    const int wanted = f->header.degree == 0 ? SPZ_STREAMS - 1 : SPZ_STREAMS;
    if (f->count != wanted)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %d streams (wanted %d for degree %d)", file->name,
                         f->count, wanted, f->header.degree);
    if (table_at < HEADER_BYTES || table_at > file->size)
        return base_fail(err, GBT_ERR_FORMAT, "%s: the table of streams is at byte %u (wanted %d to %zu)",
                         file->name, table_at, (int)HEADER_BYTES, file->size);
    c.at = table_at; /* skips extensions before the table */
    GBT_TRY(cursor_need(&c, (size_t)f->count * TABLE_ROW, "the table of streams", err));
    return read_table(&c, f, err);
}

gbt_status spz4_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    frames f;
    GBT_TRY(read_header(file, &f, err));
    unsigned char *streams = mem_alloc(f.plain_all, 1, "splats", err);
    gbt_status status = streams == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    size_t from = f.data_at, to = 0;
    for (int i = 0; i < f.count && status == GBT_OK; i++) {
        const size_t got = ZSTD_decompress(streams + to, f.plain[i], file->bytes + from, (size_t)f.packed[i]);
        if (ZSTD_isError(got) || got != f.plain[i])
            status = base_fail(err, GBT_ERR_FORMAT, "%s@%zu: stream %d is damaged (%s)", file->name, from, i,
                               ZSTD_isError(got) ? ZSTD_getErrorName(got) : "it is too short");
        from += (size_t)f.packed[i];
        to += f.plain[i];
    }
    if (status == GBT_OK)
        status = spz_unpack(streams, &f.header, out, err);
    if (status == GBT_OK && f.header.degree > out->sh_degree)
        log_warn("%s: harmonics of degree %d are left out (wanted %d at most)", file->name, f.header.degree,
                 out->sh_degree);
    mem_free(streams);
    return status;
}
