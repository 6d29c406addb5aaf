/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_size.c -- resamples images by exact area averaging, and compares aspect ratios. */
#include "data/photo_size.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/memory.h"

/* The input pixels that output pixel i of `out_count` covers, and how much of each. Edges are integers in
   units of 1 / out_count input pixels, so the weights are exact and sum to exactly in_count. */
typedef struct box {
    uint64_t begin, end; /* in those units; the first covered pixel is begin / out_count, the last has pixel *
                            out_count < end */
    uint64_t out_count;
} box;

static box box_of(size_t i, size_t in_count, size_t out_count)
{
    return (box){
        .begin = (uint64_t)i * in_count, .end = (uint64_t)i * in_count + in_count, .out_count = out_count};
}

static double box_weight(const box *b, uint64_t pixel)
{
    const uint64_t left = pixel * b->out_count > b->begin ? pixel * b->out_count : b->begin;
    const uint64_t right = (pixel + 1) * b->out_count < b->end ? (pixel + 1) * b->out_count : b->end;
    return (double)(right - left);
}

/* Resample one row from `in_count` to `out_count` pixels. */
static void resample_horizontally(const float *in, size_t in_count, size_t channels, float *out,
                                  size_t out_count)
{
    for (size_t i = 0; i < out_count; i++) {
        const box b = box_of(i, in_count, out_count);
        double sum[4] = {0};
        for (uint64_t pixel = b.begin / out_count; pixel * out_count < b.end; pixel++) {
            const double weight = box_weight(&b, pixel);
            for (size_t c = 0; c < channels; c++)
                sum[c] += weight * (double)in[pixel * channels + c];
        }
        for (size_t c = 0; c < channels; c++)
            out[i * channels + c] = (float)(sum[c] / (double)in_count);
    }
}

/* Row i of the output, as a weighted mean of input rows of `values` numbers; `sum` is scratch. */
static void resample_vertically(const float *in, size_t in_count, size_t values, double *sum, float *out,
                                size_t i, size_t out_count)
{
    const box b = box_of(i, in_count, out_count);
    memset(sum, 0, values * sizeof *sum);
    for (uint64_t pixel = b.begin / out_count; pixel * out_count < b.end; pixel++) {
        const double weight = box_weight(&b, pixel);
        const float *row = in + pixel * values;
        for (size_t x = 0; x < values; x++)
            sum[x] += weight * (double)row[x];
    }
    for (size_t x = 0; x < values; x++)
        out[x] = (float)(sum[x] / (double)in_count);
}

gbt_status photo_resize(const image *in, int width, int height, image *out, gbt_error *err)
{
    image narrow = {0};
    const size_t channels = (size_t)in->channels, in_width = (size_t)in->width,
                 in_height = (size_t)in->height;
    const size_t values = (size_t)width * channels;
    memset(out, 0, sizeof *out);
    double *sum = mem_alloc(values, sizeof *sum, "photo", err);
    gbt_status status =
        sum == NULL ? GBT_ERR_NO_MEMORY : image_alloc(&narrow, width, in->height, in->channels, err);
    if (status == GBT_OK)
        status = image_alloc(out, width, height, in->channels, err);
    if (status == GBT_OK) {
        for (size_t y = 0; y < in_height; y++)
            resample_horizontally(in->pixels + y * in_width * channels, in_width, channels,
                                  narrow.pixels + y * values, (size_t)width);
        for (size_t y = 0; y < (size_t)height; y++)
            resample_vertically(narrow.pixels, in_height, values, sum, out->pixels + y * values, y,
                                (size_t)height);
    }
    image_free(&narrow);
    mem_free(sum);
    return status;
}

gbt_status photo_resize_valid(const unsigned char *in, int in_width, int in_height, int width, int height,
                              unsigned char **out, gbt_error *err)
{
    image bad = {0}, resized = {0};
    *out = NULL;
    gbt_status status = image_alloc(&bad, in_width, in_height, 1, err);
    for (size_t i = 0; status == GBT_OK && i < (size_t)in_width * (size_t)in_height; i++)
        bad.pixels[i] = in[i] == 0;
    if (status == GBT_OK)
        status = photo_resize(&bad, width, height, &resized, err);
    if (status == GBT_OK) {
        const size_t count = (size_t)width * (size_t)height;
        *out = mem_alloc(count, 1, "valid pixels", err);
        status = *out == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
        for (size_t i = 0; status == GBT_OK && i < count; i++)
            (*out)[i] = !(resized.pixels[i] > 0);
    }
    image_free(&bad);
    image_free(&resized);
    return status;
}

bool photo_same_aspect(int width0, int height0, int width1, int height1)
{
    const bool first_is_small = width0 <= width1;
    const double w0 = first_is_small ? width0 : width1, h0 = first_is_small ? height0 : height1;
    const double w1 = first_is_small ? width1 : width0, h1 = first_is_small ? height1 : height0;
    return fabs(h1 * w0 / w1 - h0) <= 1 || fabs(w1 * h0 / h1 - w0) <= 1;
}
