/* SPDX-License-Identifier: Apache-2.0 */
/* tests/exr_file.h -- a float EXR of any channels, written by hand: no compression, one block a row. */
#ifndef GBT_TESTS_EXR_FILE_H
#define GBT_TESTS_EXR_FILE_H

#include "base/file.h"
#include "test_support.h"

typedef struct exr_bytes {
    unsigned char bytes[1 << 16];
    size_t count;
} exr_bytes;

static inline void exr_put(exr_bytes *b, const void *bytes, size_t count)
{
    assert_true(b->count + count <= sizeof b->bytes);
    memcpy(b->bytes + b->count, bytes, count);
    b->count += count;
}

static inline void exr_put_int(exr_bytes *b, int32_t value) { exr_put(b, &value, sizeof value); }

static inline void exr_put_attribute(exr_bytes *b, const char *name, const char *type, const void *value,
                                     size_t size)
{
    exr_put(b, name, strlen(name) + 1);
    exr_put(b, type, strlen(type) + 1);
    exr_put_int(b, (int32_t)size);
    exr_put(b, value, size);
}

/* `names` in alphabetical order; `pixels` [height][width][channels]. Sample type 2 is float, 1 half (then
   zeros are written). */
static inline void exr_write(const char *path, int width, int height, int channels, const char *const *names,
                             int32_t type, const float *pixels)
{
    static exr_bytes b, list;
    b.count = list.count = 0;
    exr_put(&b, "\x76\x2f\x31\x01\x02\0\0\0", 8);
    for (int c = 0; c < channels; c++) {
        exr_put(&list, names[c], strlen(names[c]) + 1);
        exr_put_int(&list, type);
        exr_put(&list, "\0\0\0\0", 4);
        exr_put_int(&list, 1);
        exr_put_int(&list, 1);
    }
    exr_put(&list, "", 1);
    const int32_t window[4] = {0, 0, width - 1, height - 1};
    const float one = 1, zeros[2] = {0, 0};
    exr_put_attribute(&b, "channels", "chlist", list.bytes, list.count);
    exr_put_attribute(&b, "compression", "compression", "", 1);
    exr_put_attribute(&b, "dataWindow", "box2i", window, sizeof window);
    exr_put_attribute(&b, "displayWindow", "box2i", window, sizeof window);
    exr_put_attribute(&b, "lineOrder", "lineOrder", "", 1);
    exr_put_attribute(&b, "pixelAspectRatio", "float", &one, sizeof one);
    exr_put_attribute(&b, "screenWindowCenter", "v2f", zeros, sizeof zeros);
    exr_put_attribute(&b, "screenWindowWidth", "float", &one, sizeof one);
    exr_put(&b, "", 1);
    const size_t sample = type == 2 ? 4 : 2, row_bytes = (size_t)(width * channels) * sample,
                 first = b.count + 8 * (size_t)height;
    for (int y = 0; y < height; y++) {
        const uint64_t offset = first + (uint64_t)y * (8 + row_bytes);
        exr_put(&b, &offset, sizeof offset);
    }
    for (int y = 0; y < height; y++) {
        exr_put_int(&b, y);
        exr_put_int(&b, (int32_t)row_bytes);
        for (int c = 0; c < channels; c++)
            for (int x = 0; x < width; x++)
                exr_put(&b,
                        type == 2 ? (const void *)(pixels + (size_t)((y * width + x) * channels + c))
                                  : "\0\0",
                        sample);
    }
    assert_ok(file_write_atomic(path, b.bytes, b.count, &assert_ok_err_));
}

#endif
