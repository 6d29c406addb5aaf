/* SPDX-License-Identifier: Apache-2.0 */
/* report/image.c -- pictures inside the page: files as base64 JPEG, errors as colours. */
#include "report/image.h"

#include <math.h>
#include <stdint.h>

#include "base/fail.h"
#include "base/image.h"
#include "base/image_header.h"
#include "base/memory.h"
#include "base/vec.h"

enum { LONGEST_SIDE = 1280, JPEG_QUALITY = 84, COLORS = 256 };

/** OKLab (Ottosson 2020) to linear sRGB. */
static void oklab_to_linear(double lightness, double chroma, double hue, double rgb[3])
{
    const double a = chroma * cos(hue), b = chroma * sin(hue);
    const double l = pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3),
                 m = pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3),
                 s = pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
    rgb[0] = 4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s;
    rgb[1] = -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s;
    rgb[2] = -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s;
}

static bool is_in_gamut(const double rgb[3])
{
    for (int k = 0; k < 3; k++)
        if (!(rgb[k] >= -1e-9 && rgb[k] <= 1 + 1e-9))
            return false;
    return true;
}

void error_color(double error, float rgb[3])
{
    /* hue in degrees: from violet over red to yellow */
    static const double lightness_low = 0.09, lightness_high = 0.97, hue_low = 288, hue_high = 465,
                        chroma_most = 0.19;
    const double t = error > 0 ? fmin(error, 1) : 0; /* NaN becomes 0 */
    const double lightness = lightness_low + (lightness_high - lightness_low) * t;
    const double hue = (hue_low + (hue_high - hue_low) * t) * (PI / 180);
    double low = 0, high = chroma_most, linear[3];
    for (int i = 0; i < 30; i++) { /* bisect for the largest chroma at this lightness and hue that sRGB can
                                      show */
        const double middle = 0.5 * (low + high);
        oklab_to_linear(lightness, middle, hue, linear);
        *(is_in_gamut(linear) ? &low : &high) = middle;
    }
    oklab_to_linear(lightness, low, hue, linear);
    for (int k = 0; k < 3; k++) {
        const double x = fmin(fmax(linear[k], 0), 1);
        rgb[k] = (float)(x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055);
    }
}

/** Box filter: the mean of factor x factor pixels, as three channels. */
static void shrink(const image *from, int factor, picture_kind kind, image *to)
{
    float colors[COLORS][3];
    for (int i = 0; i < COLORS && kind == PICTURE_ERROR; i++)
        error_color(i / (double)(COLORS - 1), colors[i]);
    const float weight = 1.0f / (float)(factor * factor);
    const size_t channels = (size_t)from->channels;
    for (int y = 0; y < to->height; y++)
        for (int x = 0; x < to->width; x++) {
            float sum[3] = {0};
            for (int v = 0; v < factor; v++)
                for (int u = 0; u < factor; u++) {
                    const float *pixel = from->pixels + ((size_t)(y * factor + v) * (size_t)from->width +
                                                         (size_t)(x * factor + u)) *
                                                            channels;
                    for (size_t k = 0; k < 3; k++)
                        sum[k] += weight * pixel[k < channels ? k : 0];
                }
            const float *color = sum;
            if (kind == PICTURE_ERROR)
                color = colors[(int)(fminf(fmaxf(sum[0], 0.0f), 1.0f) * (COLORS - 1) + 0.5f)];
            for (int k = 0; k < 3; k++)
                to->pixels[3 * ((size_t)y * (size_t)to->width + (size_t)x) + (size_t)k] = color[k];
        }
}

static int shrink_factor(int width, int height, size_t most)
{
    const int longest = width > height ? width : height, shortest = width > height ? height : width;
    int factor = (longest + LONGEST_SIDE - 1) / LONGEST_SIDE;
    while (factor < shortest && (size_t)(width / factor) * (size_t)(height / factor) > most)
        factor++;
    return factor <= shortest ? factor : shortest; /* a narrow strip keeps at least one row */
}

static void add_uri(text *out, const char *type, unsigned char *bytes, size_t count)
{
    text_format(out, "data:image/%s;base64,", type);
    text_base64(out, bytes, count);
    mem_free(bytes);
}

/** A picture as JPEG, scaled down if it is too large; *small gets its size. */
static gbt_status make_jpeg(const image *full, picture_kind kind, size_t most, image *small,
                            unsigned char **bytes, size_t *count, gbt_error *err)
{
    const int factor = shrink_factor(full->width, full->height, most);
    GBT_TRY(image_alloc(small, full->width / factor, full->height / factor, 3, err));
    shrink(full, factor, kind, small);
    return image_encode(small, JPEG_QUALITY, bytes, count, err);
}

gbt_status report_picture(text *out, const char *path, picture_kind kind, size_t most, int *width,
                          int *height)
{
    *width = *height = 0;
    image full = {0}, small = {0};
    unsigned char *jpeg = NULL;
    size_t jpeg_bytes = 0;
    gbt_error why = {0};
    if (out->status != GBT_OK)
        return out->status;
    gbt_status status = image_read(path, &full, &why);
    if (status == GBT_OK)
        status = make_jpeg(&full, kind, most, &small, &jpeg, &jpeg_bytes, &why);
    if (status == GBT_OK) {
        add_uri(out, "jpeg", jpeg, jpeg_bytes);
        *width = small.width;
        *height = small.height;
    } else if (status == GBT_ERR_NO_MEMORY) {
        out->status = base_fail(out->err, status, "%s", why.text);
    }
    image_free(&small);
    image_free(&full);
    return out->status;
}

void report_image_png(text *out, const image *picture)
{
    unsigned char *bytes;
    size_t count;
    if (out->status == GBT_OK)
        out->status = image_encode(picture, IMAGE_AS_PNG, &bytes, &count, out->err);
    if (out->status == GBT_OK)
        add_uri(out, "png", bytes, count);
}

void report_image_jpeg(text *out, const image *picture)
{
    image small = {0};
    unsigned char *bytes;
    size_t count;
    if (out->status == GBT_OK)
        out->status = make_jpeg(picture, PICTURE_COLOR, SIZE_MAX, &small, &bytes, &count, out->err);
    if (out->status == GBT_OK)
        add_uri(out, "jpeg", bytes, count);
    image_free(&small);
}

void report_picture_size(const char *path, int *width, int *height)
{
    image_header header;
    const bool is_read = image_header_read(path, &header, NULL) == GBT_OK;
    *width = is_read ? header.width : 0;
    *height = is_read ? header.height : 0;
}
