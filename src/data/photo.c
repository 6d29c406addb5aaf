/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo.c -- loads a photo as training needs it: three channels, alpha composited on a colour, and
   resampled to the requested size by area averaging. */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/image_header.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/mask.h"
#include "data/photo_size.h"
#include "data/scene.h"

/* Convert three or four channels to three. `premultiplied`: the colours are already multiplied by alpha.
   image_read() gives finite values, and clamping alpha to [0, 1] keeps them finite. If alpha is a mask,
   premultiplied colours are divided by it, but only where it is at least 1/2: below that the pixel is
   excluded anyway. */
static gbt_status to_rgb(const image *in, gbt_alpha kind, bool premultiplied, image *out, gbt_error *err)
{
    const float behind = kind == GBT_ALPHA_WHITE;
    const bool is_mask = kind == GBT_ALPHA_MASK;
    GBT_TRY(image_alloc(out, in->width, in->height, 3, err));
    const size_t count = (size_t)in->width * (size_t)in->height, channels = (size_t)in->channels;
    for (size_t i = 0; i < count; i++) {
        const float *pixel = in->pixels + i * channels;
        const float opacity = channels < 4 ? 1 : fminf(fmaxf(pixel[3], 0), 1);
        const float alpha = is_mask ? 1 : opacity;
        const float scale = !premultiplied ? alpha : is_mask && opacity >= 0.5f ? 1 / opacity : 1;
        for (size_t c = 0; c < 3; c++)
            out->pixels[3 * i + c] = pixel[c] * scale + behind * (1 - alpha);
    }
    return GBT_OK;
}

/* The EXR specification says that colours are premultiplied, PNG's that they are not; image_read() converts
   neither. */
static gbt_status is_premultiplied(const char *path, const image *stored, bool *out, gbt_error *err)
{
    image_header header;
    *out = false;
    if (stored->channels < 4)
        return GBT_OK;
    GBT_TRY(image_header_read(path, &header, err));
    *out = header.kind == IMAGE_EXR;
    return GBT_OK;
}

static void warn_of_pixels(const char *path, const image *stored, const unsigned char *valid)
{
    size_t bad = 0;
    for (size_t i = 0; i < (size_t)stored->width * (size_t)stored->height; i++)
        bad += !valid[i];
    log_warn("%s: %zu pixels with values that are not finite are left out of training and scores", path, bad);
}

/* Read a photo, check its aspect ratio and apply its mask; `valid` is optional (NULL). */
static gbt_status read_stored(const scene_view *view, image *stored, unsigned char **valid, gbt_error *err)
{
    GBT_TRY(image_read_valid(view->path, stored, valid, err));
    if (valid != NULL && *valid != NULL)
        warn_of_pixels(view->path, stored, *valid);
    if (photo_same_aspect(stored->width, stored->height, view->camera.width, view->camera.height))
        return valid != NULL ? mask_apply(view, stored, valid, err) : GBT_OK;
    return base_fail(
        err, GBT_ERR_FORMAT,
        "%s: photo does not have the camera's aspect (wanted %d x %d or a multiple, got %d x %d)", view->path,
        view->camera.width, view->camera.height, stored->width, stored->height);
}

/* The transparency of a stored photo (1 - alpha), resampled. `out` stays empty if the photo is opaque. */
static gbt_status read_transparency(const image *stored, gbt_alpha kind, int width, int height, image *out,
                                    gbt_error *err)
{
    if (kind == GBT_ALPHA_MASK || !image_is_transparent(stored))
        return GBT_OK;
    image at_stored;
    GBT_TRY(image_alloc(&at_stored, stored->width, stored->height, 1, err));
    for (size_t i = 0; i < (size_t)stored->width * (size_t)stored->height; i++)
        at_stored.pixels[i] = 1 - fminf(fmaxf(stored->pixels[4 * i + 3], 0), 1);
    const gbt_status status = photo_resize(&at_stored, width, height, out, err);
    image_free(&at_stored);
    return status;
}

/* `valid` and `transparency` are optional (NULL). */
static gbt_status read_photo(const scene_view *view, int width, int height, image *out, unsigned char **valid,
                             image *transparency, gbt_error *err)
{
    image stored = {0}, rgb = {0};
    memset(out, 0, sizeof *out);
    if (view->path == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: a camera without a photo", view->name);
    if (width < 1 || height < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: photo wanted at %d x %d (wanted both >= 1)", view->path,
                         width, height);
    bool premultiplied = false;
    gbt_status status = read_stored(view, &stored, valid, err);
    if (status == GBT_OK)
        status = is_premultiplied(view->path, &stored, &premultiplied, err);
    if (status == GBT_OK && stored.channels == 3) {
        rgb = stored;
        stored = (image){0};
    } else if (status == GBT_OK) {
        status = to_rgb(&stored, view->alpha, premultiplied, &rgb, err);
    }
    if (status == GBT_OK && transparency != NULL)
        status = read_transparency(&stored, view->alpha, width, height, transparency, err);
    image_free(&stored);
    if (status == GBT_OK && rgb.width == width && rgb.height == height) {
        *out = rgb;
        rgb = (image){0};
    } else if (status == GBT_OK) {
        status = photo_resize(&rgb, width, height, out, err);
        if (status == GBT_OK && valid != NULL && *valid != NULL) {
            unsigned char *stored_valid = *valid;
            status = photo_resize_valid(stored_valid, rgb.width, rgb.height, width, height, valid, err);
            mem_free(stored_valid);
        }
    }
    image_free(&rgb);
    if (status != GBT_OK)
        image_free(out);
    return status;
}

gbt_status scene_read_photo(const scene_view *view, int width, int height, image *out, gbt_error *err)
{
    return read_photo(view, width, height, out, NULL, NULL, err);
}

static gbt_status read_whole(const scene_view *view, int width, int height, image *out, unsigned char **valid,
                             image *transparency, gbt_error *err)
{
    *valid = NULL;
    const gbt_status status = read_photo(view, width, height, out, valid, transparency, err);
    if (status != GBT_OK) {
        mem_free(*valid);
        *valid = NULL;
    }
    return status;
}

gbt_status scene_read_photo_valid(const scene_view *view, int width, int height, image *out,
                                  unsigned char **valid, gbt_error *err)
{
    return read_whole(view, width, height, out, valid, NULL, err);
}

gbt_status scene_read_photo_transparency(const scene_view *view, int width, int height, image *out,
                                         unsigned char **valid, image *transparency, gbt_error *err)
{
    *transparency = (image){0};
    const gbt_status status = read_whole(view, width, height, out, valid, transparency, err);
    if (status != GBT_OK)
        image_free(transparency);
    return status;
}
