/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_file.c -- header { "NGSP", version, count, degree, fractional bits, flags, 0 }, then streams of
   positions, opacities, colours, scales, rotations and spherical harmonics; all of it gzipped. */
#include <math.h>
#include <zlib.h>

#include "base/file.h"
#include "data/gaussian_formats.h"

enum {
    MAGIC = 0x5053474e,
    HEADER_BYTES = 16,
    FRACTION_BITS_MAX = 16,
    COORDINATE_MAX = 8388607 /* 24 bits with a sign */
};

static const double color_step = 0.15; /* of f_dc, in units of 255 levels */

/* Bytes of a Gaussian in each stream. */
typedef struct layout {
    size_t rotation, harmonics; /* the latter without degree 0 */
    size_t row;                 /* all streams */
} layout;

static layout layout_of(unsigned version, int degree)
{
    layout l = {.rotation = version == 2 ? 3 : 4,
                .harmonics = 3 * ((size_t)((degree + 1) * (degree + 1)) - 1)};
    l.row = 9 + 1 + 3 + 3 + l.rotation + l.harmonics;
    return l;
}

/* ---- writing ---- */

static gbt_status find_fraction(const gaussian_cloud *cloud, const double origin[3], const char *path,
                                int *bits, gbt_error *err)
{
    double largest = 0;
    for (size_t i = 0; i < 3 * cloud->count; i++)
        largest = fmax(largest, fabs((double)cloud->mean[i] + origin[i % 3]));
    if (!(largest <= COORDINATE_MAX))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: a coordinate of %g does not fit a .spz file (limit %d)",
                         path, largest, (int)COORDINATE_MAX);
    *bits = 0;
    while (*bits < FRACTION_BITS_MAX && largest * exp2(*bits + 1) <= COORDINATE_MAX)
        ++*bits;
    return GBT_OK;
}

/* The largest of four components is left out, with the sign that makes it positive: 2 bits say which, then
   sign and 9 bits for each other. */
static uint32_t pack_rotation(const float wxyz[4])
{
    const float q[4] = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
    int largest = 0;
    for (int k = 1; k < 4; k++)
        if (fabsf(q[k]) > fabsf(q[largest]))
            largest = k;
    uint32_t bits = (uint32_t)largest;
    for (int k = 0; k < 4; k++) {
        if (k == largest)
            continue;
        const double level = fmin(nearbyint(511 * fabs((double)q[k]) * sqrt(2)), 511);
        const bool negative = (q[k] < 0) != (q[largest] < 0);
        bits = bits << 10 | (uint32_t)negative << 9 | (uint32_t)level;
    }
    return bits;
}

/* Steps of 8 in degree 1, of 16 above: what is left compresses. */
static unsigned harmonic_byte(float value, size_t coefficient)
{
    const int step = coefficient <= 3 ? 8 : 16;
    const double level = nearbyint(128 * (double)value) + 128;
    const int whole = level > 255 ? 255
                      : level > 0 ? (int)level
                                  : 0,
              rounded = (whole + step / 2) / step * step;
    return (unsigned)(rounded > 255 ? 255 : rounded);
}

static void put_streams(sink *s, const gaussian_cloud *cloud, const double origin[3], int fraction)
{
    const size_t n = cloud->count, functions = (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1));
    for (size_t i = 0; i < 3 * n; i++)
        sink_put_uint(s, (uint64_t)(int64_t)llrint(((double)cloud->mean[i] + origin[i % 3]) * exp2(fraction)),
                      3);
    for (size_t i = 0; i < n; i++)
        sink_put_level(s, 255 * (double)cloud->opacity[i]);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++)
            sink_put_level(s, (double)cloud->sh[i * GAUSSIAN_SH_COUNT * 3 + c] * color_step * 255 + 127.5);
    for (size_t i = 0; i < 3 * n; i++)
        sink_put_level(s, ((double)cloud->scale_log[i] + 10) * 16);
    for (size_t i = 0; i < n; i++)
        sink_put_uint(s, pack_rotation(cloud->quat + 4 * i), 4);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 1; k < functions; k++)
            for (size_t c = 0; c < 3; c++)
                sink_put_uint(s, harmonic_byte(cloud->sh[(i * GAUSSIAN_SH_COUNT + k) * 3 + c], k), 1);
}

static gbt_status zip_and_write(const char *path, const sink *plain, gbt_error *err)
{
    z_stream z = {.next_in = plain->bytes, .avail_in = (uInt)plain->size};
    if (plain->size > UINT32_MAX / 2)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: too many Gaussians for a .spz file", path);
    if (deflateInit2(&z, 9, Z_DEFLATED, 15 + 16 /* a gzip header */, 8, Z_DEFAULT_STRATEGY) != Z_OK)
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
 * Write version 3, in the cloud's own axes. Positions get as many fractional bits, up to 16, as their largest
 * coordinate leaves of 23; scales are steps of 6 % between e^-10 and e^5.9, spherical harmonics 5 bits in
 * degree 1 and 4 above.
 *
 * @param origin [in] added to every mean in double
 * @return GBT_OK; GBT_ERR_ARGUMENT (a coordinate beyond 8 million); as file_write_atomic()
 */
static gbt_status write_spz(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err)
{
    int fraction = 0;
    GBT_TRY(find_fraction(cloud, origin, path, &fraction, err));
    if (cloud->count > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: too many Gaussians for a .spz file", path);
    sink s = {.err = err};
    sink_put_uint(&s, MAGIC, 4);
    sink_put_uint(&s, 3, 4);
    sink_put_uint(&s, cloud->count, 4);
    sink_put_uint(&s, (uint64_t)cloud->sh_degree, 1);
    sink_put_uint(&s, (uint64_t)fraction, 1);
    sink_put_uint(&s, 0, 2);
    put_streams(&s, cloud, origin, fraction);
    gbt_status status = s.status;
    if (status == GBT_OK)
        status = zip_and_write(path, &s, err);
    sink_free(&s);
    return status;
}

/* ---- reading ---- */

/* Inflate exactly `size` bytes more into `out`. */
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

/* The stream ends here: its checksum and its length are right. */
static gbt_status unzip_end(z_stream *z, const char *name, gbt_error *err)
{
    unsigned char more;
    z->next_out = &more;
    z->avail_out = 1;
    if (inflate(z, Z_FINISH) == Z_STREAM_END)
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT, "%s: its gzip stream is damaged, or longer or shorter than it says",
                     name);
}

static void unpack_rotation(const unsigned char *bytes, unsigned version, float wxyz[4])
{
    float q[4] = {0, 0, 0, 0}, square = 0;
    int missing = 3;
    if (version == 2)
        for (int k = 0; k < 3; k++)
            q[k] = (float)bytes[k] / 127.5f - 1;
    else {
        const uint32_t bits = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
                              (uint32_t)bytes[3] << 24;
        missing = (int)(bits >> 30);
        for (int k = 3, shift = 0; k >= 0; k--) {
            if (k == missing)
                continue;
            const float level = (float)(bits >> shift & 511) / 511 * 0.70710678f;
            q[k] = bits >> shift & 512 ? -level : level;
            shift += 10;
        }
    }
    for (int k = 0; k < 4; k++)
        square += q[k] * q[k];
    q[missing] = sqrtf(fmaxf(0, 1 - square));
    const float norm = sqrtf(fmaxf(square, 1));
    wxyz[0] = q[3] / norm;
    for (int k = 0; k < 3; k++)
        wxyz[1 + k] = q[k] / norm;
}

static void unpack(const unsigned char *at, unsigned version, int degree, int fraction, gaussian_cloud *out)
{
    const size_t n = out->count;
    const layout l = layout_of(version, degree);
    const unsigned char *alpha = at + 9 * n, *color = alpha + n, *scale = color + 3 * n,
                        *rotation = scale + 3 * n, *harmonics = rotation + l.rotation * n;
    out->sh_degree = degree;
    for (size_t i = 0; i < 3 * n; i++) {
        const uint32_t bits =
            (uint32_t)at[3 * i] | (uint32_t)at[3 * i + 1] << 8 | (uint32_t)at[3 * i + 2] << 16;
        out->mean[i] = (float)(((double)bits - (bits & 0x800000 ? 0x1p24 : 0)) * exp2(-fraction));
        out->scale_log[i] = (float)scale[i] / 16 - 10;
    }
    memset(out->sh, 0, n * GAUSSIAN_SH_COUNT * 3 * sizeof *out->sh);
    for (size_t i = 0; i < n; i++) {
        float *sh = out->sh + i * GAUSSIAN_SH_COUNT * 3;
        out->opacity[i] = (float)alpha[i] / 255;
        for (size_t c = 0; c < 3; c++)
            sh[c] = (float)(((double)color[3 * i + c] - 127.5) / (color_step * 255));
        for (size_t k = 0; k < l.harmonics; k++)
            sh[3 + k] = ((float)harmonics[l.harmonics * i + k] - 128) / 128;
        unpack_rotation(rotation + l.rotation * i, version, out->quat + 4 * i);
        out->scales_clamped += gaussian_limit_scales(out->scale_log + 3 * i);
    }
}

static gbt_status read_zipped(z_stream *z, const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    unsigned char header[HEADER_BYTES];
    GBT_TRY(unzip(z, file->name, header, sizeof header, err));
    const source_file head = {.name = file->name, .bytes = header, .size = sizeof header};
    cursor c = {.file = &head};
    const uint32_t magic = cursor_u32(&c), version = cursor_u32(&c), count = cursor_u32(&c);
    const int degree = header[12], fraction = header[13];
    if (magic != MAGIC || (version != 2 && version != 3))
        return base_fail(err, GBT_ERR_FORMAT, "%s: .spz version %u (wanted 2 or 3)", file->name,
                         magic == MAGIC ? version : 0u);
    if (degree > 3 || fraction > 24 || count == 0)
        return base_fail(
            err, GBT_ERR_FORMAT,
            "%s: %u Gaussians, degree %d, %d fractional bits (wanted 1 or more, 0 to 3, 0 to 24)", file->name,
            count, degree, fraction);
    const size_t row = layout_of(version, degree).row;
    if ((double)count * (double)row > 1032.0 * (double)file->size) /* gzip makes nothing smaller than that */
        return base_fail(err, GBT_ERR_FORMAT, "%s: %u Gaussians cannot be in %zu bytes", file->name, count,
                         file->size);
    unsigned char *streams = mem_alloc(count, row, "splats", err);
    gbt_status status = streams == NULL ? GBT_ERR_NO_MEMORY : unzip(z, file->name, streams, count * row, err);
    if (status == GBT_OK)
        status = unzip_end(z, file->name, err);
    if (status == GBT_OK)
        status = gaussian_cloud_alloc(out, count, err);
    if (status == GBT_OK)
        unpack(streams, version, degree, fraction, out);
    mem_free(streams);
    return status;
}

/*
 * Read one, in the axes that it has (those of the .ply it was made from, as nearly every writer keeps them).
 *
 * @param out [out] free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT (damaged, another version, more than the streams hold); GBT_ERR_NO_MEMORY
 */
static gbt_status read_spz(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (file->size >= 4 && memcmp(file->bytes, "NGSP", 4) == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: .spz version 4 (wanted 2 or 3, which are gzipped)",
                         file->name);
    if (file->size < 18 || file->bytes[0] != 0x1f || file->bytes[1] != 0x8b || file->size > UINT32_MAX / 2)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no .spz file (it does not begin as gzip does)",
                         file->name);
    unsigned char *copy = mem_alloc(file->size, 1, "splats", err); /* zlib's pointer is not const */
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
    .read = read_spz,
    .write = write_spz};
