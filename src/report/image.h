/* SPDX-License-Identifier: Apache-2.0 */
/* report/image.h -- pictures inside the page: files to base64 JPEG, errors to colours. */
#ifndef GBT_REPORT_IMAGE_H
#define GBT_REPORT_IMAGE_H

#include <stdbool.h>

#include "base/image.h"
#include "report/text.h"

typedef enum picture_kind {
    PICTURE_COLOR,
    PICTURE_ERROR /* one channel in [0, 1], shown through error_color() */
} picture_kind;

/**
 * Add `data:image/jpeg;base64,...` of an image file. A longer one than 1280 pixels, or one of more than
 * `most` pixels, is averaged down by a whole factor.
 *
 * @param width, height [out] of what was added; 0 when the file cannot be read, and then nothing is added
 * @return GBT_OK, GBT_ERR_NO_MEMORY (also in out->status)
 */
gbt_status report_picture(text *out, const char *path, picture_kind kind, size_t most, int *width,
                          int *height);

/** Add the data: URI of a picture in memory: PNG, all its channels; or JPEG, averaged down like a file. */
void report_image_png(text *out, const image *picture);
void report_image_jpeg(text *out, const image *picture);

/** Size of the picture in a file, 0 x 0 when it cannot be read. */
void report_picture_size(const char *path, int *width, int *height);

/** Dark violet over red to pale yellow for 0 to 1 (clamped): OKLab lightness rises evenly, as in magma. sRGB
    in [0, 1]. */
void error_color(double error, float rgb[3]);

#endif
