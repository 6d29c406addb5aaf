/* SPDX-License-Identifier: Apache-2.0 */
/* base/image_header.h -- read the headers of PNG, JPEG and EXR files, without decoding pixels and without
   image libraries. */
#ifndef GBT_BASE_IMAGE_HEADER_H
#define GBT_BASE_IMAGE_HEADER_H

#include <stdbool.h>

#include "gbtrace/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum image_kind { IMAGE_PNG, IMAGE_JPEG, IMAGE_EXR } image_kind;

/** Largest accepted width * height * channels. */
#define IMAGE_SAMPLES_MAX (INT64_C(1) << 29)

/** The same in megapixels, for messages. */
#define IMAGE_MEGAPIXELS_MAX(channels) (1e-6 * (double)IMAGE_SAMPLES_MAX / ((channels) > 1 ? (channels) : 1))

typedef struct image_header {
    image_kind kind;
    int width, height;
    bool has_alpha;  /* image_read() gives 4 channels, else 3 */
    bool has_colors; /* false: an EXR without channels R, G and B, which image_read() refuses */
    int orientation; /* EXIF: 1 as stored, 3 upside down, 6 and 8 on a side, ...; 1 when there is none */
} image_header;

/**
 * Read the header of an image file, and check that the file is not truncated: PNG by the lengths of its
 * chunks, JPEG by its end marker, EXR by its table of offsets.
 *
 * Everything that this refuses is also refused by image_read(); pixel data may still be damaged.
 *
 * @return GBT_OK, GBT_ERR_IO (not a file, cannot be read), GBT_ERR_FORMAT (another format, truncated, an
 * image of no pixels or of more than IMAGE_SAMPLES_MAX samples, an EXR that is cropped) Threads: any. Cost: a
 * few reads, whatever the size of the file.
 */
gbt_status image_header_read(const char *path, image_header *out, gbt_error *err);

/** GBT_ERR_FORMAT, with the message of image_read(), if the header is of a file without colours. */
gbt_status image_header_colors(const char *path, const image_header *header, gbt_error *err);

#ifdef __cplusplus
}
#endif
#endif
