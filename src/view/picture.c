/* SPDX-License-Identifier: Apache-2.0 */
/* view/picture.c -- answer a request for a picture: render it, or trace the current Gaussians again, and
   encode it. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "render/render_outputs.h"
#include "view/viewer.h"

/* In milliseconds. */
typedef struct picture_times {
    double prepare, trace, encode;
} picture_times;

/* ---- encoding ---- */

typedef struct rgba_work {
    const image *from;
    unsigned char *to;
} rgba_work;

static unsigned char byte_of(float value)
{
    const float scaled = value * 255 + 0.5f;
    return (unsigned char)(scaled > 0 ? scaled < 255 ? scaled : 255 : 0); /* NaN becomes 0 */
}

static void rgba_rows(size_t block, size_t begin, size_t end, void *context)
{
    const rgba_work *w = context;
    (void)block;
    const float *from = w->from->pixels + 3 * begin;
    unsigned char *to = w->to + 4 * begin;
    for (size_t i = 0; i < end - begin; i++, from += 3, to += 4) {
        to[0] = byte_of(from[0]);
        to[1] = byte_of(from[1]);
        to[2] = byte_of(from[2]);
        to[3] = 255;
    }
}

static gbt_status encode_raw(const image *im, answer *out, gbt_error *err)
{
    const size_t pixels = (size_t)im->width * (size_t)im->height;
    out->bytes = mem_alloc(pixels, 4, "picture", err);
    if (out->bytes == NULL)
        return GBT_ERR_NO_MEMORY;
    out->count = 4 * pixels;
    rgba_work work = {im, out->bytes};
    parallel_blocks(pixels, 1 << 16, rgba_rows, &work);
    return GBT_OK;
}

static gbt_status encode_float(const image *im, answer *out, gbt_error *err)
{
    const size_t count = (size_t)im->width * (size_t)im->height * (size_t)im->channels * sizeof *im->pixels;
    out->bytes = mem_alloc(count, 1, "picture", err);
    if (out->bytes == NULL)
        return GBT_ERR_NO_MEMORY;
    memcpy(out->bytes, im->pixels, count);
    out->count = count;
    return GBT_OK;
}

static gbt_status encode(const image *im, const request *what, answer *out, gbt_error *err)
{
    static const char *const types[] = {"application/octet-stream", "image/jpeg", "image/png",
                                        "application/octet-stream"};
    out->code = 200;
    out->type = types[what->format];
    if (what->format == REQUEST_FLOAT)
        return encode_float(im, out, err);
    if (what->format == REQUEST_RAW)
        return encode_raw(im, out, err);
    const int quality = what->format == REQUEST_PNG ? IMAGE_AS_PNG : what->quality;
    return image_encode(im, quality, &out->bytes, &out->count, err);
}

static gbt_status finish(const viewer_state *s, const image *im, const request *what, picture_times *times,
                         answer *out, gbt_error *err)
{
    const double begin = clock_wall();
    GBT_TRY(encode(im, what, out, err));
    times->encode = 1000 * (clock_wall() - begin);
    snprintf(out->about, sizeof out->about,
             "{\"width\":%d,\"height\":%d,\"channels\":%d,\"version\":%u,\"gaussians\":%zu,"
             "\"prepare_ms\":%.3f,\"trace_ms\":%.3f,\"encode_ms\":%.3f}",
             im->width, im->height, what->format == REQUEST_RAW ? 4 : im->channels, s->version,
             s->run->frame.gaussians.count, times->prepare, times->trace, times->encode);
    return GBT_OK;
}

/* ---- rendering ---- */

/* Element `n` of the Halton sequence (Halton 1960) in a base, in (0, 1). */
static double halton(int n, int base)
{
    double value = 0, digit = 1;
    for (; n > 0; n /= base) {
        digit /= base;
        value += digit * (n % base);
    }
    return value;
}

/* The camera of sample `n`, for antialiasing: its rays go through other points of the pixels. Sample 0 is the
   camera itself. */
static gbt_camera sample_camera(const gbt_camera *camera, int n)
{
    gbt_camera shifted = *camera;
    if (n > 0)
        gbt_camera_shifted(camera, halton(n, 2) - 0.5, halton(n, 3) - 0.5, &shifted);
    return shifted;
}

static unsigned output_index(unsigned bit)
{
    unsigned i = 0;
    while (bit >> i > 1)
        i++;
    return i;
}

gbt_status viewer_render(viewer_state *s, const request *what, answer *out, gbt_error *err)
{
    frame *f = &s->run->frame;
    gbt_camera camera, shifted;
    GBT_TRY(viewer_camera(s, what, &camera, err));
    shifted = sample_camera(&camera, what->sample);
    const bool traced = what->renderer == GBT_RENDERER_TRACE,
               whole = !traced || (what->output == 0 && what->sample == 0);
    const double begin = clock_wall();
    GBT_TRY(viewer_prepare(s, traced ? &camera : &shifted, what, whole, err));
    const double prepared = clock_wall(), before = 1000 * (prepared - begin);
    if (whole) {
        picture_times times = {.trace = fmin(1000 * f->times.trace.wall, before)}; /* 0 if it had been drawn
                                                                                      before */
        times.prepare = before - times.trace;
        return finish(s, &f->rgb, what, &times, out, err);
    }
    const ray_shot shot = ray_shot_of(&shifted);
    render_output_images images = {0};
    gbt_status status = render_outputs_trace(s->run, &shot, what->output, &images, err);
    picture_times times = {.prepare = before, .trace = 1000 * (clock_wall() - prepared)};
    if (status == GBT_OK)
        status = finish(s, what->output == 0 ? &images.rgb : &images.of[output_index(what->output)], what,
                        &times, out, err);
    render_output_images_free(&images);
    return status;
}

/* Which pixels of a photo count when it is scored. The result is kept in `f`. */
static gbt_status find_marks(const viewer_state *s, size_t view, const unsigned char *valid, frame *f,
                             const unsigned char **marks, gbt_error *err)
{
    const gbt_camera camera = photos_camera(&s->run->photos, view, 0);
    const ray_shot shot = ray_shot_of(&camera);
    GBT_TRY(ray_image_from_shot(&shot, 0, &f->rays, err));
    return frame_valid(f, valid, marks, err);
}

gbt_status viewer_photo(viewer_state *s, const request *what, answer *out, gbt_error *err)
{
    gbt_camera camera;
    picture_times times = {0};
    image photo = {0};
    frame lens = {0}; /* only its rays are used */
    const unsigned char *valid, *marks = NULL;
    GBT_TRY(viewer_camera(s, what, &camera, err)); /* fails if there is no such view */
    gbt_status status = photos_get(&s->run->photos, (size_t)what->view, 0, &photo, &valid, err);
    if (status == GBT_OK && what->format == REQUEST_RAW)
        status = find_marks(s, (size_t)what->view, valid, &lens, &marks, err);
    if (status == GBT_OK)
        status = finish(s, &photo, what, &times, out, err);
    for (size_t i = 0; status == GBT_OK && marks != NULL && i < out->count / 4; i++)
        out->bytes[4 * i + 3] = marks[i] ? 255 : 0;
    image_free(&photo);
    frame_free(&lens);
    return status;
}
