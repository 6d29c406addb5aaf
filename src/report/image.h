/* SPDX-License-Identifier: Apache-2.0 */
/* report/image.h -- pictures inside the page: files as base64 JPEG, errors as colours. */
#ifndef GBT_REPORT_IMAGE_H
#define GBT_REPORT_IMAGE_H

#include "base/image.h"
#include "report/text.h"

typedef enum picture_kind {
    PICTURE_COLOR,
    PICTURE_ERROR /* one channel in [0, 1], shown through error_color() */
} picture_kind;

/**
 * Add an image file as `data:image/jpeg;base64,...`. If it is longer than 1280 pixels or has more than `most`
 * pixels, it is scaled down by a whole factor.
 *
 * @param width, height [out] of what was added; 0 if the file cannot be read: then nothing is added
 * @return GBT_OK, GBT_ERR_NO_MEMORY (also in out->status)
 */
gbt_status report_picture(text *out, const char *path, picture_kind kind, size_t most, int *width,
                          int *height);

/** Add a picture in memory as a data: URI: as PNG with all its channels, or as JPEG, scaled down as files
    are. */
void report_image_png(text *out, const image *picture);
void report_image_jpeg(text *out, const image *picture);

/** Size of the picture in a file; 0 x 0 if it cannot be read. */
void report_picture_size(const char *path, int *width, int *height);

/** The colour map of errors: 0 to 1 (clamped) as dark violet over red to pale yellow, with OKLab lightness
    increasing evenly, as in magma. sRGB in [0, 1]. */
void error_color(double error, float rgb[3]);

#endif
