/* SPDX-License-Identifier: Apache-2.0 */
/* shim/image_oiio.cpp -- base/image.h on OpenImageIO: images from and to memory; no exception leaves this
   file.

   file --> bytes --> [magic: png, jpeg, openexr] --> that one plugin, from memory --> native samples -->
   float in [0, 1]

   The plugin is chosen by the first bytes, so that the file name cannot select one of OpenImageIO's 20 other
   parsers. A PNG is reduced to its pixel chunks first, because libpng prints warnings about damaged and
   unusual chunks to stderr, which OpenImageIO cannot prevent. */
#include "base/image.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <zlib.h>

extern "C" {
#include "base/fail.h"
#include "base/file.h"
#include "base/image_header.h"
#include "base/library_end.h"
#include "base/log.h"
#include "base/memory.h"
}

namespace {

constexpr int64_t max_samples = IMAGE_SAMPLES_MAX;
constexpr size_t magic_bytes = 8;
constexpr size_t reader_bytes = size_t(1) << 20; /* memory that a reader needs besides the pixels */

struct bytes_owner {
    unsigned char *bytes = nullptr;
    size_t count = 0;
    bytes_owner() = default;
    bytes_owner(const bytes_owner &) = delete;
    bytes_owner &operator=(const bytes_owner &) = delete;
    ~bytes_owner() { mem_free(bytes); }
};

/* Members are destroyed in reverse order: first the reader, then the proxy and the bytes that it uses. */
struct opened_image {
    image_header header;
    bytes_owner file;
    std::unique_ptr<OIIO::Filesystem::IOMemReader> proxy;
    std::unique_ptr<OIIO::ImageInput> input;
    bool is_grey = false;
    int stored_channels = 0; /* how many of the leading channels we read: 1..4 */
    int channels() const { return is_grey ? stored_channels + 2 : stored_channels; }
};

std::string first_line(const std::string &text)
{
    const std::string line = text.substr(0, text.find('\n'));
    return line.empty() ? std::string("no reason given") : line;
}

/* OpenImageIO reports some errors on the object and some globally. Both must be fetched, or the next call
   reports them. */
std::string reason_of(const OIIO::ImageInput *input)
{
    const std::string global = OIIO::has_error() ? OIIO::geterror() : std::string();
    const std::string own = input != nullptr && input->has_error() ? input->geterror() : std::string();
    return first_line(own.empty() ? global : own);
}

/*
 * libpng and libjpeg report lack of memory only in the text of their errors. The last two texts are those for
 * a list that could not grow.
 */
gbt_status status_of(const std::string &reason, gbt_status otherwise)
{
    for (const char *words :
         {"insufficient memory", "out of memory", "could not create png", "too many text chunks"})
        if (OIIO::Strutil::icontains(reason, words))
            return GBT_ERR_NO_MEMORY;
    return otherwise;
}

gbt_status cannot_read(const char *path, const char *what, const OIIO::ImageInput *input, gbt_error *err)
{
    const std::string reason = reason_of(input);
    return base_fail(err, status_of(reason, GBT_ERR_FORMAT), "%s: %s: %s", path, what, reason.c_str());
}

/* OpenImageIO gives no reason when it lacked the memory to store one. */
gbt_status no_plugin(const char *path, const char *plugin, const char *what, gbt_error *err)
{
    const std::string reason = OIIO::has_error() ? first_line(OIIO::geterror()) : "out of memory";
    return base_fail(err, reason == "out of memory" ? GBT_ERR_NO_MEMORY : GBT_ERR_INTERNAL,
                     "%s: OpenImageIO has no %s %s: %s", path, plugin, what, reason.c_str());
}

uint32_t big_endian(const unsigned char *p)
{
    return uint32_t(p[0]) << 24 | uint32_t(p[1]) << 16 | uint32_t(p[2]) << 8 | uint32_t(p[3]);
}

/* Check every chunk, and keep in place those that affect pixels. Colour profiles, gamma and texts would not
   be used anyway. */
gbt_status png_reduce(const char *path, unsigned char *bytes, size_t *count, gbt_error *err)
{
    static const char kept[][5] = {"IHDR", "PLTE", "tRNS", "IDAT", "IEND"};
    size_t read = magic_bytes, write = magic_bytes;
    for (bool ended = false; !ended;) {
        if (*count - read < 12)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s@%zu: PNG is truncated (wanted a chunk of 12 bytes or more, got %zu)", path,
                             read, *count - read);
        const size_t length = big_endian(bytes + read);
        if (length > *count - read - 12)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s@%zu: PNG is truncated (wanted a chunk of %zu bytes, got %zu)", path, read,
                             length, *count - read - 12);
        const unsigned char *type = bytes + read + 4;
        const uint32_t wanted = big_endian(type + 4 + length), got = uint32_t(crc32_z(0, type, length + 4));
        if (wanted != got)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s@%zu: PNG chunk is damaged (wanted checksum %08x, got %08x)", path, read,
                             (unsigned)wanted, (unsigned)got);
        if (read == magic_bytes && (std::memcmp(type, "IHDR", 4) != 0 || length != 13))
            return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: PNG does not start with an IHDR chunk of 13 bytes",
                             path, read);
        ended = std::memcmp(type, "IEND", 4) == 0;
        bool keep = false;
        for (const char *name : kept)
            keep = keep || std::memcmp(type, name, 4) == 0;
        if (keep) {
            std::memmove(bytes + write, bytes + read, length + 12);
            write += length + 12;
        }
        read += length + 12;
    }
    *count = write;
    return GBT_OK;
}

/* libpng, libjpeg and OpenEXR do not check all of their allocations, so check beforehand that there is enough
   memory. This is no guarantee: the file may have changed since its header was read. */
gbt_status check_memory(const char *path, const image_header &header, gbt_error *err)
{
    const size_t samples = size_t(header.width) * size_t(header.height) * 4;
    return mem_check(samples + size_t(reader_bytes), sizeof(float) + 2, path, err);
}

gbt_status check_spec(const char *path, const char *plugin, opened_image *o, gbt_error *err)
{
    const OIIO::ImageSpec &spec = o->input->spec();
    if (spec.deep)
        return base_fail(err, GBT_ERR_FORMAT, "%s: deep EXR is not supported (wanted one flat part)", path);
    if (std::strcmp(plugin, "openexr") == 0 && spec.get_int_attribute("oiio:subimages", 1) > 1)
        return base_fail(err, GBT_ERR_FORMAT, "%s: multi-part EXR is not supported (wanted one part, got %d)",
                         path, spec.get_int_attribute("oiio:subimages", 1));
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: image of %d x %d x %d pixels and %d channels (wanted at least 1 x 1 x 1 and 1)",
                         path, spec.width, spec.height, spec.depth, spec.nchannels);
    /* No product exceeds 2^62: each factor is a positive int; the first two are checked before the third. */
    const int64_t pixels = int64_t(spec.width) * spec.height,
                  tile = int64_t(spec.tile_width) * spec.tile_height;
    if (pixels > max_samples || pixels * spec.nchannels > max_samples || tile > max_samples ||
        tile * spec.nchannels > max_samples)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: image of %d x %d pixels and %d channels (wanted at most %.0f megapixels)", path,
                         spec.width, spec.height, spec.nchannels, IMAGE_MEGAPIXELS_MAX(spec.nchannels));
    o->is_grey = spec.nchannels == 1 || (spec.nchannels == 2 && spec.alpha_channel == 1);
    if (!o->is_grey && spec.nchannels == 2)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: image has channels \"%s\" and \"%s\" (wanted grey, RGB or RGBA)", path,
                         spec.channel_name(0).c_str(), spec.channel_name(1).c_str());
    /* An EXR may have further channels after RGB, such as depth and normals, which are ignored; so is the
       alpha of a layer. */
    const bool has_alpha =
        spec.nchannels > 3 && spec.alpha_channel == 3 && spec.channel_name(3).find('.') == std::string::npos;
    o->stored_channels = o->is_grey ? spec.nchannels : has_alpha ? 4 : 3;
    return GBT_OK;
}

/* The header is read first, so that rejecting a file costs no memory. */
gbt_status open_image(const char *path, opened_image *o, gbt_error *err)
{
    static const char *const plugins[] = {"png", "jpeg", "openexr"}; /* by image_kind */
    image_header &header = o->header;
    gbt_status status = image_header_read(path, &header, err);
    if (status == GBT_OK)
        status = file_read(path, &o->file.bytes, &o->file.count, err);
    const char *plugin = plugins[header.kind];
    if (status == GBT_OK && header.kind == IMAGE_PNG)
        status = png_reduce(path, o->file.bytes, &o->file.count, err);
    if (status == GBT_OK)
        status = check_memory(path, header, err);
    if (status != GBT_OK)
        return status;
    o->input = OIIO::ImageInput::create(plugin);
    if (!o->input)
        return no_plugin(path, plugin, "reader", err);
    OIIO::ImageSpec config, spec;
    config.attribute("oiio:UnassociatedAlpha", 1); /* keep colours as stored: a PNG's are then not multiplied
                                                      by alpha; an EXR's are premultiplied in any case */
    o->proxy = std::make_unique<OIIO::Filesystem::IOMemReader>(o->file.bytes, o->file.count);
    if (!o->input->set_ioproxy(o->proxy.get()))
        return base_fail(err, GBT_ERR_INTERNAL, "%s: OpenImageIO's %s reader cannot read from memory", path,
                         plugin);
    if (!o->input->open(path, spec, config))
        return cannot_read(path, (std::string("cannot be read as ") + plugin).c_str(), o->input.get(), err);
    return check_spec(path, plugin, o, err);
}

/* Division instead of multiplication by a rounded 1/255, so that each level becomes the float nearest to
   level/255. */
template <typename level> std::vector<float> level_table()
{
    const size_t count = size_t(level(-1)) + 1;
    std::vector<float> table(count);
    for (size_t i = 0; i < count; i++)
        table[i] = float(i) / float(count - 1);
    return table;
}

/* Convert samples; grey becomes three equal channels. */
template <typename sample, typename convert>
void expand(const sample *in, const opened_image &o, size_t pixels, float *out, convert to_float)
{
    const size_t stored = size_t(o.stored_channels), wanted = size_t(o.channels());
    for (size_t i = 0; i < pixels; i++, in += stored, out += wanted) {
        if (!o.is_grey) {
            for (size_t c = 0; c < stored; c++)
                out[c] = to_float(in[c]);
            continue;
        }
        out[0] = out[1] = out[2] = to_float(in[0]);
        if (stored == 2)
            out[3] = to_float(in[1]);
    }
}

template <typename sample, typename convert>
gbt_status read_samples(const char *path, opened_image *o, OIIO::TypeDesc type, image *out, convert to_float,
                        gbt_error *err)
{
    const size_t pixels = size_t(out->width) * size_t(out->height);
    std::vector<sample> samples(pixels * size_t(o->stored_channels));
    const bool done = o->input->read_image(0, 0, 0, o->stored_channels, type, samples.data());
    /* A truncated JPEG is read "successfully", with grey in the missing part; only the error text tells. */
    if (!done || o->input->has_error())
        return cannot_read(path, "damaged or truncated", o->input.get(), err);
    expand(samples.data(), *o, pixels, out->pixels, to_float);
    return GBT_OK;
}

/* Replace values that are not finite by 0. `valid` marks the pixels without such values; NULL: warn. */
gbt_status drop_not_finite(const char *path, image *out, unsigned char **valid, gbt_error *err)
{
    const size_t pixels = size_t(out->width) * size_t(out->height), channels = size_t(out->channels);
    size_t bad = 0;
    for (size_t i = 0; i < pixels * channels; i++) {
        if (std::isfinite(out->pixels[i]))
            continue;
        if (valid != nullptr && *valid == nullptr) {
            *valid = static_cast<unsigned char *>(mem_alloc(pixels, 1, "valid pixels", err));
            if (*valid == nullptr)
                return GBT_ERR_NO_MEMORY;
            std::memset(*valid, 1, pixels);
        }
        if (valid != nullptr)
            (*valid)[i / channels] = 0;
        out->pixels[i] = 0;
        bad++;
    }
    if (bad > 0 && valid == nullptr)
        log_warn("%s: %zu values that are not finite were read as 0", path, bad);
    return GBT_OK;
}

gbt_status read_pixels(const char *path, opened_image *o, image *out, unsigned char **valid, gbt_error *err)
{
    const OIIO::ImageSpec &spec = o->input->spec();
    gbt_status status = image_header_colors(path, &o->header, err);
    if (status == GBT_OK)
        status = image_alloc(out, spec.width, spec.height, o->channels(), err);
    if (status != GBT_OK)
        return status;
    switch (spec.format.basetype) {
    case OIIO::TypeDesc::UINT8: {
        static const std::vector<float> table = level_table<uint8_t>();
        return read_samples<uint8_t>(
            path, o, OIIO::TypeUInt8, out, [](uint8_t v) { return table[v]; }, err);
    }
    case OIIO::TypeDesc::UINT16: {
        static const std::vector<float> table = level_table<uint16_t>();
        return read_samples<uint16_t>(
            path, o, OIIO::TypeUInt16, out, [](uint16_t v) { return table[v]; }, err);
    }
    default:
        break;
    }
    status = read_samples<float>(
        path, o, OIIO::TypeFloat, out, [](float v) { return v; }, err);
    return status == GBT_OK ? drop_not_finite(path, out, valid, err) : status;
}

gbt_status read_raw(const char *path, opened_image *o, image *out, image_names *names, gbt_error *err)
{
    const OIIO::ImageSpec &spec = o->input->spec();
    bool is_float = spec.format == OIIO::TypeFloat;
    for (const OIIO::TypeDesc &type : spec.channelformats)
        is_float = is_float && type == OIIO::TypeFloat;
    if (!is_float || std::strcmp(o->input->format_name(), "openexr") != 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: %s with samples of type %s (wanted an EXR of 32-bit floats)", path,
                         o->input->format_name(), spec.format.c_str());
    if (spec.nchannels > IMAGE_RAW_CHANNELS)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %d channels (wanted at most %d)", path, spec.nchannels,
                         int(IMAGE_RAW_CHANNELS));
    for (int c = 0; c < spec.nchannels; c++)
        std::snprintf(names->name[c], sizeof names->name[c], "%s", spec.channel_name(c).c_str());
    gbt_status status = image_alloc(out, spec.width, spec.height, spec.nchannels, err);
    if (status == GBT_OK && (!o->input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, out->pixels) ||
                             o->input->has_error()))
        status = cannot_read(path, "damaged or truncated", o->input.get(), err);
    return status;
}

uint8_t to_byte(float value)
{
    if (!(value > 0.0f)) /* false for NaN as well */
        return 0;
    return value >= 1.0f ? 255 : uint8_t(std::floor(value * 255.0f + 0.5f));
}

gbt_status check_source(const image *im, gbt_error *err)
{
    if (im == nullptr || im->pixels == nullptr || im->width < 1 || im->height < 1 || im->channels < 1 ||
        im->channels > 4)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "image: nothing that can be encoded (wanted pixels of 1 to 4 channels)");
    if (int64_t(im->width) * im->height > max_samples ||
        int64_t(im->width) * im->height * im->channels > max_samples)
        return base_fail(err, GBT_ERR_ARGUMENT, "image: %d x %d x %d (wanted at most %.0f megapixels)",
                         im->width, im->height, im->channels, IMAGE_MEGAPIXELS_MAX(im->channels));
    return GBT_OK;
}

gbt_status encode(const char *plugin, const char *name, const OIIO::ImageSpec &spec, const void *samples,
                  std::vector<unsigned char> *bytes, gbt_error *err)
{
    OIIO::Filesystem::IOVecOutput proxy(*bytes);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(plugin);
    if (!output)
        return no_plugin("image", plugin, "writer", err);
    if (!output->set_ioproxy(&proxy) || !output->open(name, spec) ||
        !output->write_image(spec.format, samples) || !output->close()) {
        const std::string reason = first_line(output->geterror());
        return base_fail(err, status_of(reason, GBT_ERR_INTERNAL), "image: %s writer failed: %s", plugin,
                         reason.c_str());
    }
    return GBT_OK;
}

/* `channels` leading channels of `im` as 8-bit samples. */
std::vector<uint8_t> quantized(const image *im, int channels)
{
    const size_t pixels = size_t(im->width) * size_t(im->height);
    std::vector<uint8_t> out(pixels * size_t(channels));
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++)
            out[i * size_t(channels) + size_t(c)] = to_byte(im->pixels[i * size_t(im->channels) + size_t(c)]);
    return out;
}

gbt_status encode_png(const image *im, std::vector<unsigned char> *bytes, gbt_error *err)
{
    const std::vector<uint8_t> samples = quantized(im, im->channels);
    OIIO::ImageSpec spec(im->width, im->height, im->channels, OIIO::TypeUInt8);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("png:compressionLevel", 4); /* the default, 6, takes three times as long for a file 8 %
                                                  smaller */
    return encode("png", "image.png", spec, samples.data(), bytes, err);
}

gbt_status encode_exr(const image *im, std::vector<unsigned char> *bytes, gbt_error *err)
{
    OIIO::ImageSpec spec(im->width, im->height, im->channels, OIIO::TypeFloat);
    spec.attribute("DateTime", ""); /* else OpenImageIO writes the time: no two files would be equal */
    return encode("openexr", "image.exr", spec, im->pixels, bytes, err);
}

/* When writing, OpenImageIO keeps libjpeg's default handling of a failed allocation, which is exit(1). */
struct jpeg_exit_guard {
    jpeg_exit_guard() { library_exit_is_failure(true); }
    ~jpeg_exit_guard() { library_exit_is_failure(false); }
};

gbt_status encode_jpeg(const image *im, int quality, std::vector<unsigned char> *bytes, gbt_error *err)
{
    const int channels = im->channels < 3 ? 1 : 3; /* JPEG has no alpha */
    const std::vector<uint8_t> samples = quantized(im, channels);
    OIIO::ImageSpec spec(im->width, im->height, channels, OIIO::TypeUInt8);
    spec.attribute("Compression", "jpeg:" + std::to_string(quality));
    spec.attribute("CompressionQuality", quality);
    const jpeg_exit_guard guard;
    return encode("jpeg", "image.jpg", spec, samples.data(), bytes, err);
}

gbt_status hand_over(const std::vector<unsigned char> &from, unsigned char **bytes, size_t *byte_count,
                     gbt_error *err)
{
    *bytes = static_cast<unsigned char *>(mem_alloc(from.size(), 1, "encoded image", err));
    if (*bytes == nullptr)
        return GBT_ERR_NO_MEMORY;
    std::memcpy(*bytes, from.data(), from.size());
    *byte_count = from.size();
    return GBT_OK;
}

/* Convert the current exception to a status. Must be called inside a catch handler. */
gbt_status caught(const char *path, gbt_status otherwise, gbt_error *err)
try {
    throw;
} catch (const std::bad_alloc &) {
    return base_fail(err, GBT_ERR_NO_MEMORY, "%s: out of memory", path);
} catch (const std::exception &e) {
    return base_fail(err, otherwise, "%s: %s", path, e.what());
} catch (...) {
    return base_fail(err, otherwise, "%s: OpenImageIO failed", path);
}

/* Open a file and let `read` fill `out` from it. */
template <typename reader> gbt_status read_file(const char *path, image *out, gbt_error *err, reader read)
try {
    std::memset(out, 0, sizeof *out);
    opened_image o;
    gbt_status status = open_image(path, &o, err);
    if (status == GBT_OK)
        status = read(&o);
    if (status != GBT_OK)
        image_free(out);
    return status;
} catch (...) {
    image_free(out);
    return caught(path, GBT_ERR_FORMAT, err);
}

} // namespace

extern "C" gbt_status image_read(const char *path, image *out, gbt_error *err)
{
    return image_read_valid(path, out, nullptr, err);
}

extern "C" gbt_status image_read_valid(const char *path, image *out, unsigned char **valid, gbt_error *err)
{
    if (valid != nullptr)
        *valid = nullptr;
    const gbt_status status =
        read_file(path, out, err, [=](opened_image *o) { return read_pixels(path, o, out, valid, err); });
    if (status != GBT_OK && valid != nullptr) {
        mem_free(*valid);
        *valid = nullptr;
    }
    return status;
}

extern "C" gbt_status image_read_raw(const char *path, image *out, image_names *names, gbt_error *err)
{
    return read_file(path, out, err, [=](opened_image *o) { return read_raw(path, o, out, names, err); });
}

extern "C" gbt_status image_write(const char *path, const image *im, gbt_error *err)
try {
    gbt_status status = check_source(im, err);
    if (status != GBT_OK)
        return status;
    std::vector<unsigned char> bytes;
    if (OIIO::Strutil::iends_with(path, ".png"))
        status = encode_png(im, &bytes, err);
    else if (OIIO::Strutil::iends_with(path, ".exr"))
        status = encode_exr(im, &bytes, err);
    else
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: cannot write this kind of file (wanted .png or .exr)",
                         path);
    return status != GBT_OK ? status : file_write_atomic(path, bytes.data(), bytes.size(), err);
} catch (...) {
    return caught(path, GBT_ERR_INTERNAL, err);
}

extern "C" gbt_status image_lens_read(const char *path, image_lens *out, gbt_error *err)
try {
    *out = image_lens{};
    opened_image o;
    const gbt_status status = open_image(path, &o, err);
    if (status != GBT_OK)
        return status;
    const OIIO::ImageSpec &spec = o.input->spec();
    std::snprintf(out->camera, sizeof out->camera, "%s %s", spec.get_string_attribute("Make").c_str(),
                  spec.get_string_attribute("Model").c_str());
    if (std::strcmp(out->camera, " ") == 0)
        out->camera[0] = '\0';
    out->focal = spec.get_float_attribute("Exif:FocalLength", 0.0f);
    return GBT_OK;
} catch (...) {
    return caught(path, GBT_ERR_FORMAT, err);
}

extern "C" gbt_status image_encode(const image *im, int quality, unsigned char **bytes, size_t *byte_count,
                                   gbt_error *err)
try {
    *bytes = nullptr;
    *byte_count = 0;
    gbt_status status = check_source(im, err);
    if (status == GBT_OK && (quality < IMAGE_AS_PNG || quality > 100))
        status = base_fail(err, GBT_ERR_ARGUMENT, "image: JPEG quality %d (wanted 1 to 100)", quality);
    std::vector<unsigned char> encoded;
    if (status == GBT_OK)
        status =
            quality == IMAGE_AS_PNG ? encode_png(im, &encoded, err) : encode_jpeg(im, quality, &encoded, err);
    return status != GBT_OK ? status : hand_over(encoded, bytes, byte_count, err);
} catch (...) {
    return caught("image", GBT_ERR_INTERNAL, err);
}

extern "C" const char *image_library(void)
{
    static char text[40];
    const unsigned version = OIIO::openimageio_version();
    std::snprintf(text, sizeof text, "OpenImageIO %u.%u.%u", version / 10000, version / 100 % 100,
                  version % 100);
    return text;
}
