/* SPDX-License-Identifier: Apache-2.0 */
/* base/image.h -- pixels in memory, and the file formats behind them (implemented in shim/ on
   OpenImageIO). */
#ifndef GBT_BASE_IMAGE_H
#define GBT_BASE_IMAGE_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Row-major, interleaved float pixels, [height][width][channels]. Colours are display-referred in [0, 1] as
    stored in 8-bit photos. */
typedef struct image {
    int width, height, channels;
    float *pixels; /* owned; free with image_free() */
} image;

gbt_status image_alloc(image *out, int width, int height, int channels, gbt_error *err);
void image_free(image *im); /* zeroes the struct */

/** Whether it has an alpha channel (the fourth) with a value below 1. */
bool image_is_transparent(const image *im);

/** Resize `im` unless it has this size already; its contents are then lost. Start from {0}. */
gbt_status image_fit(image *im, int width, int height, int channels, gbt_error *err);

/**
 * Read a PNG, JPEG or EXR file.
 *
 * 8- and 16-bit integers become [0, 1]; grey becomes RGB; alpha is kept as a fourth channel, and colours stay
 * as in the file: premultiplied by alpha in an EXR, not premultiplied in a PNG. The format is taken from the
 * file's magic, not its name. Orientation tags are not applied (COLMAP's choice). Truncated files, images of
 * more than 2^29 samples, and EXR files that are deep, cropped, multi-part or have colours only in layers are
 * refused. Non-finite float values become 0, with one warning.
 *
 * @param out [out] 3 or 4 channels; free with image_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_IO (cannot open), GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status image_read(const char *path, image *out, gbt_error *err);

/**
 * image_read() with a mask of the pixels whose non-finite values it replaced by 0, without the warning.
 *
 * @param valid [out] `*valid` is NULL when every value is finite, else [height][width]: 0 for pixels with a
 *                    value that is not; free with mem_free(). NULL: as image_read()
 */
gbt_status image_read_valid(const char *path, image *out, unsigned char **valid, gbt_error *err);

enum { IMAGE_RAW_CHANNELS = 64, IMAGE_NAME_SIZE = 64 };

typedef struct image_names {
    char name[IMAGE_RAW_CHANNELS][IMAGE_NAME_SIZE]; /* of each channel; longer names are cut */
} image_names;

/**
 * Read every channel of a 32-bit float EXR unchanged, including non-finite values, without scaling.
 *
 * Channels come in OpenImageIO's order: R, G, B, A first, the rest as in the file.
 *
 * @param out   [out] 1 to IMAGE_RAW_CHANNELS channels; free with image_free(); zeroed on failure
 * @param names [out] out->channels names
 * @return as image_read(); GBT_ERR_FORMAT also for samples of another type
 * Threads: any.
 */
gbt_status image_read_raw(const char *path, image *out, image_names *names, gbt_error *err);

/** EXIF data of a JPEG about the camera; EXIF in PNG files is not read. */
typedef struct image_lens {
    char camera[128]; /* make and model; empty when unknown */
    float focal;      /* millimetres; 0: unknown */
} image_lens;

/** Reads the whole file but decodes no pixels. Errors as in image_read(). */
gbt_status image_lens_read(const char *path, image_lens *out, gbt_error *err);

/**
 * Write atomically (temporary name in the same folder, then rename). PNG: 8 bit, floor(clamp(x) * 255 + 0.5).
 * EXR: 32-bit float. By extension.
 */
gbt_status image_write(const char *path, const image *im, gbt_error *err);

enum { IMAGE_AS_PNG = 0 };

/** Encode an image file in memory: a JPEG of `quality`, [1, 100], or the PNG of image_write(). Free `*bytes`
    with mem_free(). */
gbt_status image_encode(const image *im, int quality, unsigned char **bytes, size_t *byte_count,
                        gbt_error *err);

/** Name and version of the loaded image library: "OpenImageIO 2.4.7". Static. */
const char *image_library(void);

#ifdef __cplusplus
}
#endif
#endif
