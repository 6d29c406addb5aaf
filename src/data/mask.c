/* SPDX-License-Identifier: Apache-2.0 */
/* data/mask.c -- turns masks and alpha channels into arrays of valid pixels. */
#include "data/mask.h"

#include <math.h>

#include "base/fail.h"
#include "base/memory.h"
#include "data/photo_size.h"

/* valid = valid and marks. Takes ownership of `marks`. */
static void combine(unsigned char *marks, size_t count, unsigned char **valid)
{
    if (*valid == NULL) {
        *valid = marks;
        return;
    }
    for (size_t i = 0; i < count; i++)
        (*valid)[i] = (*valid)[i] && marks[i];
    mem_free(marks);
}

/* A value of one pixel, which has 3 or 4 channels. */
typedef float (*pixel_value)(const float *pixel, size_t channels);

static float opacity(const float *pixel, size_t channels)
{
    return channels < 4 ? 1 : fminf(fmaxf(pixel[3], 0), 1);
}

/* Masks come in any colour, and as cut-outs with an alpha channel. */
static float brightness(const float *pixel, size_t channels)
{
    return fmaxf(pixel[0], fmaxf(pixel[1], pixel[2])) * opacity(pixel, channels);
}

/* 1 where `value` of the pixel is at least `least`, else 0. */
static gbt_status mark_pixels(const image *im, pixel_value value, float least, unsigned char **out,
                              gbt_error *err)
{
    const size_t count = (size_t)im->width * (size_t)im->height, channels = (size_t)im->channels;
    *out = mem_alloc(count, 1, "valid pixels", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        (*out)[i] = value(im->pixels + i * channels, channels) >= least;
    return GBT_OK;
}

static float half_of_largest(const image *im)
{
    const size_t channels = (size_t)im->channels;
    float largest = 0;
    for (size_t i = 0; i < (size_t)im->width * (size_t)im->height; i++)
        largest = fmaxf(largest, brightness(im->pixels + i * channels, channels));
    return largest > 0 ? 0.5f * largest : 1; /* black everywhere: no pixel reaches 1, none is valid */
}

static gbt_status read_marks(const char *path, const image *photo, unsigned char **out, gbt_error *err)
{
    image mask;
    GBT_TRY(image_read(path, &mask, err));
    gbt_status status = GBT_OK;
    if (!photo_same_aspect(mask.width, mask.height, photo->width, photo->height))
        status =
            base_fail(err, GBT_ERR_FORMAT,
                      "%s: mask does not have the photo's aspect (wanted %d x %d or a multiple, got %d x %d)",
                      path, photo->width, photo->height, mask.width, mask.height);
    if (status == GBT_OK)
        status = mark_pixels(&mask, brightness, half_of_largest(&mask), out, err);
    if (status == GBT_OK && (mask.width != photo->width || mask.height != photo->height)) {
        unsigned char *stored = *out;
        status = photo_resize_valid(stored, mask.width, mask.height, photo->width, photo->height, out, err);
        mem_free(stored);
    }
    image_free(&mask);
    return status;
}

gbt_status mask_apply(const scene_view *view, const image *stored, unsigned char **valid, gbt_error *err)
{
    const size_t count = (size_t)stored->width * (size_t)stored->height;
    unsigned char *marks = NULL;
    if (view->alpha == GBT_ALPHA_MASK && stored->channels == 4) {
        GBT_TRY(mark_pixels(stored, opacity, 0.5f, &marks, err));
        combine(marks, count, valid);
    }
    if (view->mask_path == NULL)
        return GBT_OK;
    marks = NULL;
    const gbt_status status = read_marks(view->mask_path, stored, &marks, err);
    if (status == GBT_OK)
        combine(marks, count, valid);
    else
        mem_free(marks);
    return status;
}
