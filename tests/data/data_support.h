/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/data_support.h -- pictures, exact-size copies, and what readers must say. */
#ifndef GBT_TEST_DATA_SUPPORT_H
#define GBT_TEST_DATA_SUPPORT_H

#include "folder.h"

#include "base/image.h"
#include "data/bytes.h"
#include "data/sound.h"

/** A picture whose pixel (x, y) is (x, y, 0) / 255. */
static inline void write_picture(const char *path, int width, int height)
{
    make_folder_of(path);
    image im = {0};
    assert_ok(image_alloc(&im, width, height, 3, &assert_ok_err_));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *pixel = im.pixels + 3 * (y * width + x);
            pixel[0] = (float)x / 255;
            pixel[1] = (float)y / 255;
            pixel[2] = 0;
        }
    assert_ok(image_write(path, &im, &assert_ok_err_));
    image_free(&im);
}

/** A malloc'ed copy of exactly `size` bytes, so that the sanitizer sees a read of one byte more. */
static inline unsigned char *exact_copy(const void *bytes, size_t size)
{
    unsigned char *copy = calloc(size > 0 ? size : 1, 1);
    if (size > 0)
        memcpy(copy, bytes, size);
    return copy;
}

/** A failure must say why in one line; a success must say nothing. */
static inline void check_message(gbt_status status, const gbt_error *err)
{
    assert_int_equal(err->status, status);
    assert_true((status != GBT_OK) == (err->text[0] != '\0'));
    assert_null(strchr(err->text, '\n'));
}

#endif
