/* SPDX-License-Identifier: Apache-2.0 */
/* base/image_header.c -- PNG, JPEG and EXR headers from a file, a few bytes at a time. */
#include "base/image_header.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"

enum {
    HEADER_PARTS_MAX = 10000, /* maximum number of markers, attributes, or chunks before the pixels that are
                                 parsed */
    PNG_CHUNKS_MAX = 1 << 20,
    SCAN_BYTES = 1 << 16, /* size of a read when searching for the end of a JPEG */
    EXR_NAME_MAX = 256
};

/* An open file of known size. Reads outside it, or failing ones, give zeros and set `is_short`. */
typedef struct reader {
    const char *path;
    int fd;
    uint64_t size;
    bool is_short;
    int failure; /* errno of a read that failed; 0: none */
    gbt_error *err;
} reader;

static void take(reader *r, uint64_t at, void *out, size_t count)
{
    const uint64_t rest = at < r->size ? r->size - at : 0;
    int failure;
    const size_t have = file_read_at(r->fd, at, out, rest < count ? (size_t)rest : count, &failure);
    if (failure != 0)
        r->failure = failure;
    if (have < count) {
        memset((char *)out + have, 0, count - have);
        r->is_short = true;
    }
}

static uint64_t big(const unsigned char *p, int count)
{
    uint64_t value = 0;
    for (int i = 0; i < count; i++)
        value = value << 8 | p[i];
    return value;
}

static uint64_t little(const unsigned char *p, int count)
{
    uint64_t value = 0;
    for (int i = count - 1; i >= 0; i--)
        value = value << 8 | p[i];
    return value;
}

static gbt_status truncated(const reader *r, const char *kind)
{
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s is truncated", r->path, kind);
}

static gbt_status set_size(const reader *r, int64_t width, int64_t height, int64_t channels,
                           image_header *out)
{
    if (width < 1 || height < 1 || width > IMAGE_SAMPLES_MAX || height > IMAGE_SAMPLES_MAX ||
        width * height > IMAGE_SAMPLES_MAX || width * height * channels > IMAGE_SAMPLES_MAX)
        return base_fail(
            r->err, GBT_ERR_FORMAT,
            "%s: image of %lld x %lld pixels and %lld channels (wanted 1 x 1 to %.0f megapixels)", r->path,
            (long long)width, (long long)height, (long long)channels, IMAGE_MEGAPIXELS_MAX(channels));
    out->width = (int)width;
    out->height = (int)height;
    return GBT_OK;
}

/* ---- EXIF ---- */

/* The orientation in `count` bytes of a TIFF header; 1 when there is none. */
static int exif_orientation(const unsigned char *tiff, size_t count)
{
    enum { TAG_ORIENTATION = 0x0112, ENTRY_BYTES = 12 };
    if (count < 8 || (memcmp(tiff, "II", 2) != 0 && memcmp(tiff, "MM", 2) != 0))
        return 1;
    uint64_t (*number)(const unsigned char *, int) = tiff[0] == 'I' ? little : big;
    const uint64_t at = number(tiff + 4, 4);
    if (at + 2 > count)
        return 1;
    const uint64_t entries = number(tiff + at, 2);
    for (uint64_t i = 0; i < entries; i++) {
        const uint64_t entry = at + 2 + i * ENTRY_BYTES;
        if (entry + ENTRY_BYTES > count)
            return 1;
        if (number(tiff + entry, 2) != TAG_ORIENTATION)
            continue;
        const uint64_t value = number(tiff + entry + 8, 2);
        return value >= 1 && value <= 8 ? (int)value : 1;
    }
    return 1;
}

static int read_exif(reader *r, uint64_t at, uint64_t size)
{
    unsigned char tiff[4096]; /* the first directory is at the start */
    const size_t count = size < sizeof tiff ? (size_t)size : sizeof tiff;
    take(r, at, tiff, count);
    return r->is_short ? 1 : exif_orientation(tiff, count);
}

/* ---- PNG ---- */

static gbt_status read_png(reader *r, image_header *out)
{
    unsigned char head[8], body[13];
    uint64_t at = 8;
    int channels = 0;
    bool has_pixels = false;
    for (int i = 0; i < (has_pixels ? PNG_CHUNKS_MAX : HEADER_PARTS_MAX); i++) {
        take(r, at, head, sizeof head);
        const uint64_t length = big(head, 4);
        if (r->is_short || at + 12 + length > r->size)
            return truncated(r, "PNG");
        if (i == 0) {
            static const int of_type[7] = {1, 0, 3, 3, 2, 0, 4};
            if (memcmp(head + 4, "IHDR", 4) != 0 || length != sizeof body)
                return base_fail(r->err, GBT_ERR_FORMAT,
                                 "%s: PNG does not start with an IHDR chunk of 13 bytes", r->path);
            take(r, at + 8, body, sizeof body);
            channels = body[9] < 7 ? of_type[body[9]] : 0;
            if (channels == 0)
                return base_fail(r->err, GBT_ERR_FORMAT, "%s: PNG of an unknown colour type (got %d)",
                                 r->path, body[9]);
            out->has_alpha = channels == 2 || channels == 4;
            GBT_TRY(set_size(r, (int64_t)big(body, 4), (int64_t)big(body + 4, 4), channels, out));
        }
        out->has_alpha = out->has_alpha || (!has_pixels && memcmp(head + 4, "tRNS", 4) == 0);
        has_pixels = has_pixels || memcmp(head + 4, "IDAT", 4) == 0;
        if (memcmp(head + 4, "eXIf", 4) == 0)
            out->orientation = read_exif(r, at + 8, length);
        if (memcmp(head + 4, "IEND", 4) == 0)
            return has_pixels ? GBT_OK
                              : base_fail(r->err, GBT_ERR_FORMAT, "%s: PNG holds no pixels", r->path);
        at += 12 + length;
    }
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: PNG of more than %d chunks", r->path,
                     (int)(has_pixels ? PNG_CHUNKS_MAX : HEADER_PARTS_MAX));
}

/* ---- JPEG ---- */

/* Whether there is an end marker after byte `from`. The search runs backwards, because the marker is nearly
   always at the end. */
static bool jpeg_ends(reader *r, uint64_t from)
{
    unsigned char part[SCAN_BYTES + 1];
    for (uint64_t end = r->size; end > from + 1;) {
        const uint64_t begin = end - from > sizeof part ? end - sizeof part : from;
        const size_t count = (size_t)(end - begin);
        take(r, begin, part, count);
        for (size_t i = count; i-- > 1;)
            if (part[i] == 0xd9 && part[i - 1] == 0xff)
                return true;
        end = begin == from ? from : begin + 1; /* a marker may be split between two reads */
    }
    return false;
}

static gbt_status read_jpeg(reader *r, image_header *out)
{
    unsigned char head[4], body[6];
    uint64_t at = 2;
    bool has_size = false;
    for (int i = 0; i < HEADER_PARTS_MAX; i++) {
        take(r, at, head, sizeof head);
        while (!r->is_short && head[0] == 0xff && head[1] == 0xff) /* a marker may be preceded by fill bytes
                                                                      0xff */
            take(r, ++at, head, sizeof head);
        if (r->is_short)
            break;
        if (head[0] != 0xff)
            return base_fail(r->err, GBT_ERR_FORMAT, "%s@%llu: JPEG is damaged (wanted a marker)", r->path,
                             (unsigned long long)at);
        const unsigned marker = head[1];
        if (marker == 0xd9)
            break;
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) { /* these have no length */
            at += 2;
            continue;
        }
        const uint64_t length = big(head + 2, 2);
        if (length < 2)
            return base_fail(r->err, GBT_ERR_FORMAT, "%s@%llu: JPEG is damaged (a part of %llu bytes)",
                             r->path, (unsigned long long)at, (unsigned long long)length);
        if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) {
            take(r, at + 4, body, sizeof body);
            if (r->is_short)
                break;
            GBT_TRY(set_size(r, (int64_t)big(body + 3, 2), (int64_t)big(body + 1, 2), body[5], out));
            has_size = true;
        }
        if (marker == 0xe1 && length > 8) {
            unsigned char name[6];
            take(r, at + 4, name, sizeof name);
            if (!r->is_short && memcmp(name, "Exif\0", sizeof name) == 0)
                out->orientation = read_exif(r, at + 10, length - 8);
        }
        if (marker == 0xda && has_size)
            return jpeg_ends(r, at + 2 + length) ? GBT_OK : truncated(r, "JPEG");
        at += 2 + length;
    }
    return truncated(r, "JPEG");
}

/* ---- EXR ---- */

/* Read a zero-terminated string; false when it is longer than an EXR allows. */
static bool take_name(reader *r, uint64_t *at, char out[EXR_NAME_MAX])
{
    size_t count = EXR_NAME_MAX;
    if (*at + count > r->size)
        count = *at < r->size ? (size_t)(r->size - *at) : 0;
    take(r, *at, out, count);
    const char *end = memchr(out, 0, count);
    r->is_short = r->is_short || end == NULL;
    if (end != NULL)
        *at += (uint64_t)(end - out) + 1;
    return !r->is_short;
}

/* Parse a chlist attribute: returns the number of channels, and finds colours and alpha by OpenImageIO's
   rules. */
static int64_t exr_channels(reader *r, uint64_t at, uint64_t end, image_header *out)
{
    char name[EXR_NAME_MAX];
    int64_t count = 0;
    unsigned found = 0;
    while (at < end && take_name(r, &at, name) && name[0] != '\0') {
        out->has_alpha = out->has_alpha || strcasecmp(name, "A") == 0 || strcasecmp(name, "Alpha") == 0;
        for (unsigned c = 0; c < 3; c++)
            found |= (strcasecmp(name, (const char *[]){"R", "G", "B"}[c]) == 0) << c;
        at += 16;
        count++;
    }
    out->has_colors = found == 7 || count == 1 || (count == 2 && out->has_alpha); /* or grey */
    return count;
}

static gbt_status read_exr(reader *r, image_header *out)
{
    enum { DEEP = 0x800, PARTS = 0x1000 };
    unsigned char bytes[16];
    char name[EXR_NAME_MAX], type[EXR_NAME_MAX];
    uint64_t at = 8;
    int64_t channels = 0, data[4] = {0, 0, -1, -1}, display[4] = {0};
    bool has_display = false;
    take(r, 4, bytes, 4);
    if (little(bytes, 4) & (DEEP | PARTS))
        return base_fail(r->err, GBT_ERR_FORMAT,
                         "%s: deep or multi-part EXR is not supported (wanted one flat part)", r->path);
    for (int i = 0; i < HEADER_PARTS_MAX && take_name(r, &at, name) && name[0] != '\0'; i++) {
        if (!take_name(r, &at, type))
            break;
        take(r, at, bytes, 4);
        const uint64_t length = little(bytes, 4);
        at += 4;
        if (r->is_short || length > r->size - at) {
            r->is_short = true;
            break;
        }
        if (strcmp(name, "channels") == 0)
            channels = exr_channels(r, at, at + length, out);
        const bool is_display = strcmp(name, "displayWindow") == 0;
        if ((is_display || strcmp(name, "dataWindow") == 0) && length == 16) {
            take(r, at, bytes, 16);
            for (int k = 0; k < 4; k++)
                (is_display ? display : data)[k] = (int32_t)little(bytes + 4 * k, 4);
            has_display = has_display || is_display;
        }
        at += length;
    }
    if (r->is_short)
        return truncated(r, "EXR");
    GBT_TRY(set_size(r, data[2] - data[0] + 1, data[3] - data[1] + 1, channels, out));
    if (has_display && memcmp(data, display, sizeof data) != 0)
        return base_fail(
            r->err, GBT_ERR_FORMAT,
            "%s: EXR is cropped: its data window is not its display window (wanted the whole picture)",
            r->path);
    if (channels < 1)
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: EXR has no channels", r->path);
    return at + 8 < r->size ? GBT_OK : truncated(r, "EXR"); /* at least one offset and some data after it */
}

/* ---- entries ---- */

gbt_status image_header_colors(const char *path, const image_header *header, gbt_error *err)
{
    if (header->has_colors)
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT, "%s: EXR has no channels R, G and B (layers are not looked into)",
                     path);
}

static gbt_status refuse_format(const reader *r, const unsigned char magic[12])
{
    const char *what = r->size == 0                        ? " (it is empty)"
                       : memcmp(magic, "GIF8", 4) == 0     ? " (got a GIF)"
                       : memcmp(magic + 4, "ftyp", 4) == 0 ? " (got HEIC, AVIF or a video)"
                       : memcmp(magic + 8, "WEBP", 4) == 0 ? " (got WebP)"
                       : memcmp(magic, "BM", 2) == 0       ? " (got a BMP)"
                       : memcmp(magic, "II*", 4) == 0 || memcmp(magic, "MM\0*", 4) == 0 ? " (got a TIFF)"
                       : magic[0] == '<'                                                ? " (got HTML or XML)"
                                                                                        : "";
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: not a PNG, JPEG or EXR file%s", r->path, what);
}

gbt_status image_header_read(const char *path, image_header *out, gbt_error *err)
{
    static const unsigned char png[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'},
                               jpeg[3] = {0xff, 0xd8, 0xff}, exr[4] = {0x76, 0x2f, 0x31, 0x01};
    *out = (image_header){.orientation = 1, .has_colors = true};
    reader r = {.path = path, .fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK), .err = err};
    struct stat info;
    if (r.fd < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    gbt_status status;
    if (fstat(r.fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        status = base_fail(err, GBT_ERR_IO, "%s: not a regular file", path);
    } else {
        unsigned char magic[12];
        r.size = (uint64_t)info.st_size;
        take(&r, 0, magic, sizeof magic);
        r.is_short = false;
        if (memcmp(magic, png, sizeof png) == 0) {
            out->kind = IMAGE_PNG;
            status = read_png(&r, out);
        } else if (memcmp(magic, jpeg, sizeof jpeg) == 0) {
            out->kind = IMAGE_JPEG;
            status = read_jpeg(&r, out);
        } else if (memcmp(magic, exr, sizeof exr) == 0) {
            out->kind = IMAGE_EXR;
            status = read_exr(&r, out);
        } else {
            status = refuse_format(&r, magic);
        }
        if (r.failure != 0) /* a read failure takes precedence over errors caused by the zeros in its place */
            status = base_fail(err, GBT_ERR_IO, "%s: read failed: %s", path, strerror(r.failure));
    }
    close(r.fd);
    return status;
}
