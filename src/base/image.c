/* SPDX-License-Identifier: Apache-2.0 */
/* base/image.c -- pixels in memory. */
#include "base/image.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

gbt_status image_alloc(image *out, int width, int height, int channels, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (width < 1 || height < 1 || channels < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "image: size %d x %d x %d (wanted all >= 1)", width, height,
                         channels);
    out->pixels =
        mem_alloc((size_t)width * (size_t)height, (size_t)channels * sizeof *out->pixels, "image", err);
    if (out->pixels == NULL)
        return GBT_ERR_NO_MEMORY;
    out->width = width;
    out->height = height;
    out->channels = channels;
    return GBT_OK;
}

gbt_status image_fit(image *im, int width, int height, int channels, gbt_error *err)
{
    if (im->width == width && im->height == height && im->channels == channels)
        return GBT_OK;
    image_free(im);
    return image_alloc(im, width, height, channels, err);
}

bool image_is_transparent(const image *im)
{
    for (size_t i = 0; im->channels == 4 && i < (size_t)im->width * (size_t)im->height; i++)
        if (im->pixels[4 * i + 3] < 1)
            return true;
    return false;
}

void image_free(image *im)
{
    mem_free(im->pixels);
    memset(im, 0, sizeof *im);
}
