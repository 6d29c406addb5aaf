/* SPDX-License-Identifier: Apache-2.0 */
/* tests/image/test_image_io.c -- image files in and out: values, channels, refusals. Files are built by hand,
   byte by byte. */
#include "folder.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>

#include "base/image.h"
#include "base/image_header.h"
#include "base/paged.h"
#include "exr_file.h"

typedef struct buffer {
    unsigned char bytes[8192];
    size_t count;
} buffer;

static void put(buffer *b, const void *bytes, size_t count)
{
    assert_true(b->count + count <= sizeof b->bytes);
    memcpy(b->bytes + b->count, bytes, count);
    b->count += count;
}

static void put_big_endian(buffer *b, uint32_t value)
{
    for (int shift = 24; shift >= 0; shift -= 8)
        put(b, (unsigned char[1]){(unsigned char)(value >> shift)}, 1);
}

static void put_chunk(buffer *b, const char *type, const void *bytes, size_t count)
{
    put_big_endian(b, (uint32_t)count);
    const size_t begin = b->count;
    put(b, type, 4);
    put(b, bytes, count);
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = begin; i < b->count; i++) {
        crc ^= b->bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (crc & 1) != 0 ? 0xEDB88320u ^ (crc >> 1) : crc >> 1;
    }
    put_big_endian(b, crc ^ 0xFFFFFFFFu);
}

/* A PNG of one row, its data in one stored (uncompressed) zlib block. */
static buffer make_png(uint32_t width, uint32_t height, int bits, int type, const void *row, size_t row_bytes)
{
    buffer b = {.count = 0};
    put(&b, "\x89PNG\r\n\x1a\n", 8);
    buffer header = {.count = 0};
    put_big_endian(&header, width);
    put_big_endian(&header, height);
    put(&header, (unsigned char[5]){(unsigned char)bits, (unsigned char)type, 0, 0, 0}, 5);
    put_chunk(&b, "IHDR", header.bytes, header.count);
    if (type == 3) {
        put_chunk(&b, "PLTE", (unsigned char[]){255, 0, 0, 0, 255, 0, 0, 0, 255, 51, 102, 153}, 12);
        put_chunk(&b, "tRNS", (unsigned char[]){255, 0}, 2);
    }
    put_chunk(&b, "iCCP", "not a profile", 13); /* libpng would complain on stderr */
    buffer data = {.count = 0};
    const size_t count = row_bytes + 1;
    assert_true(count < 256); /* so the length fits the low byte, and its complement ends in 0xff */
    put(&data, (unsigned char[7]){0x78, 0x01, 1, (unsigned char)count, 0, (unsigned char)~count, 0xff}, 7);
    put(&data, "", 1); /* filter: none */
    put(&data, row, row_bytes);
    uint32_t a = 1, c = 1; /* Adler-32; the filter byte is 0 */
    for (size_t i = 0; i < row_bytes; i++) {
        a = (a + ((const unsigned char *)row)[i]) % 65521;
        c = (c + a) % 65521;
    }
    put_big_endian(&data, c << 16 | a);
    put_chunk(&b, "IDAT", data.bytes, data.count);
    put_chunk(&b, "IEND", "", 0);
    return b;
}

static void save(const char *name, const buffer *b)
{
    assert_ok(file_write_atomic(in_folder("%s", name), b->bytes, b->count, &assert_ok_err_));
}

typedef struct png_case {
    const char *name;
    int bits, type;
    unsigned char row[16];
    size_t row_bytes;
    int width, channels;
    float pixels[8];
} png_case;

static png_case png_cases[] = {
    {"grey becomes RGB", 8, 0, {0, 51}, 2, 2, 3, {0, 0, 0, 51 / 255.0f, 51 / 255.0f, 51 / 255.0f}},
    {"1 bit", 1, 0, {0x40}, 1, 2, 3, {0, 0, 0, 1, 1, 1}},
    {"16-bit grey",
     16,
     0,
     {0x12, 0x34, 0xff, 0xff},
     4,
     2,
     3,
     {4660 / 65535.0f, 4660 / 65535.0f, 4660 / 65535.0f, 1, 1, 1}},
    {"RGB", 8, 2, {1, 2, 3, 254, 255, 0}, 6, 2, 3, {1 / 255.0f, 2 / 255.0f, 3 / 255.0f, 254 / 255.0f, 1, 0}},
    {"16-bit RGB",
     16,
     2,
     {0, 1, 0x80, 0, 0xff, 0xfe},
     6,
     1,
     3,
     {1 / 65535.0f, 32768 / 65535.0f, 65534 / 65535.0f}},
    {"palette with transparency",
     8,
     3,
     {3, 1},
     2,
     2,
     4,
     {51 / 255.0f, 102 / 255.0f, 153 / 255.0f, 1, 0, 1, 0, 0}},
    {"grey and alpha", 8, 4, {51, 0}, 2, 1, 4, {51 / 255.0f, 51 / 255.0f, 51 / 255.0f, 0}},
    {"colour under alpha 0 is kept as stored",
     8,
     6,
     {255, 128, 7, 0, 10, 20, 30, 128},
     8,
     2,
     4,
     {1, 128 / 255.0f, 7 / 255.0f, 0, 10 / 255.0f, 20 / 255.0f, 30 / 255.0f, 128 / 255.0f}},
};

static void reads_png(void **state)
{
    const png_case *c = *state;
    const buffer b = make_png((uint32_t)c->width, 1, c->bits, c->type, c->row, c->row_bytes);
    save("a.jpg", &b); /* the wrong name on purpose */
    image im;
    assert_ok(image_read(in_folder("a.jpg"), &im, &assert_ok_err_));
    assert_int_equal(im.width, c->width);
    assert_int_equal(im.height, 1);
    assert_int_equal(im.channels, c->channels);
    for (int i = 0; i < c->width * c->channels; i++)
        if (im.pixels[i] != c->pixels[i])
            fail_msg("%s: value %d is %.9g, not %.9g", c->name, i, (double)im.pixels[i],
                     (double)c->pixels[i]);
    image_free(&im);
    image_header header;
    assert_ok(image_header_read(in_folder("a.jpg"), &header, &assert_ok_err_));
    assert_int_equal(header.width, c->width);
    assert_int_equal(header.height, 1);
    assert_int_equal(header.has_alpha, c->channels == 4);
}

static void expect_failure(const char *path, gbt_status wanted, const char *text)
{
    image im = {.width = 7};
    gbt_error err = {0};
    const gbt_status status = image_read(path, &im, &err);
    if (status != wanted || strstr(err.text, text) == NULL)
        fail_msg("%s: status %d (wanted %d), text \"%s\" (wanted \"%s\")", path, (int)status, (int)wanted,
                 err.text, text);
    assert_int_equal(err.status, wanted);
    assert_non_null(strstr(err.text, path));
    assert_null(im.pixels);
    assert_int_equal(im.width, 0);
}

static void refuses_what_is_not_an_image(void **state)
{
    (void)state;
    image_header header = {.width = 7};
    gbt_error err = {0};
    expect_failure(in_folder("nothing.png"), GBT_ERR_IO, "cannot open");
    assert_int_equal(image_header_read(in_folder("nothing.png"), &header, &err), GBT_ERR_IO);
    assert_int_equal(header.width, 0);
    expect_failure(test_folder, GBT_ERR_IO, "not a regular file");
    assert_int_equal(mkfifo(in_folder("fifo.png"), 0600), 0);
    expect_failure(in_folder("fifo.png"), GBT_ERR_IO, "not a regular file");
    err = (gbt_error){0};
    assert_int_equal(image_header_read(in_folder("fifo.png"), &header, &err), GBT_ERR_IO);
    static const char *const contents[] = {
        "", "\x89PNG", "<html>404</html>", "GIF89a\1\0\1\0\0\0\0;", "P6 1 1 255 aaa", "\xff\xd8"};
    for (size_t i = 0; i < sizeof contents / sizeof *contents; i++) {
        buffer b = {.count = 0};
        put(&b, contents[i], strlen(contents[i]));
        save("b.png", &b);
        expect_failure(in_folder("b.png"), GBT_ERR_FORMAT, "not a PNG, JPEG or EXR file");
        err = (gbt_error){0};
        assert_int_equal(image_header_read(in_folder("b.png"), &header, &err), GBT_ERR_FORMAT);
    }
}

static void refuses_bombs(void **state)
{
    (void)state;
    static const struct {
        uint32_t width, height;
        const char *text;
    } cases[] = {
        {100000, 100000, "179 megapixels"},
        {16384, 10923, "179 megapixels"},
        {16384, 16385, "179 megapixels"},
        {0, 1, "0 x 1"},
        {0xFFFFFFFFu, 0xFFFFFFFFu, "179 megapixels"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const buffer b = make_png(cases[i].width, cases[i].height, 8, 2, "abc", 3);
        save("bomb.png", &b);
        expect_failure(in_folder("bomb.png"), GBT_ERR_FORMAT, cases[i].text);
    }
}

static void refuses_damaged_png(void **state)
{
    (void)state;
    const unsigned char row[6] = {9, 8, 7, 6, 5, 4};
    const buffer whole = make_png(2, 1, 8, 2, row, sizeof row);
    for (size_t count = 8; count < whole.count; count++) {
        buffer b = whole;
        b.count = count;
        save("cut.png", &b);
        expect_failure(in_folder("cut.png"), GBT_ERR_FORMAT, "");
    }
    for (size_t i = 8; i < whole.count; i++) {
        buffer b = whole;
        b.bytes[i] ^= 0x10;
        save("flip.png", &b);
        expect_failure(in_folder("flip.png"), GBT_ERR_FORMAT, "");
    }
    buffer trailing = whole;
    put(&trailing, "rubbish", 7); /* allowed: the image is whole */
    save("trailing.png", &trailing);
    image im;
    assert_ok(image_read(in_folder("trailing.png"), &im, &assert_ok_err_));
    image_free(&im);
}

static image make_gradient(int width, int height, int channels)
{
    image im;
    assert_ok(image_alloc(&im, width, height, channels, &assert_ok_err_));
    for (int i = 0; i < width * height * channels; i++)
        im.pixels[i] = (float)((i / channels * 3 + i % channels * 40) % 256) / 255.0f;
    return im;
}

static void jpeg_round_trip_and_truncation(void **state)
{
    (void)state;
    image im = make_gradient(64, 48, 3), back;
    for (int i = 0; i < 64 * 48 * 3; i++)
        im.pixels[i] = (float)(i / 3 % 64) / 63.0f; /* smooth, grey */
    unsigned char *bytes;
    size_t count, rough_count;
    assert_ok(image_encode(&im, 10, &bytes, &rough_count, &assert_ok_err_));
    mem_free(bytes);
    assert_ok(image_encode(&im, 95, &bytes, &count, &assert_ok_err_));
    assert_true(rough_count < count);
    assert_ok(file_write_atomic(in_folder("c.png"), bytes, count, &assert_ok_err_));
    assert_ok(image_read(in_folder("c.png"), &back, &assert_ok_err_));
    assert_int_equal(back.width, 64);
    assert_int_equal(back.height, 48);
    assert_int_equal(back.channels, 3);
    for (int i = 0; i < 64 * 48 * 3; i++)
        assert_float_equal(back.pixels[i], im.pixels[i], 4.0 / 255);
    image_free(&back);
    for (size_t cut = 3; cut + 2 <= count; cut += 1 + count / 97) {
        assert_ok(file_write_atomic(in_folder("cut.jpg"), bytes, cut, &assert_ok_err_));
        expect_failure(in_folder("cut.jpg"), GBT_ERR_FORMAT, "");
    }
    mem_free(bytes);
    gbt_error err = {0};
    assert_int_equal(image_encode(&im, -1, &bytes, &count, &err), GBT_ERR_ARGUMENT);
    assert_null(bytes);
    err = (gbt_error){0};
    assert_int_equal(image_encode(&im, 101, &bytes, &count, &err), GBT_ERR_ARGUMENT);
    image_free(&im);
    im = make_gradient(8, 8, 1);
    assert_ok(image_encode(&im, 100, &bytes, &count, &assert_ok_err_));
    assert_ok(file_write_atomic(in_folder("grey.jpg"), bytes, count, &assert_ok_err_));
    mem_free(bytes);
    assert_ok(image_read(in_folder("grey.jpg"), &back, &assert_ok_err_));
    assert_int_equal(back.channels, 3);
    assert_true(back.pixels[30] == back.pixels[31] && back.pixels[30] == back.pixels[32]);
    image_free(&back);
    image_free(&im);
}

static void png_rounds_half_up_and_clamps(void **state)
{
    (void)state;
    const float values[] = {0.0f, -1.0f,       NAN,         INFINITY,     -INFINITY,     1.0f,
                            2.0f, 0.49f / 255, 0.51f / 255, 127.5f / 255, 254.49f / 255, 1e-30f};
    const int levels[] = {0, 0, 0, 255, 0, 255, 255, 0, 1, 128, 254, 0};
    image im, back;
    assert_ok(image_alloc(&im, 2, 2, 3, &assert_ok_err_));
    memcpy(im.pixels, values, sizeof values);
    assert_ok(image_write(in_folder("d.PNG"), &im, &assert_ok_err_));
    assert_ok(image_read(in_folder("d.PNG"), &back, &assert_ok_err_));
    assert_int_equal(back.channels, 3);
    for (int i = 0; i < 12; i++)
        if (back.pixels[i] != (float)levels[i] / 255.0f)
            fail_msg("value %d became %g/255, not %d", i, (double)back.pixels[i] * 255, levels[i]);
    unsigned char *bytes, *file;
    size_t count, file_count;
    assert_ok(image_encode(&im, IMAGE_AS_PNG, &bytes, &count, &assert_ok_err_));
    assert_ok(file_read(in_folder("d.PNG"), &file, &file_count, &assert_ok_err_));
    assert_int_equal(count, file_count);
    assert_memory_equal(bytes, file, count);
    mem_free(bytes);
    mem_free(file);
    image_free(&im);
    image_free(&back);
}

static void png_keeps_every_level_and_channel_count(void **state)
{
    (void)state;
    for (int channels = 1; channels <= 4; channels++) {
        image im = make_gradient(16, 16, channels), back;
        assert_ok(image_write(in_folder("e.png"), &im, &assert_ok_err_));
        assert_ok(image_read(in_folder("e.png"), &back, &assert_ok_err_));
        assert_int_equal(back.channels, channels <= 2 ? channels + 2 : channels);
        for (int i = 0; i < 256; i++)
            for (int c = 0; c < back.channels; c++) {
                const int from = channels <= 2 ? c < 3 ? 0 : 1 : c;
                assert_true(back.pixels[i * back.channels + c] == im.pixels[i * channels + from]);
            }
        image_free(&im);
        image_free(&back);
    }
}

static void exr_round_trip_is_exact(void **state)
{
    (void)state;
    image im = make_gradient(37, 23, 3), back;
    im.pixels[0] = -4.25f;
    im.pixels[1] = 1e30f;
    im.pixels[2] = 1e-30f;
    im.pixels[300] = NAN;
    im.pixels[301] = INFINITY;
    im.pixels[302] = -INFINITY;
    assert_ok(image_write(in_folder("f.exr"), &im, &assert_ok_err_));
    assert_ok(image_read(in_folder("f.exr"), &back, &assert_ok_err_));
    assert_int_equal(back.width, 37);
    assert_int_equal(back.height, 23);
    assert_int_equal(back.channels, 3);
    im.pixels[300] = im.pixels[301] = im.pixels[302] =
        0.0f; /* what is not finite is read as 0, with one warning */
    assert_memory_equal(back.pixels, im.pixels, 37 * 23 * 3 * sizeof(float));
    image_free(&back);
    image_header header;
    assert_ok(image_header_read(in_folder("f.exr"), &header, &assert_ok_err_));
    assert_true(header.width == 37 && header.height == 23 && !header.has_alpha);
    unsigned char *bytes;
    size_t count;
    assert_ok(file_read(in_folder("f.exr"), &bytes, &count, &assert_ok_err_));
    static const char no_date[] = "capDate\0string\0\0\0\0"; /* with one, no two files would be equal */
    assert_memory_equal(bytes + 8, no_date, sizeof no_date - 1);
    for (size_t cut = 4; cut < count; cut += 1 + count / 61) {
        assert_ok(file_write_atomic(in_folder("cut.exr"), bytes, cut, &assert_ok_err_));
        expect_failure(in_folder("cut.exr"), GBT_ERR_FORMAT, "");
    }
    mem_free(bytes);
    image_free(&im);
}

static void put_attribute(buffer *b, const char *name, const char *type, const void *value, uint32_t size)
{
    put(b, name, strlen(name) + 1);
    put(b, type, strlen(type) + 1);
    put(b, &size, 4);
    put(b, value, size);
}

static void put_exr_header(buffer *b, const char *part, const char *part_type, const char *const *channels,
                           int width)
{
    buffer list = {.count = 0};
    for (; *channels != NULL; channels++) {
        put(&list, *channels, strlen(*channels) + 1);
        put(&list, (int32_t[4]){1, 0, 1, 1}, 16); /* half */
    }
    put(&list, "", 1);
    put_attribute(b, "channels", "chlist", list.bytes, (uint32_t)list.count);
    put_attribute(b, "compression", "compression", "\0", 1);
    put_attribute(b, "dataWindow", "box2i", (int32_t[4]){0, 0, width - 1, 0}, 16);
    put_attribute(b, "displayWindow", "box2i", (int32_t[4]){0, 0, width - 1, 0}, 16);
    put_attribute(b, "lineOrder", "lineOrder", "\0", 1);
    put_attribute(b, "pixelAspectRatio", "float", (float[1]){1.0f}, 4);
    put_attribute(b, "screenWindowCenter", "v2f", (float[2]){0.0f, 0.0f}, 8);
    put_attribute(b, "screenWindowWidth", "float", (float[1]){1.0f}, 4);
    if (part != NULL) {
        put_attribute(b, "name", "string", part, (uint32_t)strlen(part));
        put_attribute(b, "type", "string", part_type, (uint32_t)strlen(part_type));
        put_attribute(b, "chunkCount", "int", (int32_t[1]){1}, 4);
        put_attribute(b, "version", "int", (int32_t[1]){1}, 4);
        put_attribute(b, "maxSamplesPerPixel", "int", (int32_t[1]){1}, 4);
    }
    put(b, "", 1);
}

static void exr_half_with_extra_channels(void **state)
{
    (void)state;
    /* Channels are stored in the order of their names. 0x3C00 = 1, 0x3800 = 0.5, 0xC000 = -2, 0x7E00 = NaN,
       0x7C00 = Inf. */
    buffer b = {.count = 0};
    put(&b, "\x76\x2f\x31\x01\2\0\0\0", 8);
    put_exr_header(&b, NULL, NULL, (const char *[]){"B", "G", "R", "Z", NULL}, 2);
    const uint64_t offset = b.count + 8;
    put(&b, &offset, 8);
    put(&b, (int32_t[2]){0, 16}, 8);
    put(&b, (uint16_t[8]){0x3C00, 0x7E00, 0xC000, 0x7C00, 0x3800, 0xFC00, 0x3C00, 0x3C00}, 16);
    save("half.exr", &b);
    image im;
    assert_ok(image_read(in_folder("half.exr"), &im, &assert_ok_err_));
    assert_int_equal(im.width, 2);
    assert_int_equal(im.channels, 3); /* the depth is left out */
    const float wanted[6] = {0.5f, -2.0f, 1.0f, 0.0f, 0.0f, 0.0f};
    for (int i = 0; i < 6; i++)
        assert_true(im.pixels[i] == wanted[i]);
    image_free(&im);
}

static const float seven[7] = {1, 2, 3, 4, 5, 6, 7};

/* Names in any case; alpha is that of the picture, not of a layer. */
static void exr_channels_are_found_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *names[4]; /* their values are 1, 2, 3, 4 */
        int count, channels;
        float pixel[4];
    } rows[] = {{{"B", "G", "R", "a"}, 4, 4, {3, 2, 1, 4}},
                {{"Alpha", "B", "G", "R"}, 4, 4, {4, 3, 2, 1}},
                {{"b", "g", "r"}, 3, 3, {3, 2, 1}},
                {{"B", "G", "R", "ViewLayer.A"}, 4, 3, {3, 2, 1}}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        exr_write(in_folder("names.exr"), 1, 1, rows[r].count, rows[r].names, 2, seven);
        image im;
        image_header header;
        assert_ok(image_read(in_folder("names.exr"), &im, &assert_ok_err_));
        assert_ok(image_header_read(in_folder("names.exr"), &header, &assert_ok_err_));
        assert_int_equal(im.channels, rows[r].channels);
        assert_true(header.has_colors);
        assert_int_equal(header.has_alpha, im.channels == 4);
        for (int c = 0; c < im.channels; c++)
            assert_true(im.pixels[c] == rows[r].pixel[c]);
        image_free(&im);
    }
}

/* The first layer by name is not the picture. */
static void refuses_exr_of_layers(void **state)
{
    (void)state;
    static const char *const names[7] = {
        "ViewLayer.AO.B",       "ViewLayer.AO.G",       "ViewLayer.AO.R",      "ViewLayer.Combined.A",
        "ViewLayer.Combined.B", "ViewLayer.Combined.G", "ViewLayer.Combined.R"};
    static const char *const place[3] = {"X", "Y", "Z"};
    exr_write(in_folder("layers.exr"), 1, 1, 7, names, 2, seven);
    expect_failure(in_folder("layers.exr"), GBT_ERR_FORMAT, "EXR has no channels R, G and B");
    image_header header;
    assert_ok(image_header_read(in_folder("layers.exr"), &header, &assert_ok_err_));
    assert_false(header.has_colors);
    image im;
    static image_names found;
    assert_ok(image_read_raw(in_folder("layers.exr"), &im, &found, &assert_ok_err_));
    assert_int_equal(im.channels, 7);
    assert_string_equal(found.name[0], "ViewLayer.AO.R");
    image_free(&im);
    exr_write(in_folder("place.exr"), 1, 1, 3, place, 2, seven);
    expect_failure(in_folder("place.exr"), GBT_ERR_FORMAT, "EXR has no channels R, G and B");
}

static void refuses_cropped_exr(void **state)
{
    (void)state;
    static const char *const names[3] = {"B", "G", "R"};
    static const char start[] = "displayWindow\0box2i\0....";
    exr_write(in_folder("cropped.exr"), 2, 1, 3, names, 2, seven);
    unsigned char *bytes;
    size_t count;
    assert_ok(file_read(in_folder("cropped.exr"), &bytes, &count, &assert_ok_err_));
    unsigned char *window = memmem(bytes, count, start, 20);
    assert_non_null(window);
    window[sizeof start - 1 + 8]++; /* its last column */
    assert_ok(file_write_atomic(in_folder("cropped.exr"), bytes, count, &assert_ok_err_));
    mem_free(bytes);
    image_header header;
    gbt_error err = {0};
    assert_int_equal(image_header_read(in_folder("cropped.exr"), &header, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "its data window is not its display window"));
    expect_failure(in_folder("cropped.exr"), GBT_ERR_FORMAT, "EXR is cropped");
}

static void refuses_multipart_and_deep_exr(void **state)
{
    (void)state;
    buffer b = {.count = 0};
    put(&b, "\x76\x2f\x31\x01\2\x10\0\0", 8);
    put_exr_header(&b, "one", "scanlineimage", (const char *[]){"B", "G", "R", NULL}, 1);
    put_exr_header(&b, "two", "scanlineimage", (const char *[]){"B", "G", "R", NULL}, 1);
    put(&b, "", 1);
    const uint64_t begin = b.count + 16, offsets[2] = {begin, begin + 18};
    put(&b, offsets, 16);
    for (int32_t part = 0; part < 2; part++) {
        put(&b, (int32_t[3]){part, 0, 6}, 12);
        put(&b, (uint16_t[3]){0x3C00, 0x3C00, 0x3C00}, 6);
    }
    save("parts.exr", &b);
    expect_failure(in_folder("parts.exr"), GBT_ERR_FORMAT, "multi-part");

    b.count = 0;
    put(&b, "\x76\x2f\x31\x01\2\x08\0\0", 8);
    put_exr_header(&b, "one", "deepscanline", (const char *[]){"B", "G", "R", NULL}, 1);
    const uint64_t offset = b.count + 8;
    put(&b, &offset, 8);
    put(&b, (int32_t[1]){0}, 4);
    put(&b, (uint64_t[3]){4, 6, 6}, 24);
    put(&b, (int32_t[1]){1}, 4);
    put(&b, (uint16_t[3]){0x3C00, 0x3C00, 0x3C00}, 6);
    save("deep.exr", &b);
    expect_failure(in_folder("deep.exr"), GBT_ERR_FORMAT, "deep");
}

static void write_refusals(void **state)
{
    (void)state;
    image im = make_gradient(4, 4, 3);
    gbt_error err = {0};
    assert_int_equal(image_write(in_folder("g.tif"), &im, &err), GBT_ERR_ARGUMENT);
    err = (gbt_error){0};
    assert_int_equal(image_write(in_folder("no/such/folder.png"), &im, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "no/such/folder.png"));
    image empty = {0};
    err = (gbt_error){0};
    assert_int_equal(image_write(in_folder("g.png"), &empty, &err), GBT_ERR_ARGUMENT);
    assert_false(file_exists(in_folder("g.png")));
    image_free(&im);
}

static void no_memory(void **state)
{
    (void)state;
    const buffer b = make_png(2, 1, 8, 2, "abcdef", 6);
    save("h.png", &b);
    for (long n = 0;; n++) {
        assert_true(n < 50);
        image im = {0};
        gbt_error err = {0};
        mem_fail_after(n);
        const gbt_status status = image_read(in_folder("h.png"), &im, &err);
        mem_fail_after(-1);
        if (status == GBT_OK) {
            assert_true(n >= 2); /* the file and the pixels */
            image_free(&im);
            break;
        }
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_null(im.pixels);
        assert_true(err.text[0] != '\0');
    }
}

/* Below a memory limit large arrays are files: whether there is memory for a picture is asked without one. */
static void asks_for_memory_without_a_file(void **state)
{
    (void)state;
    const buffer b = make_png(2, 1, 8, 2, "abcdef", 6);
    save("h.png", &b);
    image im;
    gbt_error err = {0};
    struct rlimit keep, tight;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &keep), 0);
    tight = keep;
    tight.rlim_cur = 1 << 20;
    assert_ok(paged_start(test_folder, (size_t)1 << 40, NULL));
    void (*const handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &tight), 0);
    const gbt_status status = image_read(in_folder("h.png"), &im, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &keep), 0);
    signal(SIGXFSZ, handler);
    paged_stop();
    if (status != GBT_OK)
        fail_msg("%s", err.text);
    image_free(&im);
}

static void reads_real_photos(void **state)
{
    (void)state;
    const char *path = shared_path("data/castle/images/0000.jpg");
    if (path == NULL)
        skip();
    image_header header;
    assert_ok(image_header_read(path, &header, &assert_ok_err_));
    image im;
    assert_ok(image_read(path, &im, &assert_ok_err_));
    assert_int_equal(im.width, header.width);
    assert_int_equal(im.height, header.height);
    assert_int_equal(im.channels, 3);
    assert_false(header.has_alpha);
    double sum = 0;
    const size_t count = (size_t)im.width * (size_t)im.height * 3;
    for (size_t i = 0; i < count; i++) {
        assert_true(im.pixels[i] >= 0.0f && im.pixels[i] <= 1.0f);
        sum += (double)im.pixels[i];
    }
    assert_true(sum > 0.05 * (double)count && sum < 0.95 * (double)count);
    image_free(&im);
}

int main(void)
{
    enum { PNG_COUNT = sizeof png_cases / sizeof *png_cases };
    struct CMUnitTest tests[PNG_COUNT + 16];
    size_t count = 0;
    for (; count < PNG_COUNT; count++)
        tests[count] = (struct CMUnitTest){
            .name = png_cases[count].name, .test_func = reads_png, .initial_state = &png_cases[count]};
    const struct CMUnitTest others[] = {
        cmocka_unit_test(refuses_what_is_not_an_image),
        cmocka_unit_test(refuses_bombs),
        cmocka_unit_test(refuses_damaged_png),
        cmocka_unit_test(jpeg_round_trip_and_truncation),
        cmocka_unit_test(png_rounds_half_up_and_clamps),
        cmocka_unit_test(png_keeps_every_level_and_channel_count),
        cmocka_unit_test(exr_round_trip_is_exact),
        cmocka_unit_test(exr_half_with_extra_channels),
        cmocka_unit_test(exr_channels_are_found_by_name),
        cmocka_unit_test(refuses_exr_of_layers),
        cmocka_unit_test(refuses_cropped_exr),
        cmocka_unit_test(refuses_multipart_and_deep_exr),
        cmocka_unit_test(write_refusals),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(asks_for_memory_without_a_file),
        cmocka_unit_test(reads_real_photos),
    };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        tests[count++] = others[i];
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
