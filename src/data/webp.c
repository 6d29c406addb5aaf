/* SPDX-License-Identifier: Apache-2.0 */
/* data/webp.c -- lossless WebP that also keeps the colours of transparent pixels. */
#include "data/webp.h"

#include <webp/decode.h>
#include <webp/encode.h>

enum { EFFORT = 6 }; /* of 0 to 9; more takes twice the time for 1 % less size */

gbt_status webp_put(sink *out, const webp_table *table, gbt_error *err)
{
    WebPConfig config;
    WebPPicture picture;
    if (table->width > WEBP_MAX_DIMENSION || table->height > WEBP_MAX_DIMENSION)
        return base_fail(err, out->status = GBT_ERR_ARGUMENT,
                         "%d x %d pixels are too many for a .webp (limit %d)", table->width, table->height,
                         (int)WEBP_MAX_DIMENSION);
    if (!WebPConfigInit(&config) || !WebPConfigLosslessPreset(&config, EFFORT) || !WebPPictureInit(&picture))
        return base_fail(err, out->status = GBT_ERR_INTERNAL, "libwebp: another version than at the build");
    config.exact = 1;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    picture.use_argb = 1;
    picture.width = table->width;
    picture.height = table->height;
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    if (WebPPictureImportRGBA(&picture, table->bytes, 4 * table->width) && WebPEncode(&config, &picture))
        sink_put(out, writer.mem, writer.size);
    else
        base_fail(err,
                  out->status = picture.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY ||
                                        picture.error_code == VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY
                                    ? GBT_ERR_NO_MEMORY
                                    : GBT_ERR_INTERNAL,
                  "libwebp: error %d", (int)picture.error_code);
    WebPPictureFree(&picture);
    WebPMemoryWriterClear(&writer);
    return out->status;
}

gbt_status webp_read(const source_file *file, size_t pixel_limit, webp_table *out, gbt_error *err)
{
    *out = (webp_table){0};
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(file->bytes, file->size, &features) != VP8_STATUS_OK || features.has_animation)
        return base_fail(err, GBT_ERR_FORMAT, "%s: not a .webp picture, or damaged, or animated", file->name);
    const size_t pixels = (size_t)features.width * (size_t)features.height;
    if (pixels > pixel_limit)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %d x %d pixels (wanted %zu at most)", file->name,
                         features.width, features.height, pixel_limit);
    out->bytes = mem_alloc(pixels, 4, "a table", err);
    if (out->bytes == NULL)
        return GBT_ERR_NO_MEMORY;
    out->width = features.width;
    out->height = features.height;
    if (WebPDecodeRGBAInto(file->bytes, file->size, out->bytes, 4 * pixels, 4 * features.width) != NULL)
        return GBT_OK;
    mem_free(out->bytes);
    *out = (webp_table){0};
    return base_fail(err, GBT_ERR_FORMAT, "%s: its pixels are damaged", file->name);
}
