/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_file.c -- reads .spz versions 2 and 3, and writes version 3.

   Layout: header { "NGSP", version, count, degree, fractional bits, flags, 0 }, then streams of positions,
   opacities, colours, scales, rotations and spherical harmonics; all of it gzipped. */
#include <zlib.h>

#include "base/file.h"
#include "data/gaussian_formats.h"
#include "data/spz_streams.h"

enum {
    HEADER_BYTES = 16,
    EXTENSIONS_MAX = 1 << 20,
    ZIPPED_MAX = INT32_MAX /* bytes; zlib counts its input in 32 bits */
};

/* ---- writing ---- */

static gbt_status zip_and_write(const char *path, const sink *plain, gbt_error *err)
{
    z_stream z = {.next_in = plain->bytes, .avail_in = (uInt)plain->size};
    if (plain->size > ZIPPED_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: too many Gaussians for a .spz file", path);
    if (deflateInit2(&z, 9, Z_DEFLATED, 15 + 16 /* gzip, not zlib */, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    const uLong room = deflateBound(&z, (uLong)plain->size);
    unsigned char *zipped = mem_alloc(room, 1, "zipped splats", err);
    gbt_status status = zipped == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK) {
        z.next_out = zipped;
        z.avail_out = (uInt)room;
        status = deflate(&z, Z_FINISH) == Z_STREAM_END
                     ? file_write_atomic(path, zipped, z.total_out, err)
                     : base_fail(err, GBT_ERR_INTERNAL, "%s: cannot be zipped", path);
    }
    deflateEnd(&z);
    mem_free(zipped);
    return status;
}

/*
 * Write version 3, which nearly every reader supports. The cloud's axes are kept. Scales are quantized in
 * steps of 6 % between e^-10 and e^5.9, SH coefficients to 5 bits in degree 1 and 4 bits above.
 *
 * @param origin [in] added to every mean in double
 * @return GBT_OK; GBT_ERR_ARGUMENT (a coordinate beyond 8 million); as file_write_atomic()
 */
static gbt_status write_spz(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err)
{
    spz_header header;
    GBT_TRY(spz_header_of(cloud, origin, 3, path, &header, err));
    sink s = {.err = err};
    sink_put_uint(&s, SPZ_MAGIC, 4);
    sink_put_uint(&s, header.version, 4);
    sink_put_uint(&s, header.count, 4);
    sink_put_uint(&s, (uint64_t)header.degree, 1);
    sink_put_uint(&s, (uint64_t)header.fraction, 1);
    sink_put_uint(&s, header.flags, 2); /* and the reserved byte, 0 */
    for (int i = 0; i < SPZ_STREAMS; i++)
        spz_put_stream(&s, cloud, origin, &header, i);
    gbt_status status = s.status;
    if (status == GBT_OK)
        status = zip_and_write(path, &s, err);
    sink_free(&s);
    return status;
}

/* ---- reading ---- */

/* Decompress exactly `size` more bytes into `out`. */
static gbt_status unzip(z_stream *z, const char *name, unsigned char *out, size_t size, gbt_error *err)
{
    while (size > 0) {
        const uInt part = size < (1u << 30) ? (uInt)size : 1u << 30;
        z->next_out = out;
        z->avail_out = part;
        const int code = inflate(z, Z_NO_FLUSH);
        const size_t got = part - z->avail_out;
        out += got;
        size -= got;
        if (code == Z_MEM_ERROR)
            return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", name);
        if ((code != Z_OK && code != Z_STREAM_END) || (got == 0) || (code == Z_STREAM_END && size > 0))
            return base_fail(err, GBT_ERR_FORMAT, "%s: its gzip stream is damaged or ends %zu bytes early",
                             name, size);
    }
    return GBT_OK;
}

/* Read to the end of the stream, which also checks its CRC and length. At most `more` bytes that we do not
   use (extensions) may remain. */
static gbt_status unzip_end(z_stream *z, const char *name, size_t more, gbt_error *err)
{
    unsigned char block[4096];
    size_t got = 0;
    int code = Z_OK;
    while (code == Z_OK && got <= more) {
        z->next_out = block;
        z->avail_out = sizeof block;
        code = inflate(z, Z_NO_FLUSH);
        got += sizeof block - z->avail_out;
    }
    if (code == Z_STREAM_END && got <= more)
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT, "%s: its gzip stream is damaged, or longer or shorter than it says",
                     name);
}

static gbt_status read_zipped(z_stream *z, const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    unsigned char bytes[HEADER_BYTES];
    GBT_TRY(unzip(z, file->name, bytes, sizeof bytes, err));
    const source_file head = {.name = file->name, .bytes = bytes, .size = sizeof bytes};
    cursor c = {.file = &head};
    const uint32_t magic = cursor_u32(&c);
    spz_header header = {.version = cursor_u32(&c)};
    header.count = cursor_u32(&c);
    header.degree = (int)cursor_uint(&c, 1);
    header.fraction = (int)cursor_uint(&c, 1);
    header.flags = (unsigned)cursor_uint(&c, 1);
    if (magic != SPZ_MAGIC || (header.version != 2 && header.version != 3))
        return base_fail(err, GBT_ERR_FORMAT, "%s: gzipped .spz of version %u (wanted 2 or 3)", file->name,
                         magic == SPZ_MAGIC ? header.version : 0u);
    GBT_TRY(spz_header_check(&header, file->name, err));
    size_t parts[SPZ_STREAMS], row = 0;
    spz_row_bytes(&header, parts);
    for (int i = 0; i < SPZ_STREAMS; i++)
        row += parts[i];
    const size_t count = header.count;
    if ((double)count * (double)row > 1032.0 * (double)file->size) /* the largest ratio of deflate */
        return base_fail(err, GBT_ERR_FORMAT, "%s: %zu Gaussians cannot be in %zu bytes", file->name, count,
                         file->size);
    unsigned char *streams = mem_alloc(count, row, "splats", err);
    gbt_status status = streams == NULL ? GBT_ERR_NO_MEMORY : unzip(z, file->name, streams, count * row, err);
    if (status == GBT_OK)
        status = unzip_end(z, file->name, header.flags & SPZ_EXTENSIONS ? EXTENSIONS_MAX : 0, err);
    if (status == GBT_OK)
        status = spz_unpack(streams, &header, out, err);
    mem_free(streams);
    return status;
}

/* Read versions 2 and 3. The axes are kept: nearly every writer uses those of the .ply it started from. */
static gbt_status spz_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (file->size >= 4 && memcmp(file->bytes, "NGSP", 4) == 0)
        return spz4_read(file, out, err);
    if (file->size < 18 || file->bytes[0] != 0x1f || file->bytes[1] != 0x8b)
        return base_fail(err, GBT_ERR_FORMAT, "%s: not an .spz file (wanted gzip data)", file->name);
    if (file->size > ZIPPED_MAX)
        return base_fail(err, GBT_ERR_FORMAT, "%s: gzipped .spz of %zu bytes (wanted less than 2 GiB)",
                         file->name, file->size);
    unsigned char *copy = mem_alloc(file->size, 1, "splats", err); /* zlib's input pointer is not const */
    if (copy == NULL)
        return GBT_ERR_NO_MEMORY;
    memcpy(copy, file->bytes, file->size);
    z_stream z = {.next_in = copy, .avail_in = (uInt)file->size};
    gbt_status status = GBT_ERR_NO_MEMORY;
    if (inflateInit2(&z, 15 + 16) != Z_OK)
        base_fail(err, status, "%s: no memory", file->name);
    else {
        status = read_zipped(&z, file, out, err);
        inflateEnd(&z);
    }
    mem_free(copy);
    return status;
}

const gaussian_format gaussian_format_spz = {
    .ending = ".spz",
    .what = "about a tenth of a .ply: positions to 2^-16 of a unit, colours in 4 to 8 bits",
    .degree = 3,
    .read = spz_read,
    .write = write_spz};

const gaussian_format gaussian_format_spz4 = {
    .ending = ".v4.spz",
    .what = "the values of .spz in version 4 of the format, zstd in place of gzip",
    .degree = 3,
    .read = spz_read,
    .write = spz4_write};
